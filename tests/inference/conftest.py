from __future__ import annotations

from pathlib import Path

import pytest
from helpers.training_set import TINY, write_training_set


@pytest.fixture(scope="session")
def checkpoint(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The best epoch of a short training run."""
    pytest.importorskip("torch")
    from cbagan_ompl.datasets.dataset import load_dataset
    from cbagan_ompl.training.loop import train
    from cbagan_ompl.training.task_sources import DatasetSource

    folder = tmp_path_factory.mktemp("run")
    dataset = load_dataset(write_training_set(folder / "tiny"))
    source = DatasetSource(dataset, TINY.validation_fraction, TINY.seed)
    config = TINY.updated({"epochs": 1})
    return Path(train(source, config, folder / "out", device="cpu", progress=False)["checkpoint"])


@pytest.fixture(scope="session")
def exported(checkpoint: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A model file, with its card and the manifest."""
    from cbagan_ompl.training.export import export

    path = tmp_path_factory.mktemp("models") / "tiny.pt"
    export(checkpoint, path, note="Made by the tests.")
    return path
