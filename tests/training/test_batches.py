from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from helpers.patches import CONFIG as PATCHES
from helpers.tiny_model import TINY
from helpers.training_set import SIDE

torch = pytest.importorskip("torch")

from cbagan_ompl import DatasetError
from cbagan_ompl.datasets.dataset import Dataset
from cbagan_ompl.datasets.synthetic import SyntheticSettings, generate_map_tasks
from cbagan_ompl.networks.config import NetworkConfig
from cbagan_ompl.training.batches import (
    apply_symmetry,
    check_trainable,
    make_batch,
    scale_down,
    turn_vectors,
)
from cbagan_ompl.training.config import TrainingConfig
from cbagan_ompl.training.loop import train
from cbagan_ompl.training.task_sources import DatasetSource

CPU = torch.device("cpu")


def test_symmetries_move_points_with_the_images(dataset: Dataset) -> None:
    tasks = dataset.train
    free, region = tasks.maps[tasks.map_of[0]], tasks.region[0]
    endpoints = np.stack((tasks.start[0], tasks.goal[0]))
    seen = set()
    for code in range(8):
        turned_free, turned, moved = apply_symmetry(code, free, region, endpoints)
        assert turned.sum() == region.sum()
        for before, after in zip(endpoints.astype(int), moved.astype(int), strict=True):
            assert turned[after[1], after[0]] == region[before[1], before[0]]
        seen.add((turned_free.tobytes(), turned.tobytes()))
    assert len(seen) == 8


def test_smaller_maps_keep_passages_and_regions(dataset: Dataset) -> None:
    batch = make_batch(dataset.train, np.arange(3), CPU)
    assert scale_down(batch, 1) is batch
    half = scale_down(batch, 2)
    assert half.free.shape == half.region.shape == (3, 1, SIDE // 2, SIDE // 2)
    assert torch.equal(half.start, batch.start / 2)
    for small, full in ((half.free, batch.free), (half.region, batch.region)):
        blocks = full.unfold(2, 2, 2).unfold(3, 2, 2)
        assert torch.equal(small, blocks.amax((4, 5)))


def test_augmented_batches_are_seeded(dataset: Dataset) -> None:
    def augmented(seed: int) -> torch.Tensor:
        rng = np.random.default_rng(seed)
        batch = make_batch(dataset.train, np.arange(8), CPU, rng, symmetries=True, reversal=True)
        return torch.cat((batch.start, batch.goal, batch.region.flatten(1)), 1)

    assert torch.equal(augmented(0), augmented(0))
    assert not torch.equal(augmented(0), augmented(1))


def test_images_of_a_size_that_the_networks_cannot_take(dataset: Dataset, tmp_path: Path) -> None:
    cut = replace(dataset.train, maps=dataset.train.maps[:, :20, :20])
    cut = replace(cut, region=cut.region[:, :20, :20])
    source = DatasetSource(replace(dataset, train=cut), TINY.validation_fraction, TINY.seed)
    with pytest.raises(DatasetError, match="a multiple of 16 pixels; these have 20"):
        train(source, TINY, tmp_path, device="cpu", progress=False)


def test_sizes_are_multiples_of_the_stride() -> None:
    config = TrainingConfig(network=PATCHES)
    check_trainable(128, config)
    with pytest.raises(DatasetError, match="a multiple of 64 pixels; these have 96"):
        check_trainable(96, config)


@pytest.mark.parametrize(
    ("patch", "scales", "smallest"),
    [(1, (1,), 16), (1, (1, 2), 32), (4, (1,), 64), (4, (1, 1, 1, 2), 128), (4, (1, 3), 192)],
)
def test_the_smallest_images(patch: int, scales: tuple[int, ...], smallest: int) -> None:
    network = NetworkConfig(widths=(8, 16, 16), patch=patch)
    config = TrainingConfig(network=network, scales=scales)
    check_trainable(smallest, config)
    message = (
        f"discriminators take images of at least {smallest} pixels; these have {smallest // 2}"
    )
    with pytest.raises(DatasetError, match=message):
        check_trainable(smallest // 2, config)


@pytest.mark.parametrize("code", range(8))
def test_symmetries_turn_directions_with_the_images(code: int) -> None:
    size = 32
    free = np.ones((size, size), np.uint8)
    # Two pixels, and the direction from the patch of the first one to that of the second.
    endpoints = np.array([[6.5, 9.5], [26.5, 17.5]], np.float32)
    vectors = np.zeros((2, size // 4, size // 4), np.float16)
    step = endpoints[1] - endpoints[0]
    vectors[:, 2, 1] = step
    _, _, moved = apply_symmetry(code, free, free, endpoints)
    turned = turn_vectors(code, vectors)
    column, row = (moved[0] // 4).astype(int)
    assert turned[:, row, column].tolist() == (moved[1] - moved[0]).tolist()
    assert (turned != 0).any(0).sum() == 1


def test_batches_of_tasks_with_directions() -> None:
    tasks = generate_map_tasks(SyntheticSettings(size=64), 0, 0)
    assert tasks.direction is not None
    batch = make_batch(tasks, np.arange(4), CPU)
    assert torch.equal(batch.direction, torch.from_numpy(tasks.direction[:4]).float())
    assert scale_down(batch, 2).direction.shape == (4, 2, 8, 8)
    rng = np.random.default_rng(0)
    # Of the way back nothing is known.
    swapped = make_batch(tasks, np.arange(4).repeat(8), CPU, rng, reversal=True)
    known = (swapped.direction != 0).flatten(1).any(1)
    first = torch.from_numpy(tasks.start[:4].repeat(8, axis=0))
    assert torch.equal(known, (swapped.start == first).all(1))
    assert 0 < known.sum() < len(known)
