from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from cbagan_ompl.evaluation.metrics import confusion, region_scores, task_scores
from cbagan_ompl.maps.connectivity import connects


def mask(*rows: str) -> NDArray[np.bool_]:
    return np.array([[cell == "#" for cell in row] for row in rows])


TRUTH = mask("##..", "##..", "....")
SHIFTED = mask(".##.", ".##.", "....")


def test_counts_and_scores_by_hand() -> None:
    counts = confusion(SHIFTED[None], TRUTH[None])
    assert [int(count[0]) for count in counts] == [2, 2, 2]
    assert counts.iou()[0] == pytest.approx(2 / 6)
    assert counts.dice()[0] == pytest.approx(4 / 8)
    assert counts.precision()[0] == counts.recall()[0] == 0.5


def test_pooled_scores_weigh_pixels_and_means_weigh_images() -> None:
    small, large = mask("#...", "....", "...."), mask("####", "####", "####")
    counts = confusion(np.stack((small, ~large)), np.stack((small, large)))
    assert counts.iou().tolist() == [1, 0]
    assert float(counts.pool().iou()) == pytest.approx(1 / 13)


@pytest.mark.parametrize("truth", [TRUTH, np.zeros_like(TRUTH)])
def test_an_empty_prediction_scores_zero(truth: NDArray[np.bool_]) -> None:
    endpoints = np.array([[0.5, 0.5]]), np.array([[3.5, 2.5]])
    scores = region_scores(
        np.zeros((1, 3, 4), bool), truth[None], np.ones((1, 3, 4), bool), *endpoints
    )
    assert set(scores.values()) == {0}


def test_regions_are_8_connected() -> None:
    diagonal = mask("#..", ".#.", "..#")
    assert connects(diagonal, (0, 0), (2, 2), connectivity=8)
    assert not connects(mask("#..", "...", "..#"), (0, 0), (2, 2), connectivity=8)


def test_start_and_goal_count_as_region() -> None:
    assert connects(mask("...", ".#.", "..."), (0, 0), (2, 2), connectivity=8)


def test_connectivity_stops_at_obstacles() -> None:
    region = np.ones((2, 3, 3), bool)
    free = region.copy()
    free[1, :, 1] = False
    endpoints = np.array([[0.5, 0.5]] * 2), np.array([[2.5, 2.5]] * 2)
    scores = region_scores(region, region, free, *endpoints)
    assert scores["connectivity"] == 0.5
    assert scores["iou"] == scores["dice_per_image"] == 1


def test_8_and_4_connected() -> None:
    diagonal = np.eye(3, dtype=np.bool_)
    assert connects(diagonal, (0, 0), (2, 2), connectivity=8)
    assert not connects(diagonal, (0, 0), (2, 2), connectivity=4)
    endpoints = np.array([[0.5, 0.5]]), np.array([[2.5, 2.5]])
    tasks = task_scores(diagonal[None], diagonal[None], np.ones((1, 3, 3), bool), *endpoints)
    assert (tasks.connected.tolist(), tasks.connected_4.tolist()) == ([True], [False])
    assert tasks.means(np.ones(1))["area"] == pytest.approx(1 / 3)
