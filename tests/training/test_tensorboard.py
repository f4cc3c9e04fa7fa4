from __future__ import annotations

import sys
from pathlib import Path

import pytest
from helpers.tiny_model import TINY

pytest.importorskip("torch")

from cbagan_ompl import MissingDependencyError
from cbagan_ompl.training.checkpoints import load_checkpoint
from cbagan_ompl.training.loop import train
from cbagan_ompl.training.task_sources import DatasetSource


def test_tensorboard_is_optional(
    source: DatasetSource, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "torch.utils.tensorboard", None)
    with pytest.raises(MissingDependencyError, match=r"pip install -e '.\[tensorboard\]'"):
        train(source, TINY, tmp_path, device="cpu", progress=False, tensorboard=True)


def test_tensorboard_gets_losses_and_scores(source: DatasetSource, tmp_path: Path) -> None:
    pytest.importorskip("tensorboard")
    from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

    train(source, TINY, tmp_path, device="cpu", progress=False, tensorboard=True)
    events = EventAccumulator(str(tmp_path)).Reload()
    history = load_checkpoint(tmp_path / "last.pt")["history"]
    for group, name in (("validation", "iou"), ("losses", "pixel")):
        values = [event.value for event in events.Scalars(f"{group}/{name}")]
        assert values == pytest.approx([entry[group][name] for entry in history])
