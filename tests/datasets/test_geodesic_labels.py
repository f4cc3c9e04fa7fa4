from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from cbagan_ompl.datasets.geodesic import distance_field
from cbagan_ompl.datasets.geodesic_labels import (
    EPSILON,
    SLACK,
    geodesic_label,
    travel_directions,
)
from cbagan_ompl.maps.connectivity import connects
from cbagan_ompl.sampling.heatmap import REGION_THRESHOLD


def label_of(
    free: np.ndarray[Any, Any], start: tuple[int, int], goal: tuple[int, int]
) -> np.ndarray[Any, Any]:
    return geodesic_label(distance_field(free, start), distance_field(free, goal), goal)


def test_labels_are_one_on_the_shortest_path_and_a_half_at_the_border() -> None:
    detour = EPSILON * 100 + SLACK
    # The start, a point on the path, the goal, one behind it, one on the border, and an obstacle.
    from_start = np.array([[0, 40, 100, 103, 50, np.inf]], np.float32)
    from_goal = np.array([[100, 60, 0, 3, 50 + detour, np.inf]], np.float32)
    label = geodesic_label(from_start, from_goal, (2, 0))[0]
    assert label.tolist() == pytest.approx([1, 1, 1, 2 ** (-6 / detour), 0.5, 0])


def test_labels_connect_the_endpoints_through_free_space() -> None:
    free = np.ones((80, 100), np.bool_)
    free[:60, 50:53] = False
    label = label_of(free, (20, 20), (80, 20))
    assert label.max() <= 1
    assert label[20, 20] == pytest.approx(1, abs=0.02)
    assert (label[~free] == 0).all()
    assert connects(label >= REGION_THRESHOLD, (20, 20), (80, 20), connectivity=8)
    assert label[70, 99] < 0.01


def test_labels_keep_both_of_two_paths_of_equal_length() -> None:
    free = np.ones((61, 100), np.bool_)
    free[20:41, 30:70] = False
    region = label_of(free, (10, 30), (90, 30)) >= REGION_THRESHOLD
    for half in (slice(0, 31), slice(31, 61)):
        one = region.copy()
        one[half, 30:70] = False
        assert connects(one, (10, 30), (90, 30), connectivity=8)


def test_directions_lead_along_the_shortest_path() -> None:
    free = np.ones((64, 64), np.bool_)
    free[:48, 31:33] = False
    start, goal = (10, 10), (54, 10)
    from_goal = distance_field(free, goal)
    label = geodesic_label(distance_field(free, start), from_goal, goal)
    directions = travel_directions(from_goal, label)
    assert directions.shape == (2, 16, 16)
    length = np.hypot(*directions)
    assert ((abs(length - 1) < 1e-5) | (length == 0)).all()
    # Down to the end of the wall, and up again behind it.
    for row, column, end in ((2, 2, (30.5, 48)), (9, 5, (30.5, 48)), (8, 9, (54.5, 10.5))):
        vector = np.array(end) - (4 * column + 2, 4 * row + 2)
        cosine = directions[:, row, column] @ vector / np.linalg.norm(vector)
        assert cosine > 0.999
    assert (travel_directions(from_goal, np.zeros_like(label)) == 0).all()
    inside = label.reshape(16, 4, 16, 4).mean((1, 3)) > 0.5
    assert (length[inside] > 0).all()


def test_a_task_without_a_path_has_no_region() -> None:
    free = np.ones((8, 9), bool)
    free[:, 4] = False
    assert not label_of(free, (1, 1), (7, 6)).any()
