from __future__ import annotations

from pathlib import Path

import pytest
from helpers.tiny_model import TINY

torch = pytest.importorskip("torch")

from cbagan_ompl import ModelError
from cbagan_ompl.training.checkpoints import (
    SCHEMA,
    best_generator,
    load_checkpoint,
    save_checkpoint,
)
from cbagan_ompl.training.loop import train
from cbagan_ompl.training.task_sources import DatasetSource


def test_checkpoint_that_is_none(source: DatasetSource, tmp_path: Path) -> None:
    (tmp_path / "last.pt").write_text("text")
    with pytest.raises(ModelError, match="not a training checkpoint, or a damaged one"):
        train(source, TINY, tmp_path, resume=True, progress=False)


@pytest.mark.parametrize(
    ("schema", "message"),
    [
        (SCHEMA - 1, "an older version of cbagan-ompl; export it with that version, or train"),
        (SCHEMA + 1, "a newer version of cbagan-ompl"),
        (None, "not a training checkpoint of cbagan-ompl"),
    ],
)
def test_checkpoints_of_other_versions(tmp_path: Path, schema: int | None, message: str) -> None:
    save_checkpoint({"schema": schema}, tmp_path / "last.pt")
    with pytest.raises(ModelError, match=message):
        load_checkpoint(tmp_path / "last.pt")


def test_weights_without_a_schema(tmp_path: Path) -> None:
    torch.save([torch.zeros(1)], tmp_path / "last.pt")
    with pytest.raises(ModelError, match="not a training checkpoint of cbagan-ompl"):
        load_checkpoint(tmp_path / "last.pt")


def test_a_checkpoint_that_cannot_be_written(tmp_path: Path) -> None:
    with pytest.raises(ModelError, match="cannot write"):
        save_checkpoint({"schema": SCHEMA}, tmp_path / "none" / "last.pt")


@pytest.mark.parametrize("decay", [0.0, 0.5])
def test_what_is_exported_is_what_was_validated(
    source: DatasetSource, tmp_path: Path, decay: float
) -> None:
    config = TINY.updated({"epochs": 1, "ema_decay": decay})
    state = load_checkpoint(
        train(source, config, tmp_path, device="cpu", progress=False)["checkpoint"]
    )
    wanted, other = ("average", "generator") if decay else ("generator", "average")
    state["gan"][other] = {}
    weights = best_generator(state).state_dict()
    for name, value in state["gan"][wanted].items():
        assert torch.equal(weights[name], value)
