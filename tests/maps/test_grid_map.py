"""GridMap: frames, exact checks of segments, inflation, tasks, errors."""

from __future__ import annotations

import pickle
from math import floor, pi

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cbagan_ompl.errors import ConfigError, MapError, TaskError
from cbagan_ompl.maps.grid_map import GridMap
from cbagan_ompl.maps.raw_map import MAX_SIDE


def random_free(rng, height, width, blocked=0.3):
    free = rng.random((height, width)) > blocked
    free[0, 0] = True
    return free


# --- frames -----------------------------------------------------------------------------------


def test_image_frame_is_pixels_with_y_down():
    grid = GridMap([[1, 0, 1], [1, 1, 1]])
    np.testing.assert_array_equal(grid.to_world([2.5, 0.5]), [2.5, 0.5])
    assert not grid.is_free((1.5, 0.5))
    assert grid.is_free((1.5, 1.5))
    low, high = grid.bounds
    assert (low.tolist(), high.tolist()) == ([0, 0], [3, 2])


def test_resolution_scales_the_image_frame():
    grid = GridMap([[1, 0, 1], [1, 1, 1]], resolution=0.5)
    np.testing.assert_array_equal(grid.to_pixel([1.25, 0.25]), [2.5, 0.5])
    assert grid.bounds[1].tolist() == [1.5, 1.0]


def test_ros_frame_has_its_origin_at_the_lower_left_corner():
    grid = GridMap([[1, 0, 1], [1, 1, 1]], resolution=0.5, origin=(10, 20, 0))
    np.testing.assert_allclose(grid.to_pixel([10, 20]), [0, 2])  # lower left corner of the image
    np.testing.assert_allclose(grid.to_world([0, 0]), [10, 21])
    # The blocked pixel is in the upper row of the image, so at larger y.
    assert not grid.is_free((10.75, 20.75))
    assert grid.is_free((10.75, 20.25))


def test_yaw_turns_the_map_counter_clockwise_about_its_origin():
    grid = GridMap([[1, 0, 1], [1, 1, 1]], resolution=0.5, origin=(10, 20, pi / 2))
    # What was 0.75 to the right and 0.75 up is now 0.75 to the left and 0.75 up.
    assert not grid.is_free((9.25, 20.75))
    np.testing.assert_allclose(grid.to_pixel([9.25, 20.75]), [1.5, 0.5], atol=1e-12)
    low, high = grid.bounds
    np.testing.assert_allclose([low, high], [[9, 20], [10, 21.5]], atol=1e-12)


@pytest.mark.parametrize("origin", [None, (0, 0, 0), (-12.5, 7.25, 0.7), (3, -4, -2.5)])
@pytest.mark.parametrize("resolution", [1.0, 0.05, 3.0])
def test_world_and_pixel_are_inverse(origin, resolution):
    grid = GridMap(np.ones((31, 47)), resolution, origin)
    pixels = np.random.default_rng(0).uniform(0, 31, (5, 20, 2))
    np.testing.assert_allclose(grid.to_pixel(grid.to_world(pixels)), pixels, atol=1e-9)
    # Lengths are those of the pixels times the resolution, whatever the frame.
    steps = np.diff(grid.to_world(pixels), axis=1)
    np.testing.assert_allclose(
        np.hypot(*np.moveaxis(steps, -1, 0)),
        resolution * np.hypot(*np.moveaxis(np.diff(pixels, axis=1), -1, 0)),
    )


def test_is_free_looks_up_the_pixel_of_every_point():
    rng = np.random.default_rng(1)
    grid = GridMap(random_free(rng, 7, 9), 0.5, (1, 2, 0.3))
    pixels = rng.uniform(-1, 10, (3, 40, 2))
    expected = [
        [0 <= u < 9 and 0 <= v < 7 and grid.free[floor(v), floor(u)] for u, v in line]
        for line in pixels
    ]
    result = grid.is_free(grid.to_world(pixels))
    assert result.shape == (3, 40)
    np.testing.assert_array_equal(result, expected)


def test_is_free_outside_and_for_nan():
    grid = GridMap(np.ones((2, 3)))
    points = [
        (0, 0),
        (3, 1),
        (1, 2),
        (-1e-9, 1),
        (np.nan, 1),
        (1e20, 1),
        (1e300, 0),
        (2.999, 1.999),
    ]
    assert grid.is_free(points).tolist() == [True, *[False] * 6, True]


# --- segments ---------------------------------------------------------------------------------


def test_no_way_between_obstacles_that_touch_diagonally():
    grid = GridMap([[1, 0], [0, 1]])
    assert not grid.path_is_free([(0.5, 0.5), (1.5, 1.5)])
    assert grid.components[0, 0] != grid.components[1, 1]


