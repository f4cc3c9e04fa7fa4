"""The directions of descent of a cost-to-go."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from cbagan_ompl.maps.cost_to_go import descent_directions


def directions(free: NDArray[np.bool_], *goals: tuple[float, float]) -> NDArray[np.float32]:
    cost = np.ones(free.shape, np.float32)
    return descent_directions(free, cost, np.array(goals))


def angle_between(a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.abs(np.angle(np.exp(1j * (a - b))))


def test_open_space_points_to_the_goal() -> None:
    goal = (90.3, 40.2)
    found = directions(np.ones((128, 160), bool), goal)
    rows, columns = np.mgrid[:128, :160] + 0.5
    exact = np.arctan2(goal[1] - rows, goal[0] - columns)
    far = np.hypot(goal[1] - rows, goal[0] - columns) > 10
    # An any-angle path on a grid with knight's moves is off by less than 15 degrees.
    assert angle_between(found, exact)[far].max() < 0.4
    assert found.dtype == np.float32
    assert np.isfinite(found).all()


def test_around_a_wall() -> None:
    free = np.ones((128, 128), bool)
    free[60:64, :100] = False
    found = directions(free, (10.0, 120.0))
    assert np.isnan(found[~free]).all()
    assert abs(found[30, 10]) < np.pi / 4, "to the gap on the right, not straight through the wall"
    assert found[62, 110] > np.pi / 4, "down, through the gap"


@pytest.mark.parametrize("thickness", [1, 7])
@pytest.mark.parametrize("row", range(56, 64))
def test_walls_are_not_crossed(row: int, thickness: int) -> None:
    free = np.ones((128, 512), bool)
    free[row : row + thickness, :500] = False
    found = directions(free, (10.0, 120.0))
    assert (np.abs(found[10:40, 5:400]) < np.pi / 4).all()


def test_unreachable_parts_are_unknown() -> None:
    free = np.ones((64, 64), bool)
    free[:, 28:36] = False
    found = directions(free, (50.0, 32.0))
    assert np.isnan(found[:, :28]).all()
    assert np.isfinite(found[:, 36:]).all()


def test_nearest_of_several_goals() -> None:
    found = directions(np.ones((8, 128), bool), (2.0, 4.0), (126.0, 4.0))
    assert np.abs(found[4, 30]) > 3
    assert np.abs(found[4, 98]) < 0.2


@pytest.mark.parametrize("shape", [(1, 1), (1, 9), (9, 1), (5, 7), (500, 41)])
def test_any_size(shape: tuple[int, int]) -> None:
    found = directions(np.ones(shape, bool), (shape[1] - 0.5, shape[0] - 0.5))
    assert found.shape == shape
    assert np.isfinite(found).all()


def test_cheap_ways_are_preferred() -> None:
    """From the middle of the map the way on the right is longer and cheaper."""
    free = np.ones((64, 128), bool)
    free[28:36, 20:100] = False
    cost = np.full(free.shape, 20, np.float32)
    cost[:, 100:] = cost[:24] = cost[40:] = 1
    found = descent_directions(free, cost, np.array([(40.0, 60.0)]))
    assert abs(found[10, 60]) < np.pi / 4
