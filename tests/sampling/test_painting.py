from __future__ import annotations

import pickle

import cv2
import numpy as np
import pytest

from cbagan_ompl import GridMap, Heatmap
from cbagan_ompl.sampling.painting import paint_heatmap
from cbagan_ompl.sampling.sampler import HeatmapSampler

SHAPES = [(40, 33), (80, 66), (160, 132), (97, 71), (41, 66), (20, 16), (20, 70)]


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("kind", ["everywhere", "sparse"])
def test_painted_values_are_those_of_a_resized_image(shape: tuple[int, int], kind: str) -> None:
    rng = np.random.default_rng(0)
    values = rng.random((40, 33), dtype=np.float32)
    if kind == "sparse":
        values[:] = 0
        values[17:22, 12:20] = rng.random((5, 8))
        values[0, 0] = values[-1, -1] = values[-1, 0] = 1
    grid = GridMap(rng.random(shape) < 0.8)
    whole = values if shape == values.shape else cv2.resize(values, shape[::-1])
    expected = Heatmap(np.where(whole < 0.25, 0, whole), grid)
    heatmap = paint_heatmap(values, grid, 0.25)
    assert heatmap is not None
    np.testing.assert_allclose(heatmap.values, expected.values, rtol=0, atol=1e-6)
    assert np.array_equal(heatmap.support, expected.support)
    assert np.array_equal(heatmap.support_values, heatmap.values.ravel()[heatmap.support])
    assert not heatmap.values.flags.writeable
    assert heatmap.heading is None
    assert np.array_equal(heatmap.sample(50, rng=1), expected.sample(50, rng=1))


def test_nothing_is_painted_on_obstacles_or_below_the_least_value() -> None:
    grid = GridMap([[1, 0], [1, 1]])
    assert paint_heatmap(np.array([[0.2, 0.9], [0.2, 0.2]], np.float32), grid, 0.25) is None


def test_headings_are_those_of_the_patches_where_there_is_a_value() -> None:
    values = np.zeros((8, 12), np.float32)
    values[:, :8] = 1
    directions = np.zeros((2, 2, 4), np.float32)  # the last column lies beyond the map
    directions[:, 0, 0], directions[:, 1, 1] = (0, 1), (-1, 0)  # down, and to the left
    free = np.ones((16, 24), np.bool_)
    free[3, 3] = False
    heatmap = paint_heatmap(values, GridMap(free), 0.25, directions, (2, 3))
    assert heatmap is not None
    heading = heatmap.heading
    assert heading is not None
    assert heading.dtype == np.float32
    assert not heading.flags.writeable
    assert heading is heatmap.heading
    expected = np.full(free.shape, np.nan, np.float32)
    expected[:8, :8] = np.pi / 2
    expected[8:, 8:16] = np.pi
    expected[3, 3] = np.nan
    np.testing.assert_allclose(heading, expected, atol=1e-6)
    # On a ROS map y points up, and the map is turned by the yaw of its origin.
    turned = paint_heatmap(values, GridMap(free, 0.5, (1, 2, 0.3)), 0.25, directions, (2, 3))
    assert turned is not None
    assert turned.heading is not None
    assert turned.heading[0, 0] == pytest.approx(0.3 - np.pi / 2)
    assert turned.heading[15, 15] == pytest.approx(0.3 - np.pi + 2 * np.pi * (0.3 < 0), abs=1e-5)
    assert pickle.loads(pickle.dumps(turned)).heading[0, 0] == turned.heading[0, 0]
    assert turned.with_heading(None).heading is None


def test_headings_are_computed_for_poses_alone() -> None:
    grid = GridMap(np.ones((8, 8), np.bool_))
    directions = np.ones((2, 2, 2), np.float32)
    heatmap = paint_heatmap(np.ones((8, 8), np.float32), grid, 0.25, directions, (2, 2))
    assert heatmap is not None
    sampler = HeatmapSampler(heatmap, seed=0)
    headings = sampler.heading_sampler(reverses=False)
    for _ in range(100):
        x, y = sampler.next()
    assert "heading" not in vars(heatmap)
    assert headings.are_followed(x, y, np.pi / 4)
    assert "heading" in vars(heatmap)
