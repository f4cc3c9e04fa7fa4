from __future__ import annotations

from pathlib import Path

import pytest
from helpers.tiny_model import export_tiny_model
from helpers.training_set import write_training_set


@pytest.fixture(scope="session")
def exported(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A model file, with its card and the manifest, in a folder of their own."""
    dataset = write_training_set(tmp_path_factory.mktemp("data") / "tiny")
    return export_tiny_model(dataset, tmp_path_factory.mktemp("models"))


@pytest.fixture(scope="session")
def checkpoint(exported: Path) -> Path:
    """The checkpoint that the model was exported from."""
    return exported.parent / "run" / "best.pt"
