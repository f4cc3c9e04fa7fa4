"""The informed set: lower bounds on path lengths, and samples that stay in it."""

from __future__ import annotations

from math import inf

import numpy as np
import pytest
from helpers.monitors import FakeMonitor
from helpers.tasks import GOAL, START

from cbagan_ompl import GridMap, Heatmap
from cbagan_ompl.sampling.informed_set import InformedSet
from cbagan_ompl.sampling.sampler import HeatmapSampler


def take(sampler: HeatmapSampler, n: int) -> np.ndarray:
    return np.array([sampler.next() for _ in range(n)])


def test_bounds_are_lengths_of_paths_with_one_corner() -> None:
    informed = InformedSet(np.array([[0.0, 0.0]]), np.array([[4.0, 0.0]]), tolerance=0.0)
    points = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 1.5], [-1.0, 0.0], [4.0, 3.0]])
    np.testing.assert_allclose(informed.cost_bounds(points), [4, 4, 5, 6, 8])


def test_the_nearest_start_and_goal_count_and_the_tolerance_is_given_away() -> None:
    starts, goals = np.array([[0.0, 0.0], [10.0, 0.0]]), np.array([[4.0, 0.0], [9.0, 9.0]])
    informed = InformedSet(starts, goals, tolerance=0.5)
    points = np.array([[9.0, 0.0], [1.0, 0.0]])
    np.testing.assert_allclose(informed.cost_bounds(points), [1 + 5 - 0.5, 1 + 3 - 0.5])


@pytest.mark.parametrize("seed", range(5))
def test_bounds_do_not_depend_on_the_frame(seed: int) -> None:
    rng = np.random.default_rng(seed)
    angle, shift = rng.uniform(0, 6), rng.normal(size=2)
    rotation = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    starts, goals, points = (rng.normal(size=(n, 2)) for n in (2, 3, 20))
    here = InformedSet(starts, goals, 0.1).cost_bounds(points)
    moved = InformedSet(starts @ rotation + shift, goals @ rotation + shift, 0.1)
    np.testing.assert_allclose(moved.cost_bounds(points @ rotation + shift), here)


def test_informed_samples_stay_in_the_ellipse(corridor: Heatmap) -> None:
    costs = iter([inf] * 100 + [900.0] * 5000 + [610.0] * 5000)
    informed = InformedSet(np.array([START]), np.array([GOAL]), tolerance=1.0)
    monitor = FakeMonitor(lambda: next(costs), informed)
    sampler = HeatmapSampler(corridor, monitor=monitor, uniform_fraction=0.5, seed=0)
    points = take(sampler, 10_100)
    through = informed.cost_bounds(points)
    assert (through[100:5100] <= 900).all()
    assert (through[5100:] <= 610).all()
    assert 0.45 < sampler.sample_counts["uniform"] / 10_100 < 0.55, "the mixture stays what it was"


def test_no_point_of_a_pixel_is_below_the_bound_of_the_pixel() -> None:
    grid = GridMap(np.ones((12, 20), np.bool_), resolution=0.5, origin=(3.0, -1.0, 0.6))
    corners = grid.to_world([(4.2, 3.1), (15.0, 8.5), (18.7, 2.0)])
    informed = InformedSet(corners[:1], corners[1:], tolerance=0.25)
    bounds = informed.pixel_cost_bounds(grid, np.arange(grid.free.size)).reshape(grid.shape)
    pixels = np.random.default_rng(0).random((5000, 2)) * (grid.width, grid.height)
    columns, rows = pixels.astype(int).T
    above = informed.cost_bounds(grid.to_world(pixels)) - bounds[rows, columns]
    assert above.min() >= 0
    # Half a diagonal from the centre, and twice that where both distances change together.
    assert above.max() <= 4 * np.sqrt(0.5) * grid.resolution + 1e-9


def test_informed_set_is_left_when_the_planner_starts_again(corridor: Heatmap) -> None:
    cost = 400.0
    monitor = FakeMonitor(lambda: cost, InformedSet(np.array([START]), np.array([GOAL]), 1.0))
    sampler = HeatmapSampler(Heatmap.uniform(corridor.grid), monitor=monitor, seed=0)
    informed = take(sampler, 2000)
    cost = inf
    again = take(sampler, 2000)
    assert np.hypot(*(informed - (10, 240)).T).min() > 30
    assert np.hypot(*(again - (10, 240)).T).min() < 30


def test_empty_informed_set_does_not_hang(corridor: Heatmap) -> None:
    monitor = FakeMonitor(lambda: 1.0, InformedSet(np.array([START]), np.array([GOAL]), 0.0))
    sampler = HeatmapSampler(corridor, monitor=monitor, seed=0)
    assert len(take(sampler, 3)) == 3
