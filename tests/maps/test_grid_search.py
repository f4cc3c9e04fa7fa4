from __future__ import annotations

import numpy as np

from cbagan_ompl.maps import grid_search
from cbagan_ompl.maps.grid_map import GridMap
from cbagan_ompl.maps.grid_search import pull_taut, shortest_path


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


def test_large_grids_are_searched_in_a_band() -> None:
    free = np.ones((700, 900), bool)
    free[300:320, :800] = False
    free[500, 100:] = False
    whole = grid_search._search(free, (5, 5), (890, 690), np.ones(free.shape, np.float32))
    path = shortest_path(free, (5, 5), (890, 690))
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
