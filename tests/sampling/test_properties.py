"""Laws that hold for every heat map, grid and informed set."""

from __future__ import annotations

import numpy as np
from helpers.monitors import FakeMonitor
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from cbagan_ompl import GridMap, Heatmap
from cbagan_ompl.sampling.informed_set import InformedSet
from cbagan_ompl.sampling.sampler import HeatmapSampler

origins = st.one_of(
    st.none(),
    st.tuples(st.floats(-50, 50), st.floats(-50, 50), st.floats(-np.pi, np.pi)),
)


@st.composite
def heatmaps(draw: st.DrawFn) -> Heatmap:
    """A heat map with something to sample, on a grid of any size, resolution and pose."""
    shape = draw(st.tuples(st.integers(1, 12), st.integers(1, 12)))
    free = draw(arrays(np.bool_, shape))
    values = draw(arrays(np.float32, shape, elements=st.floats(0, 1, width=32)))
    row, column = draw(st.integers(0, shape[0] - 1)), draw(st.integers(0, shape[1] - 1))
    free[row, column], values[row, column] = True, 1.0
    return Heatmap(values, GridMap(free, draw(st.floats(0.01, 10)), draw(origins)))


@given(heatmaps(), st.integers(0, 2**32))
def test_samples_lie_in_free_pixels_with_a_value(heatmap: Heatmap, seed: int) -> None:
    points = heatmap.grid.to_pixel(heatmap.sample(64, seed))[:, None]
    rows, columns = np.nonzero((heatmap.values > 0) & heatmap.grid.free)
    corners = np.stack((columns, rows), axis=-1)
    gaps = np.maximum(np.maximum(corners - points, points - corners - 1), 0).max(-1)
    # The way to the world frame and back may round a point across the border of its pixel.
    assert gaps.min(axis=1).max() < 1e-6


@given(heatmaps(), st.integers(0, 2**32), st.floats(0.01, 1))
def test_a_sampler_counts_what_it_hands_out(
    heatmap: Heatmap, seed: int, uniform_fraction: float
) -> None:
    samplers = [
        HeatmapSampler(heatmap, seed=seed, uniform_fraction=uniform_fraction) for _ in range(2)
    ]
    points = np.array([[sampler.next() for _ in range(40)] for sampler in samplers])
    np.testing.assert_array_equal(*points)
    assert sum(samplers[0].sample_counts.values()) == 40
    low, high = heatmap.grid.bounds
    slack = 1e-9 * (1 + np.abs((low, high)).max())
    assert ((points >= low - slack) & (points <= high + slack)).all()


coordinates = st.tuples(st.floats(-20, 20), st.floats(-20, 20))


@given(
    st.lists(coordinates, min_size=1, max_size=3),
    st.lists(coordinates, min_size=1, max_size=3),
    coordinates,
    st.floats(0, 5),
)
def test_no_path_through_a_point_is_shorter_than_its_bound(
    starts: list[tuple[float, float]],
    goals: list[tuple[float, float]],
    point: tuple[float, float],
    tolerance: float,
) -> None:
    informed = InformedSet(np.array(starts), np.array(goals), tolerance)
    (bound,) = informed.cost_bounds(np.array([point])).tolist()
    for start in starts:
        for goal in goals:
            through = np.hypot(*np.subtract(start, point)) + np.hypot(*np.subtract(goal, point))
            assert bound <= through - tolerance + 1e-9


@given(heatmaps(), st.data())
def test_no_point_of_a_pixel_is_below_the_bound_of_the_pixel(
    heatmap: Heatmap, data: st.DataObject
) -> None:
    grid = heatmap.grid
    inside = st.tuples(st.floats(0, grid.width), st.floats(0, grid.height))
    start, goal, point = (np.array(data.draw(inside)) for _ in range(3))
    informed = InformedSet(grid.to_world([start]), grid.to_world([goal]), 0.0)
    column, row = np.minimum(point, (grid.width - 1, grid.height - 1)).astype(int)
    (bound,) = informed.cost_bounds(grid.to_world([point])).tolist()
    slack = 1e-6 * (1 + abs(bound))
    (of_pixel,) = informed.pixel_cost_bounds(grid, np.array([row * grid.width + column])).tolist()
    assert of_pixel <= bound + slack


@given(heatmaps(), st.integers(0, 2**32))
def test_informed_samples_can_lie_on_a_shorter_path(heatmap: Heatmap, seed: int) -> None:
    grid = heatmap.grid
    low, high = grid.bounds
    informed = InformedSet(low[None], high[None], 0.0)
    cost = 1.2 * float(np.hypot(*(high - low)))
    # Only where the set holds whole pixels, or a sample from outside may have to be handed out.
    bounds = informed.pixel_cost_bounds(grid, heatmap.support)
    if not (bounds + 4 * grid.resolution < cost).any():
        return
    monitor = FakeMonitor(lambda: cost, informed)
    sampler = HeatmapSampler(heatmap, monitor=monitor, seed=seed)
    points = np.array([sampler.next() for _ in range(40)])
    assert (informed.cost_bounds(points) <= cost + 1e-9).mean() > 0.9
