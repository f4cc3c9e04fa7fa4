from __future__ import annotations

from pathlib import Path

import pytest
from helpers.tiny_model import TINY
from helpers.training_set import write_training_set

from cbagan_ompl.datasets.dataset import Dataset, load_dataset
from cbagan_ompl.training.task_sources import DatasetSource


@pytest.fixture(scope="session")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_training_set(tmp_path_factory.mktemp("data") / "tiny")


@pytest.fixture(scope="session")
def dataset(folder: Path) -> Dataset:
    return load_dataset(folder)


@pytest.fixture(scope="session")
def source(dataset: Dataset) -> DatasetSource:
    return DatasetSource(dataset, TINY.validation_fraction, TINY.seed)
