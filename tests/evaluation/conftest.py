from __future__ import annotations

from pathlib import Path

import pytest
from helpers.training_set import write_training_set

from cbagan_ompl.datasets.dataset import Dataset, load_dataset


@pytest.fixture(scope="session")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_training_set(tmp_path_factory.mktemp("data") / "set", maps=4)


@pytest.fixture(scope="session")
def dataset(folder: Path) -> Dataset:
    return load_dataset(folder)
