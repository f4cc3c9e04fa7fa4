from __future__ import annotations

import numpy as np

from cbagan_ompl import GridMap
from cbagan_ompl.inference.scaling import scaled_free, scaled_map, scaled_shape


def test_scaled_shape_keeps_the_aspect() -> None:
    assert scaled_shape((256, 128), 64) == (64, 32)
    assert scaled_shape((30, 40), 64) == (48, 64)
    assert scaled_shape((64, 20), 64) == (64, 20)
    assert scaled_shape((1000, 3), 64) == (64, 1)
    assert scaled_shape((20, 10), 64) == (40, 20), "doubled at most"


def test_scaling_keeps_narrow_passages() -> None:
    free = np.zeros((10, 7), bool)
    free[:, 3] = True
    assert scaled_free(free, (4, 3)).tolist() == [[False, True, False]] * 4
    assert np.array_equal(scaled_free(free, free.shape), free)


def test_small_maps_are_enlarged() -> None:
    free = np.array([[True, False], [False, True]])
    enlarged = scaled_free(free, (4, 6))
    assert np.array_equal(enlarged, free.repeat(2, axis=0).repeat(3, axis=1))


def test_a_scaled_map_is_kept() -> None:
    grid = GridMap(np.ones((40, 40)))
    first = scaled_map(grid, (20, 20))
    assert scaled_map(grid, (20, 20)) is first
    assert scaled_map(grid, (10, 10)).shape == (10, 10)