def test_path_is_free():
    grid = GridMap([[1, 1, 1], [1, 0, 1], [1, 1, 1]], resolution=2.0, origin=(5, 5, 0.4))
    ring = grid.to_world([(0.5, 0.5), (2.5, 0.5), (2.5, 2.5), (0.5, 2.5), (0.5, 0.5)])
    assert grid.path_is_free(ring)
    assert not grid.path_is_free(ring[[0, 2]])
    assert grid.path_is_free(ring[:1])
    assert not grid.path_is_free(grid.to_world([(1.5, 1.5)]))
    assert not grid.path_is_free(grid.to_world([(0.5, 0.5), (-0.5, 0.5)]))
    assert not grid.path_is_free([(np.nan, 0), (np.nan, 1)])


# --- inflation --------------------------------------------------------------------------------


@pytest.mark.parametrize("resolution", [1.0, 0.05, 0.1])
def test_inflated_keeps_the_pixels_that_are_radius_away_and_no_others(resolution):
    rng = np.random.default_rng(5)
    free = random_free(rng, 24, 31, blocked=0.02)
    grid = GridMap(free, resolution, (1, 2, 0.5), name="room")
    rows, columns = np.indices(free.shape)
    blocked = np.argwhere(~free)
    # The gap between the squares of two pixels, for every pixel the smallest of them, squared.
    down = np.maximum(abs(rows[..., None] - blocked[:, 0]) - 1, 0)
    right = np.maximum(abs(columns[..., None] - blocked[:, 1]) - 1, 0)
    squared = (down**2 + right**2).min(axis=-1)
    for squares in (0.01, 1, 2, 3.9, 4, 4.1, 5, 13):
        radius = np.sqrt(squares) * resolution
        inflated = grid.inflated(radius)
        np.testing.assert_array_equal(inflated.free, free & (squared >= squares - 1e-6))
        assert (inflated.resolution, inflated.origin, inflated.name) == (
            grid.resolution,
            grid.origin,
            f"room (inflated by {radius:g})",
        )


def test_inflated_forgives_the_rounding_of_the_radius():
    free = np.ones((1, 30), dtype=bool)
    free[0, 0] = False
    # 1.1 / 0.1 is a little more than 11, and 0.3 / 0.1 a little less than 3.
    assert GridMap(free, 0.1).inflated(1.1).free.sum() == 30 - 12
    assert GridMap(free, 0.1).inflated(0.3).free.sum() == 30 - 4


def test_inflated_leaves_what_needs_no_change():
    grid = GridMap([[1, 0, 1, 1]])
    assert grid.inflated(0) is grid
    empty = GridMap(np.ones((4, 4)))
    assert empty.inflated(100) is empty  # the border of the map is no obstacle


@pytest.mark.parametrize("radius", [0.5, 1, 2.2, 3])
def test_inflated_with_its_border_takes_what_is_beyond_it_for_blocked(radius):
    rng = np.random.default_rng(5)
    for free in (random_free(rng, 24, 31, blocked=0.02), np.ones((24, 31), bool)):
        framed = GridMap(np.pad(free, 1)).inflated(radius)
        grid = GridMap(free)
        np.testing.assert_array_equal(
            grid.inflated(radius, border=True).free, framed.free[1:-1, 1:-1]
        )
        without = grid.inflated(radius).free
        assert without.sum() > framed.free.sum(), "and the two are kept apart"


def test_inflated_takes_truth_values_for_the_border():
    with pytest.raises(ConfigError, match="border"):
        GridMap([[1, 0]]).inflated(1, border="no")  # type: ignore[arg-type]


@pytest.mark.parametrize("radius", [-1, np.nan, np.inf])
def test_inflated_raises_for_what_is_no_length(radius):
    with pytest.raises(MapError, match="at least 0"):
        GridMap([[1, 0]]).inflated(radius)


def test_inflated_raises_when_nothing_stays_free():
    with pytest.raises(MapError, match="fits nowhere on this map"):
        GridMap([[1, 0, 1]]).inflated(2)


# --- tasks ------------------------------------------------------------------------------------


@pytest.fixture
def divided():
    return GridMap([[1, 1, 0, 1], [1, 1, 0, 1]], name="divided")


def test_components(divided):
    labels = divided.components
    assert labels.dtype == np.int32
    assert (labels > 0).tolist() == divided.free.tolist()
    assert len({labels[0, 0], labels[1, 1], labels[0, 1]}) == 1
    assert labels[0, 0] != labels[0, 3]


