"""Start and goal: what is wrong with them, and the nearest free position."""

from __future__ import annotations

from decimal import Decimal
from fractions import Fraction

import numpy as np
import pytest

from cbagan_ompl import ConfigError, GridMap, TaskError
from cbagan_ompl.maps.endpoints import snap_endpoints


@pytest.fixture
def grid() -> GridMap:
    free = np.ones((20, 30), bool)
    free[:, 14:16] = False
    unknown = np.zeros_like(free)
    free[:3, :3] = False
    unknown[:3, :3] = True
    return GridMap(free, unknown=unknown, name="hall")


def test_messages_tell_wall_margin_and_unknown_apart(grid: GridMap) -> None:
    goal = (25, 10)
    for space, point, message in (
        (grid, (14.5, 5), "in an obstacle of hall"),
        (grid, (1, 1), "in unknown space of hall"),
        (grid.inflated(2), (12.5, 5), "too close to an obstacle of hall for the robot's radius"),
        (grid.inflated(2), (14.5, 5), "in an obstacle of hall"),
        (grid.inflated(2), (1, 1), "in unknown space of hall"),
        (grid.inflated(2), (1, 4.5), "too close to unknown space of hall for the robot's radius"),
    ):
        with pytest.raises(TaskError, match=rf"start \(.*\) is {message}"):
            space.check_task(point, goal)


def test_margin_is_told_where_the_map_before_is_gone() -> None:
    free = np.ones((20, 30), bool)
    free[:, 14:16] = False
    inflated = GridMap(free, name="hall").inflated(1).inflated(1)
    with pytest.raises(TaskError, match="too close to an obstacle of hall for the robot's radius"):
        inflated.check_task((12.5, 5), (25, 10))


def test_snap_moves_a_point_no_farther_than_it_must(grid: GridMap) -> None:
    np.testing.assert_array_equal(grid.snap((5, 5), 3), (5, 5))
    moved = grid.snap((14.2, 5.5), 1)
    assert grid.is_free(moved)
    np.testing.assert_allclose(moved, (14, 5.5), atol=2e-3)
    inflated = grid.inflated(2)
    moved = inflated.snap((14.2, 5.5), 4)
    assert inflated.is_free(moved)
    np.testing.assert_allclose(moved, (12, 5.5), atol=2e-3)
    with pytest.raises(TaskError, match=r"nothing within 0\.1 of it is free"):
        grid.snap((14.5, 5), 0.1)
    with pytest.raises(TaskError, match="outside hall"):
        grid.snap((-1, 5), 9)
    with pytest.raises(ConfigError, match="distance"):
        grid.snap((5, 5), -1)


def test_snap_in_a_turned_frame_is_the_nearest_of_all(grid: GridMap) -> None:
    turned = GridMap(grid.free, 0.1, (2.0, -1.0, 0.7))
    rng = np.random.default_rng(0)
    rows, columns = np.nonzero(turned.free)
    for point in turned.to_world(rng.uniform((0, 0), (30, 20), (50, 2))):
        moved = turned.snap(point, 10)
        assert turned.is_free(moved)
        u, v = turned.to_pixel(point)
        gap = np.hypot(
            np.maximum(np.maximum(columns - u, u - columns - 1), 0),
            np.maximum(np.maximum(rows - v, v - rows - 1), 0),
        ).min()
        assert abs(np.hypot(*(moved - point)) - 0.1 * gap) < 5e-4


@pytest.mark.parametrize(
    "point",
    ["ab", None, (1,), (1, 2, 3), (1, "2"), (1, None), ((1, 2), (3,)), (1, 2j), (True, False),
     (10**400, 1), (float("nan"), 1), b"12", {1, 2}, object()],
)  # fmt: skip
def test_what_is_no_point(grid: GridMap, point: object) -> None:
    with pytest.raises(TaskError, match="start must be two finite numbers"):
        grid.check_task(point, (25, 10))


def test_what_is_a_point(grid: GridMap) -> None:
    for point in ((Decimal("5"), Fraction(1, 2)), [5, 6], np.float32([5, 6]), (np.int8(5), 6)):
        assert grid.check_task(point, (6, 10))[0].dtype == np.float64


def test_inflated_maps_are_kept(grid: GridMap) -> None:
    once = grid.inflated(2)
    assert grid.inflated(2.0) is once
    assert once.bare[1] is grid.free
    for radius in (0.5, 1, 1.5, 2.5):
        grid.inflated(radius)
    assert grid.inflated(2) is not once, "the oldest goes first"


def test_one_point_is_answered_with_a_bool(grid: GridMap) -> None:
    assert type(grid.is_free((5, 5))) is bool
    assert grid.is_free([(5, 5), (14.5, 5)]).tolist() == [True, False]


def test_snapped_endpoints_are_connected_where_that_can_be() -> None:
    """A start in a thin wall goes to the side of the goal, though the other one is nearer."""
    free = np.ones((20, 30), bool)
    free[:, 14:17] = False
    grid = GridMap(free)
    (start, goal), moves = snap_endpoints(grid, (14.2, 5.5), (25, 5), 4)
    np.testing.assert_allclose(start, (17, 5.5), atol=2e-3)
    np.testing.assert_array_equal(goal, (25, 5))
    assert moves.keys() == {"start"}
    assert moves["start"]["given"] == [14.2, 5.5]
    assert moves["start"]["distance"] == pytest.approx(2.8, abs=2e-3)
    # Nearest of all where the side of the goal is out of reach: the check of the task says why.
    (start, goal), _ = snap_endpoints(grid, (14.2, 5.5), (25, 5), 1)
    np.testing.assert_allclose(start, (14, 5.5), atol=2e-3)
    with pytest.raises(TaskError, match="no path connects"):
        grid.check_task(start, goal)


def test_both_endpoints_in_a_wall_go_to_one_side() -> None:
    free = np.ones((20, 30), bool)
    free[:, 10:20] = False
    (start, goal), moves = snap_endpoints(GridMap(free), (12, 5), (17, 15), 8)
    np.testing.assert_allclose((start[0], goal[0]), (10, 10), atol=2e-3)
    assert moves.keys() == {"start", "goal"}


def test_a_free_endpoint_is_never_moved() -> None:
    """Not even out of a closed room: the robot is in there."""
    free = np.ones((20, 30), bool)
    free[:, 14] = False
    grid = GridMap(free)
    (start, _), moves = snap_endpoints(grid, (13.5, 5), (25, 5), 10)
    np.testing.assert_array_equal(start, (13.5, 5))
    assert moves == {}
