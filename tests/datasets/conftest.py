from __future__ import annotations

from pathlib import Path

import pytest
from helpers.training_set import generate_small_set

from cbagan_ompl.datasets.dataset import Dataset, load_dataset


@pytest.fixture(scope="session")
def small_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return generate_small_set(tmp_path_factory.mktemp("sets") / "small")


@pytest.fixture(scope="session")
def small_dataset(small_folder: Path) -> Dataset:
    return load_dataset(small_folder)