def test_check_task_returns_arrays(divided):
    start, goal = divided.check_task((0.5, 0.5), [1, 1])
    assert (start.tolist(), goal.tolist()) == ([0.5, 0.5], [1, 1])
    assert start.dtype == np.float64


@pytest.mark.parametrize(
    ("start", "goal", "message"),
    [
        ((0.5, 0.5), (0.5, 0.5), "same point"),
        ((0.5, 0.5), (2.5, 0.5), r"goal \(2.5, 0.5\) is in an obstacle.*column 2, row 0"),
        ((9, 0.5), (0.5, 0.5), r"start \(9, 0.5\) is outside divided.*x 0 to 4 and y 0 to 2"),
        ((1e300, 0.5), (0.5, 0.5), "start .* is outside"),
        ((0.5, 0.5), (0.5, -0.1), "goal .* is outside"),
        ((0.5, 0.5), (4, 1), "goal .* is outside"),
        ((0.5, 0.5), (3.5, 0.5), "no path connects"),
        ((0.5, np.nan), (0.5, 0.5), "start must be two finite numbers"),
        ((0.5, 0.5), (1, 2, 3), "goal must be two finite numbers"),
        ((0.5, 0.5), "A1", "goal must be two finite numbers"),
        (None, (0.5, 0.5), "start must be two finite numbers"),
    ],
)
def test_check_task_says_what_is_wrong(divided, start, goal, message):
    with pytest.raises(TaskError, match=message):
        divided.check_task(start, goal)


# --- errors -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("free", "message"),
    [
        (np.ones(4), r"shape \(4,\)"),
        (np.ones((2, 2, 3)), "2-D array"),
        (np.ones((0, 5)), "at least one pixel"),
        ([[1, 1], [1]], "2-D array"),
        (np.zeros((3, 3)), "every pixel is blocked"),
        ([["a", "b"]], "booleans or numbers"),
        ([[1.0, np.nan]], "NaN"),
        (np.broadcast_to(np.True_, (1, MAX_SIDE + 1)), f"up to {MAX_SIDE} pixels"),
    ],
)
def test_no_map_from(free, message):
    with pytest.raises(MapError, match=message):
        GridMap(free)


@pytest.mark.parametrize("resolution", [0, -0.05, np.nan, np.inf])
def test_resolution_must_be_a_length(resolution):
    with pytest.raises(MapError, match="resolution"):
        GridMap([[1]], resolution)


@pytest.mark.parametrize("origin", [(0, 0), (0, 0, np.nan), (0, 0, 0, 0)])
def test_origin_must_be_a_pose(origin):
    with pytest.raises(MapError, match="origin"):
        GridMap([[1]], 1.0, origin)


def test_the_map_is_a_read_only_copy():
    source = np.ones((2, 2), dtype=bool)
    grid = GridMap(source)
    source[0, 0] = False
    assert grid.free.all()
    with pytest.raises(ValueError, match="read-only"):
        grid.free[0, 0] = False


def test_shape_and_repr():
    grid = GridMap([[1, 0, 1]], 0.05, (1, 2, 0), name="hall")
    assert (grid.width, grid.height, grid.shape) == (3, 1, (1, 3))
    assert repr(grid) == ("GridMap('hall', 3 x 1 pixels of 0.05, origin (1.0, 2.0, 0.0), 67% free)")
    assert "image frame" in repr(GridMap([[1]]))


@given(
    st.integers(1, 40),
    st.floats(0.01, 10),
    st.one_of(st.none(), st.tuples(st.floats(-1e3, 1e3), st.floats(-1e3, 1e3), st.floats(-pi, pi))),
    st.tuples(st.floats(-50, 50), st.floats(-50, 50)),
)
def test_world_and_pixel_are_inverse_in_every_frame(height, resolution, origin, pixel):
    grid = GridMap(np.ones((height, 3)), resolution, origin)
    back = grid.to_pixel(grid.to_world(pixel))
    np.testing.assert_allclose(back, pixel, atol=1e-9 * (1 + 1e3 / resolution))
    # One pixel to the right is as long as the resolution says.
    step = grid.to_world(pixel) - grid.to_world((pixel[0] + 1, pixel[1]))
    np.testing.assert_allclose(np.hypot(*step), resolution, rtol=1e-6, atol=1e-9)


def test_inflated_maps_go_to_other_processes():
    free = np.ones((20, 20), bool)
    free[5, 5] = False
    grid = GridMap(free)
    inflated = grid.inflated(2)
    for one in (grid, inflated):
        other = pickle.loads(pickle.dumps(one))
        assert np.array_equal(other.free, one.free)
        assert other.name == one.name
        assert np.array_equal(other.bare[1], free)
