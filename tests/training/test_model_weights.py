"""Weights of exported models: recovered exactly, and trained further."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.synthetic import TINY_PATCHES
from helpers.tiny_model import TINY, export_tiny_model

torch = pytest.importorskip("torch")

from cbagan_ompl import ConfigError, ModelError, load_model
from cbagan_ompl.networks.export_model import make_region_model
from cbagan_ompl.networks.factory import make_generator
from cbagan_ompl.training.batches import encode, make_batch
from cbagan_ompl.training.checkpoints import load_checkpoint
from cbagan_ompl.training.loop import train
from cbagan_ompl.training.model_weights import (
    estimate_statistics,
    recover_generator,
    starting_weights,
)
from cbagan_ompl.training.task_sources import DatasetSource
from cbagan_ompl.training.torchscript import save_script

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def exported(folder: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return export_tiny_model(folder, tmp_path_factory.mktemp("model"))


def inputs(side: int) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
    rng = torch.Generator().manual_seed(1)
    free = (torch.rand(3, 1, side, side + 8, generator=rng) < 0.8).float()
    start, goal = (torch.rand(3, 2, generator=rng) * side for _ in range(2))
    return free, start, goal


@pytest.mark.parametrize("name", ["cbagan", "sagan", "cbagan-none", "cbagan-worlds"])
@torch.no_grad()
def test_recovered_generators_compute_what_the_models_do(name: str) -> None:
    path = ROOT / "models" / f"{name}.pt"
    generator = recover_generator(path)
    task = inputs(128)
    expected = load_model(path).module(*task)
    assert expected.std() > 0.01, "or any generator would do"
    torch.testing.assert_close(make_region_model(generator)(*task), expected, atol=1e-4, rtol=0)


@torch.no_grad()
def test_statistics_change_nothing_but_how_training_begins(
    exported: Path, source: DatasetSource
) -> None:
    generator = recover_generator(exported)
    images = encode(make_batch(source.validation, np.arange(1), torch.device("cpu")))
    arguments = (images.map, images.points, torch.zeros_like(images.map[:, :1]))
    before = generator(*arguments)
    raw = generator.train()(*arguments)
    generator = recover_generator(exported)
    estimate_statistics(generator, source.validation)
    torch.testing.assert_close(generator(*arguments), before, atol=1e-4, rtol=0)
    trained = generator.train()(*arguments)
    assert (trained - before).abs().max() < 0.2 * (raw - before).abs().max()


def test_a_run_starts_from_an_exported_model(
    exported: Path, source: DatasetSource, tmp_path: Path
) -> None:
    still = TINY.updated({"epochs": 1, "generator_lr": 1e-12, "ema_decay": 0})
    start = starting_weights(exported, source.validation)["average"]
    run = train(source, still, tmp_path / "run", start_from=exported, device="cpu", progress=False)
    weights = load_checkpoint(run["checkpoint"])["gan"]["generator"]
    for name, value in start.items():
        if name.endswith(("weight", "bias")):
            torch.testing.assert_close(weights[name], value, rtol=0, atol=1e-6)
    with pytest.raises(ConfigError, match="other networks"):
        train(source, still, tmp_path / "other", start_from="cbagan", progress=False)


def test_models_that_cannot_be_recovered(
    exported: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    record: dict[str, Any] = load_model(exported).record
    wider = TINY_PATCHES.network
    record = record | {"recipe": record["recipe"] | {"widths": list(wider.widths)}}
    generator = make_generator(TINY.network).eval()
    save_script(make_region_model(generator), tmp_path / "other.pt", record)
    with pytest.raises(ModelError, match=r"cannot be recovered \(it has other weights"):
        recover_generator(tmp_path / "other.pt")
    monkeypatch.setattr("cbagan_ompl.training.model_weights._TOLERANCE", 0.0)
    with pytest.raises(ModelError, match="the result differs by"):
        recover_generator(exported)
