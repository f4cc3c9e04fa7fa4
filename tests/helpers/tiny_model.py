"""A recipe for networks of a few hundred parameters, and a model made with it."""

from __future__ import annotations

from pathlib import Path

import pytest

from cbagan_ompl.datasets.dataset import load_dataset
from cbagan_ompl.networks.config import NetworkConfig
from cbagan_ompl.training.config import TrainingConfig
from cbagan_ompl.training.task_sources import DatasetSource

TINY = TrainingConfig(
    network=NetworkConfig(widths=(4, 4, 6, 8), discriminator_width=4),
    epochs=2,
    batch_size=4,
    adversarial_every=2,
)


def export_tiny_model(dataset: Path, root: Path) -> Path:
    """Train on a set and export ``tiny.pt``; the checkpoints are in ``run``, both in the root."""
    pytest.importorskip("torch")
    from cbagan_ompl.training.export import export
    from cbagan_ompl.training.loop import train

    config = TINY.updated({"epochs": 1})
    source = DatasetSource(load_dataset(dataset), config.validation_fraction, config.seed)
    run = train(source, config, root / "run", device="cpu", progress=False)
    export(run["checkpoint"], root / "tiny.pt")
    return root / "tiny.pt"
