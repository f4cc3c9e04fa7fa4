"""A network of a few hundred parameters, trained for one epoch."""

from __future__ import annotations

from pathlib import Path

import pytest

from cbagan_ompl.datasets.dataset import load_dataset


def export_tiny_model(dataset: Path, root: Path) -> Path:
    """Train on a set and export ``tiny.pt``; the checkpoints are in ``run``, both in the root."""
    pytest.importorskip("torch")
    from cbagan_ompl.training.config import TrainingConfig
    from cbagan_ompl.training.export import export
    from cbagan_ompl.training.loop import train
    from cbagan_ompl.training.task_sources import DatasetSource

    config = TrainingConfig(epochs=1, batch_size=4, widths=(4, 4, 6, 8), discriminator_width=4)
    source = DatasetSource(load_dataset(dataset), config.validation_fraction, config.seed)
    run = train(source, config, root / "run", device="cpu", progress=False)
    export(run["checkpoint"], root / "tiny.pt")
    return root / "tiny.pt"
