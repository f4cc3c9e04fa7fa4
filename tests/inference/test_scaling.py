from __future__ import annotations

import cv2
import numpy as np
import pytest

from cbagan_ompl import GridMap
from cbagan_ompl.inference.scaling import enlarged_values, scaled_free, scaled_map, scaled_shape


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


@pytest.mark.parametrize("shape", [(40, 33), (80, 66), (160, 132), (97, 71), (41, 66), (20, 16)])
@pytest.mark.parametrize("kind", ["everywhere", "sparse", "nowhere"])
def test_enlarged_values_are_those_of_the_whole_image(shape: tuple[int, int], kind: str) -> None:
    rng = np.random.default_rng(0)
    values = rng.random((40, 33), dtype=np.float32)
    if kind != "everywhere":
        values[:] = 0
    if kind == "sparse":
        values[17:22, 12:20] = rng.random((5, 8))
        values[0, 0] = values[-1, -1] = 1
    whole = values if shape == values.shape else cv2.resize(values, shape[::-1])
    expected = np.where(whole < 0.25, 0, whole)
    assert np.array_equal(enlarged_values(values, shape, 0.25), expected)
