from __future__ import annotations

from math import inf

import numpy as np
import pytest
from helpers.monitors import FakeMonitor
from helpers.tasks import GOAL, START

from cbagan_ompl import ConfigError, GridMap, Heatmap
from cbagan_ompl.sampling.informed_set import InformedSet
from cbagan_ompl.sampling.sampler import HeatmapSampler


def take(sampler: HeatmapSampler, n: int) -> np.ndarray:
    return np.array([sampler.next() for _ in range(n)])


def test_mixture_and_counts(two_walls: GridMap, corridor: Heatmap) -> None:
    sampler = HeatmapSampler(corridor, uniform_fraction=0.3, seed=0)
    points = take(sampler, 20_000)
    assert sum(sampler.sample_counts.values()) == len(points)
    assert abs(sampler.sample_counts["uniform"] / len(points) - 0.3) < 0.02
    assert two_walls.is_free(points).all()
    columns, rows = points.astype(int).T
    off_corridor = (corridor.values[rows, columns] == 0).mean()
    empty = (corridor.values[two_walls.free] == 0).mean()
    assert abs(off_corridor - 0.3 * empty) < 0.02


def test_same_seed_same_samples(corridor: Heatmap) -> None:
    first, again = HeatmapSampler(corridor, seed=3), HeatmapSampler(corridor, seed=3)
    np.testing.assert_array_equal(take(first, 3000), take(again, 3000))
    np.testing.assert_array_equal(
        [first.near(50, 50, 20), first.gaussian(50, 50, 5)],
        [again.near(50, 50, 20), again.gaussian(50, 50, 5)],
    )


@pytest.mark.parametrize("fraction", [0, -0.1, 1.01, float("nan")])
def test_bad_uniform_fraction(corridor: Heatmap, fraction: float) -> None:
    with pytest.raises(ConfigError, match="uniform_fraction"):
        HeatmapSampler(corridor, uniform_fraction=fraction)


@pytest.mark.parametrize("sharpness", [0, -1, float("nan"), inf, "sharp"])
def test_bad_sharpness(corridor: Heatmap, sharpness: float) -> None:
    with pytest.raises(
        ConfigError, match=f"sharpness is a finite number above 0, got {sharpness!r}"
    ):
        HeatmapSampler(corridor, sharpness=sharpness)


@pytest.mark.parametrize(("sharpness", "dim_fraction"), [(0.5, 1 / 3), (1, 1 / 5), (3, 1 / 65)])
def test_samples_follow_a_power_of_the_heat_map(sharpness: float, dim_fraction: float) -> None:
    # Half of the map has a quarter of the heat, and all of it little: only ratios count.
    grid = GridMap(np.ones((40, 40), bool))
    values = np.full(grid.shape, 4e-10)
    values[:, :20] = 1e-10
    sampler = HeatmapSampler(
        Heatmap(values, grid), uniform_fraction=1e-6, seed=0, sharpness=sharpness
    )
    assert abs((take(sampler, 20_000)[:, 0] < 20).mean() - dim_fraction) < 0.01
    near = np.array([sampler.near(20, 20, 10) for _ in range(3000)])
    assert abs((near[:, 0] < 20).mean() - dim_fraction) < 0.05


def test_samples_stay_in_the_box_where_nothing_shortens_the_path(corridor: Heatmap) -> None:
    informed = InformedSet(np.array([START]), np.array([GOAL]), 1.0)
    monitor = FakeMonitor(lambda: 1.0, informed)
    sampler = HeatmapSampler(corridor, monitor=monitor, uniform_fraction=0.5, seed=0)
    low, high = np.array(START) - 0.1, np.array(START) + 0.1
    sampler.keep_inside(low, high)
    points = take(sampler, 20)
    assert ((points >= low) & (points <= high)).all()


def test_local_samples(two_walls: GridMap, corridor: Heatmap) -> None:
    sampler = HeatmapSampler(corridor, seed=0)
    near = np.array([sampler.near(205, 65, 30) for _ in range(2000)])
    assert (np.abs(near - (205, 65)) <= 30).all()
    assert sampler.sample_counts["learned"] > 1700
    inside = near[two_walls.is_free(near)].astype(int)
    heat = corridor.values[inside[:, 1], inside[:, 0]]
    window = corridor.values[35:95, 175:235][two_walls.free[35:95, 175:235]]
    assert heat.mean() > 2 * window.mean()

    around = np.array([sampler.gaussian(205, 65, 10) for _ in range(2000)])
    assert np.abs(around.mean(axis=0) - (205, 65)).max() < 10
    assert around.std(axis=0).max() < 12


def test_local_samples_without_heat_are_uniform(corridor: Heatmap) -> None:
    sampler = HeatmapSampler(corridor, seed=0)
    near = np.array([sampler.near(20, 240, 10) for _ in range(500)])
    assert sampler.sample_counts == {"learned": 0, "uniform": 500}
    assert near.std(axis=0).min() > 4
