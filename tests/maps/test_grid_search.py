from __future__ import annotations

import numpy as np
import pytest
from helpers.searches import search_graph

from cbagan_ompl.maps.grid_map import GridMap
from cbagan_ompl.maps.grid_search import prepare_search, pull_taut, shortest_path


def length(path: np.ndarray) -> float:
    return float(np.hypot(*np.diff(path, axis=0).T).sum())


def test_open_space_is_octile() -> None:
    path = shortest_path(np.ones((20, 30), bool), (1, 1), (25, 9))
    assert path is not None
    np.testing.assert_array_equal(path[[0, -1]], [(1, 1), (25, 9)])
    assert np.isclose(length(path), 8 * np.sqrt(2) + 16)


def test_no_corner_is_cut() -> None:
    free = np.ones((5, 5), bool)
    free[2, :4] = False
    path = shortest_path(free, (0, 0), (0, 4))
    assert path is not None
    assert GridMap(free).path_is_free(path + 0.5)
    assert np.isclose(length(path), 4 + 4 + 4 - 2 * (2 - np.sqrt(2)))


def test_nothing_joins() -> None:
    free = np.eye(4, dtype=bool)
    assert shortest_path(free, (0, 0), (3, 3)) is None


def test_price_moves_the_path() -> None:
    cost = np.ones((11, 11), np.float32)
    cost[:8, 5] = 100
    path = shortest_path(np.ones((11, 11), bool), (0, 5), (10, 5), cost)
    assert path is not None
    assert path[:, 1].max() >= 8


def test_large_grids_with_costs_are_searched_in_a_band() -> None:
    free = np.ones((700, 900), bool)
    free[300:320, :800] = False
    free[500, 100:] = False
    whole = search_graph(free, (5, 5), (890, 690), np.ones(free.shape, np.float32))
    path = shortest_path(free, (5, 5), (890, 690), np.ones(free.shape, np.float32))
    assert path is not None
    assert whole is not None
    assert GridMap(free).path_is_free(path + 0.5)
    assert length(path) < 1.02 * length(whole)


def test_large_grids_with_thin_walls_are_searched_as_a_whole() -> None:
    """The coarse grid sees no wall of one pixel; the way around leaves the band."""
    free = np.ones((600, 600), bool)
    free[300, :590] = False
    path = shortest_path(free, (5, 5), (5, 590))
    assert path is not None
    assert GridMap(free).path_is_free(path + 0.5)
    free[300] = False
    assert shortest_path(free, (5, 5), (5, 590)) is None


def test_pulled_taut_path_is_free_and_shorter() -> None:
    rng = np.random.default_rng(0)
    for _ in range(20):
        free = rng.random((40, 40)) < 0.8
        free[:3, :3] = free[-3:, -3:] = True
        path = shortest_path(free, (0, 0), (39, 39))
        if path is None:
            continue
        taut = pull_taut(free, path)
        assert GridMap(free).path_is_free(taut)
        assert length(taut) <= length(path) + 1e-9
        np.testing.assert_array_equal(taut[[0, -1]], path[[0, -1]] + 0.5)


def cost_of(path: np.ndarray, cost: np.ndarray) -> float:
    values = cost[path[:, 1], path[:, 0]]
    return float((np.hypot(*np.diff(path, axis=0).T) * (values[1:] + values[:-1]) / 2).sum())


@pytest.mark.parametrize("with_costs", [False, True])
def test_paths_are_the_cheapest(with_costs: bool) -> None:
    rng = np.random.default_rng(int(with_costs))
    connected = 0
    for _ in range(150):
        height, width = rng.integers(1, 40, 2)
        free = rng.random((height, width)) < rng.uniform(0.55, 1)
        start, goal = (tuple(rng.integers((width, height)).tolist()) for _ in range(2))
        free[start[::-1]] = free[goal[::-1]] = True
        cost = np.ones((height, width), np.float32)
        if with_costs:
            cost = (0.02 + rng.random((height, width)) ** 4).astype(np.float32)
        expected = search_graph(free, start, goal, cost)
        path = shortest_path(free, start, goal, cost if with_costs else None)
        assert (path is None) == (expected is None)
        if path is None or expected is None:
            continue
        connected += 1
        assert path[0].tolist() == list(start)
        assert path[-1].tolist() == list(goal)
        assert (np.abs(np.diff(path, axis=0)).max(axis=1, initial=0) == 1).all()
        assert GridMap(free).path_is_free(path + 0.5)
        assert cost_of(path, cost) <= cost_of(expected, cost) + cost.min() / 4096
    assert connected > 60


def test_start_and_goal_in_one_pixel() -> None:
    free = np.ones((3, 3), bool)
    for cost in (None, np.ones((3, 3), np.float32)):
        path = shortest_path(free, (1, 2), (1, 2), cost)
        assert path is not None
        assert path.tolist() == [[1, 2]]


def test_masks_of_any_layout() -> None:
    free = np.ones((30, 20), bool)
    free[10, 3:] = False
    expected = shortest_path(free, (15, 2), (15, 25))
    assert expected is not None
    for other in (np.asfortranarray(free), np.repeat(free, 2, axis=1)[:, ::2]):
        path = shortest_path(other, (15, 2), (15, 25))
        assert path is not None
        assert length(path) == length(expected)
        np.testing.assert_array_equal(pull_taut(other, path), pull_taut(free, path))


def test_what_is_prepared_searches_as_before() -> None:
    prepare_search()
    prepare_search(with_costs=True)
    path = shortest_path(np.ones((3, 4), bool), (0, 0), (3, 0))
    assert path is not None
    assert path.tolist() == [[0, 0], [1, 0], [2, 0], [3, 0]]
