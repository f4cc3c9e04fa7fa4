"""Occupancy grids and costmaps as ROS messages have them."""

from __future__ import annotations

import array

import numpy as np
import pytest

from cbagan_ompl import ConfigError, GridMap, MapError

ORIGIN = (-1.0, 2.0, 0.0)


def test_occupancy_grid_has_its_rows_from_the_bottom() -> None:
    data = array.array("b", [0, 100, -1, 25, 26, 0])
    grid = GridMap.from_occupancy_grid(data, 3, 2, 0.5, ORIGIN)
    assert grid.free.tolist() == [[True, False, True], [True, False, False]]
    assert grid.unknown is not None
    assert grid.unknown.tolist() == [[False] * 3, [False, False, True]]
    assert grid.is_free((-0.9, 2.1)), "the first cell, at the origin"
    assert not grid.is_free((-0.4, 2.1)), "the second one"
    assert (grid.resolution, grid.origin) == (0.5, ORIGIN)
    assert GridMap.from_occupancy_grid(data, 3, 2, 0.5, ORIGIN, unknown_is_free=True).free[1, 2]
    assert GridMap.from_occupancy_grid(data, 3, 2, 0.5, ORIGIN, free_thresh=0.3).free[0, 1]


def test_costmap_blocks_from_the_inscribed_radius_on() -> None:
    costs = np.array([[0, 252, 253], [254, 255, 1]], np.uint8)
    grid = GridMap.from_costmap(costs, 0.05, ORIGIN)
    assert grid.free.tolist() == [[False, False, True], [True, True, False]]
    assert GridMap.from_costmap(costs, 0.05, ORIGIN, lethal=254).free[1, 2]
    assert GridMap.from_costmap(costs, 0.05, ORIGIN, unknown_is_free=True).free[0, 1]


@pytest.mark.parametrize(
    ("changes", "error", "message"),
    [
        ({"data": [0, 101]}, MapError, "from -1 to 100, these from 0 to 101"),
        ({"data": [0, -2]}, MapError, "from -1 to 100"),
        ({"data": [0]}, MapError, "2 x 1 cells has 2 values, this one has 1"),
        ({"data": [0.5, 0.0]}, MapError, "whole numbers, got an array of float64"),
        ({"data": [True, False]}, MapError, "whole numbers, got an array of bool"),
        ({"data": [[0], [100]]}, MapError, r"shape \(1, 2\), these have shape \(2, 1\)"),
        ({"data": []}, MapError, "whole numbers"),
        ({"data": [[0], [0, 1]]}, MapError, "no array"),
        ({"width": 0}, ConfigError, "width is a whole number of at least 1, got 0"),
        ({"height": 1.0}, ConfigError, "height is a whole number"),
        ({"width": 10**30}, ConfigError, "width"),
        ({"resolution": 0}, MapError, "resolution is the length of a pixel"),
        ({"origin": (0, 0)}, MapError, "origin is"),
        ({"free_thresh": 2}, ConfigError, "free_thresh is a fraction"),
        ({"data": [100, 100]}, MapError, "every pixel is blocked"),
    ],
)
def test_bad_occupancy_grids(
    changes: dict[str, object], error: type[Exception], message: str
) -> None:
    good = {"data": [0, 100], "width": 2, "height": 1, "resolution": 0.1, "origin": ORIGIN}
    with pytest.raises(error, match=message):
        GridMap.from_occupancy_grid(**(good | changes))


@pytest.mark.parametrize(
    ("costs", "lethal", "error", "message"),
    [
        ([[0, 256]], 253, MapError, "from 0 to 255"),
        ([[0, -1]], 253, MapError, "from 0 to 255"),
        ([0, 1], 253, MapError, "2-D array"),
        ([[0]], 0, ConfigError, "lethal"),
        ([[0]], 256, ConfigError, "lethal .* at most 255"),
    ],
)
def test_bad_costmaps(
    costs: list[object], lethal: int, error: type[Exception], message: str
) -> None:
    with pytest.raises(error, match=message):
        GridMap.from_costmap(costs, 0.1, ORIGIN, lethal)


@pytest.mark.parametrize("percent", range(101))
def test_a_cell_of_the_threshold_is_free(percent: int) -> None:
    data = range(101)
    grid = GridMap.from_occupancy_grid(data, 101, 1, 0.1, ORIGIN, free_thresh=percent / 100)
    assert grid.free.sum() == percent + 1


def test_what_is_masked_is_unknown_or_refused() -> None:
    """Readers of ROS messages in NumPy mask what is unknown."""
    data = np.ma.masked_equal(np.array([[0, -1, 100]], np.int8), -1)
    grid = GridMap.from_occupancy_grid(data, 3, 1, 0.1, ORIGIN)
    assert grid.free.tolist() == [[True, False, False]]
    assert grid.unknown is not None
    assert grid.unknown.tolist() == [[False, True, False]]
    costs = np.ma.masked_array(np.zeros((1, 2), np.uint8), [[False, True]])
    assert GridMap.from_costmap(costs, 0.1, ORIGIN).free.tolist() == [[True, False]]
    with pytest.raises(MapError, match=r"masked cells .*\.filled\(False\)"):
        GridMap(data < 50)
    assert GridMap((data < 50).filled(False)).free.tolist() == [[True, False, False]]


@pytest.mark.parametrize(
    "cells", [[[0, 100, -1]], [[0, 254]], [[0.2, 0.9]], [[0, 255]], np.full((2, 2), 205, np.uint8)]
)
def test_values_that_are_no_truth_values_are_not_guessed_at(cells: object) -> None:
    with pytest.raises(MapError, match=r"from_occupancy_grid.*from_costmap"):
        GridMap(cells)
    for mask in ([[0, 1]], [[0.0, 1.0]], [[False, True]], np.array([[0, 1]], np.uint8)):
        assert GridMap(mask).free.tolist() == [[False, True]]
