"""Scores of a predicted region, for the region class alone.

Nearly five sixths of the pixels of the data set lie outside the region, so a score that counts
them praises an empty prediction. Here an empty prediction scores 0.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray


class Confusion(NamedTuple):
    """Pixel counts, one of each an image, or for a pool of images, there weighted sums as well."""

    true_positive: NDArray[Any]
    false_positive: NDArray[Any]
    false_negative: NDArray[Any]

    def pooled(self) -> Confusion:
        """The counts over all images."""
        return Confusion(*(np.asarray(counts.sum()) for counts in self))

    def iou(self) -> NDArray[np.float64]:
        """Intersection over union, TP / (TP + FN + FP)."""
        tp, fp, fn = self
        return _ratio(tp, tp + fn + fp)

    def dice(self) -> NDArray[np.float64]:
        """Dice score, 2 TP / (2 TP + FN + FP)."""
        tp, fp, fn = self
        return _ratio(2 * tp, 2 * tp + fn + fp)

    def precision(self) -> NDArray[np.float64]:
        """Share of the predicted region that is right, TP / (TP + FP)."""
        return _ratio(self.true_positive, self.true_positive + self.false_positive)

    def recall(self) -> NDArray[np.float64]:
        """Share of the true region that was found, TP / (TP + FN)."""
        return _ratio(self.true_positive, self.true_positive + self.false_negative)


def confusion(predicted: NDArray[np.bool_], truth: NDArray[np.bool_]) -> Confusion:
    """Count pixels of each kind.

    Args:
        predicted: (N, H, W), true in the predicted region.
        truth: (N, H, W), true in the true region.

    Returns:
        Counts of shape (N,).
    """
    return Confusion(
        _count(predicted & truth), _count(predicted & ~truth), _count(~predicted & truth)
    )


def connects(
    region: NDArray[np.bool_], start: tuple[int, int], goal: tuple[int, int], connectivity: int = 8
) -> bool:
    """Whether one connected part of the region holds both start and goal.

    Args:
        region: (H, W), true inside; what is no free space must be false already.
        start: pixel (column, row). Start and goal count as part of the region.
        goal: pixel (column, row).
        connectivity: 8 or 4 neighbours.
    """
    mask = region.astype(np.uint8)
    mask[start[1], start[0]] = mask[goal[1], goal[0]] = 1
    labels = cv2.connectedComponents(mask, connectivity=connectivity)[1]
    return bool(labels[start[1], start[0]] == labels[goal[1], goal[0]])


class TaskScores(NamedTuple):
    """What is known of the prediction of each of N tasks, arrays of shape (N,).

    Attributes:
        counts: pixels of each kind.
        joined: whether start and goal are joined inside region and free space, 8-connected.
        joined_4: the same, 4-connected.
        area: pixels of the region in free space.
        free: pixels of free space.
    """

    counts: Confusion
    joined: NDArray[np.bool_]
    joined_4: NDArray[np.bool_]
    area: NDArray[np.int64]
    free: NDArray[np.int64]

    def means(self, weights: NDArray[np.float64]) -> dict[str, NDArray[np.float64]]:
        """All scores, each task weighing as often as it is counted.

        Args:
            weights: (..., N).

        Returns:
            ``iou``, ``dice``, ``precision`` and ``recall`` over the pixels of all images, the same
            with suffix ``_per_image`` as means over images, ``connectivity`` and
            ``connectivity_4``, the share of tasks whose start and goal are joined, and ``area``,
            the share of free space that the region takes; of shape (...) each.
        """
        pooled = Confusion(*(weights @ counts for counts in self.counts))
        scores = {}
        for name in ("iou", "dice", "precision", "recall"):
            scores[name] = getattr(pooled, name)()
            scores[f"{name}_per_image"] = _mean(getattr(self.counts, name)(), weights)
        scores["connectivity"] = _mean(self.joined, weights)
        scores["connectivity_4"] = _mean(self.joined_4, weights)
        scores["area"] = (weights @ self.area) / (weights @ self.free)
        return scores


def task_scores(
    predicted: NDArray[np.bool_],
    truth: NDArray[np.bool_],
    free: NDArray[np.bool_],
    start: NDArray[np.floating[Any]],
    goal: NDArray[np.floating[Any]],
) -> TaskScores:
    """Compare predicted regions with the true ones.

    Args:
        predicted: (N, H, W), true in the predicted region.
        truth: (N, H, W), true in the true region.
        free: (N, H, W), true in free space.
        start: (N, 2), pixel coordinates (u, v).
        goal: (N, 2), the same.
    """
    inside = predicted & free
    ends = [
        ((s[0], s[1]), (g[0], g[1]))
        for s, g in zip(start.astype(int).tolist(), goal.astype(int).tolist(), strict=True)
    ]

    def joined(connectivity: int) -> NDArray[np.bool_]:
        return np.array(
            [connects(mask, *pair, connectivity) for mask, pair in zip(inside, ends, strict=True)]
        )

    return TaskScores(
        confusion(predicted, truth), joined(8), joined(4), _count(inside), _count(free)
    )


def region_scores(
    predicted: NDArray[np.bool_],
    truth: NDArray[np.bool_],
    free: NDArray[np.bool_],
    start: NDArray[np.floating[Any]],
    goal: NDArray[np.floating[Any]],
) -> dict[str, float]:
    """All scores of predicted regions; arguments as for :func:`task_scores`.

    Returns:
        See :meth:`TaskScores.means`.
    """
    scores = task_scores(predicted, truth, free, start, goal).means(np.ones(len(truth)))
    return {name: float(value) for name, value in scores.items()}


def _count(mask: NDArray[np.bool_]) -> NDArray[np.int64]:
    return np.asarray(np.count_nonzero(mask, axis=(1, 2)), dtype=np.int64)


def _mean(values: NDArray[Any], weights: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray((weights @ values) / weights.sum(axis=-1), dtype=np.float64)


def _ratio(part: NDArray[Any], whole: NDArray[Any]) -> NDArray[np.float64]:
    # Nothing predicted scores 0, also where there was nothing to find.
    return np.asarray(part / np.maximum(whole, 1), dtype=np.float64)
