"""Damaged and crafted checkpoints: whatever is done with them, a clear error or a result."""

from __future__ import annotations

import copy
import io
import os
import random
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from helpers.damaged_archives import damaged_members
from helpers.fuzzing import mutations, read_all
from helpers.tiny_model import TINY

torch = pytest.importorskip("torch")

from cbagan_ompl import ConfigError, ModelError
from cbagan_ompl.training.checkpoints import best_generator, load_checkpoint, save_checkpoint
from cbagan_ompl.training.export import make_record, model_card
from cbagan_ompl.training.gan import Gan
from cbagan_ompl.training.loop import train
from cbagan_ompl.training.task_sources import DatasetSource

CONFIG = TINY.updated({"epochs": 1})
ODD = (None, 0, -1, 10**30, 1.5, float("nan"), "x", [], {}, [1], True, torch.zeros(0), (1, 2))


@pytest.fixture(scope="module")
def checkpoint(source: DatasetSource, tmp_path_factory: pytest.TempPathFactory) -> Path:
    run = train(source, CONFIG, tmp_path_factory.mktemp("run"), device="cpu", progress=False)
    return Path(run["checkpoint"])


def odd_states(valid: dict[str, Any], count: int, seed: int) -> Iterator[bytes]:
    """Yield checkpoints with a value of another type, or one that is missing."""
    rng = random.Random(seed)
    for _ in range(count):
        state = copy.deepcopy(valid)
        node: Any = state
        while True:
            key = rng.choice(list(node)) if isinstance(node, dict) else rng.randrange(len(node))
            if isinstance(node[key], dict | list) and node[key] and rng.random() < 0.85:
                node = node[key]
                continue
            if isinstance(node, dict) and rng.random() < 0.2:
                del node[key]
            else:
                node[key] = rng.choice(ODD)
            break
        buffer = io.BytesIO()
        torch.save(state, buffer)
        yield buffer.getvalue()


@pytest.mark.slow
def test_any_damage_is_an_error_of_ours(checkpoint: Path, tmp_path: Path) -> None:
    valid = checkpoint.read_bytes()
    path = tmp_path / "best.pt"
    gan = Gan(CONFIG, torch.device("cpu"))

    def read(data: bytes) -> None:
        path.write_bytes(data)
        state = load_checkpoint(path)
        model_card(make_record("name", state, best_generator(state, path)))
        gan.start_from(state["gan"])

    counts = read_all(read, mutations([valid], 30, seed=1))
    counts += read_all(read, damaged_members(valid, 30, seed=2))
    counts += read_all(read, odd_states(load_checkpoint(checkpoint), 40, seed=3))
    assert counts["refused"] > 70


def change(checkpoint: Path, path: Path, edit: Callable[[dict[str, Any]], object]) -> Path:
    state = load_checkpoint(checkpoint)
    edit(state)
    save_checkpoint(state, path)
    return path


def with_other_shapes(state: dict[str, Any]) -> None:
    for entry in state["gan"]["optimizers"]["generator"]["state"].values():
        entry["exp_avg"] = torch.zeros(1)


@pytest.mark.parametrize(
    "edit",
    [
        lambda state: state["gan"]["generator"].popitem(),
        lambda state: state["gan"]["optimizers"].pop("generator"),
        lambda state: state["gan"]["optimizers"]["generator"]["param_groups"].pop(),
        lambda state: state["gan"]["optimizers"]["generator"]["param_groups"][0].update(eps="x"),
        with_other_shapes,
        lambda state: state.update(rng="[" * 100_000),
        lambda state: state.update(rng="{}"),
        lambda state: state.update(noise_rng=torch.zeros(3)),
        lambda state: state.update(history=[]),
        lambda state: state["history"][0]["validation"].update(iou="high"),
    ],
)
def test_a_run_does_not_resume_from_a_damaged_state(
    checkpoint: Path, source: DatasetSource, tmp_path: Path, edit: Callable[[dict[str, Any]], Any]
) -> None:
    change(checkpoint, tmp_path / "last.pt", edit)
    with pytest.raises(ModelError, match=r"last\.pt: damaged"):
        train(source, CONFIG, tmp_path, resume=True, device="cpu", progress=False)


@pytest.mark.parametrize(
    ("edit", "message"),
    [
        (lambda state: state["config"].update(widths=[4096] * 8), "the most is 8,388,608"),
        (lambda state: state["config"].update(widths=[10**9] * 4), "widths are at most"),
        (lambda state: state["config"].update(stem=8), "do not fit"),
        (lambda state: state["config"].update(unknown=1), "unknown option"),
        (lambda state: state["dataset"].update(side=6000), "dataset.side"),
        (lambda state: state["dataset"].update(name=7), "dataset.name"),
        (lambda state: state["dataset"].update(more=torch.zeros(1)), "texts and numbers"),
        (lambda state: state.update(trivial={"line": {}}), r"line\.iou"),
        (lambda state: state["dataset"].update(synthetic={"seed": 1}), "hard_fraction"),
        (
            lambda state: next(iter(state["gan"]["average"].values())).fill_(float("nan")),
            "not finite",
        ),
    ],
)
def test_configurations_and_descriptions_that_make_no_sense(
    checkpoint: Path, tmp_path: Path, edit: Callable[[dict[str, Any]], object], message: str
) -> None:
    path = change(checkpoint, tmp_path / "best.pt", edit)
    with pytest.raises(ModelError, match=message):
        best_generator(load_checkpoint(path), path)


@pytest.mark.parametrize(
    "craft",
    [
        lambda path: os.truncate(path, 2**40),
        lambda path: path.unlink() or path.symlink_to("/dev/zero"),
        lambda path: path.unlink() or os.mkfifo(path),
        lambda path: path.unlink() or path.mkdir(),
        lambda path: zipfile.ZipFile(path, "w").close(),
    ],
)
def test_crafted_files(tmp_path: Path, craft: Callable[[Path], object]) -> None:
    path = tmp_path / "best.pt"
    path.touch()
    craft(path)
    with pytest.raises(ModelError):
        load_checkpoint(path)


def test_weights_that_overflow(checkpoint: Path, source: DatasetSource, tmp_path: Path) -> None:
    def enlarge(state: dict[str, Any]) -> None:
        for weights in state["gan"]["average"].values():
            if weights.is_floating_point():
                weights.fill_(1e38)

    path = change(checkpoint, tmp_path / "last.pt", enlarge)
    with pytest.raises(ConfigError, match="not finite"):
        train(source, CONFIG, tmp_path / "run", start_from=path, device="cpu", progress=False)
