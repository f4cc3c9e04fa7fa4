"""Scores of predicted regions, for the region class alone.

Nearly five sixths of the pixels of the published data set lie outside the regions, so a score that
counts them is high for an empty prediction. Here an empty prediction scores 0.

With TP the pixels in both regions, FP those in the predicted region alone and FN those in the true
region alone, the scores are

    IoU = TP / (TP + FP + FN)               (Jaccard index)
    Dice = 2 TP / (2 TP + FP + FN)          (F1 score)
    precision = TP / (TP + FP)
    recall = TP / (TP + FN)
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..maps.connectivity import Connectivity, connects


class Confusion(NamedTuple):
    """Pixel counts of each image, or of a pool of images, where they may be weighted sums.

    Attributes:
        true_positive: TP, pixels in both regions.
        false_positive: FP, pixels in the predicted region alone.
        false_negative: FN, pixels in the true region alone.

    Example:
        >>> counts = Confusion(np.array([2]), np.array([1]), np.array([1]))
        >>> counts.iou().tolist()
        [0.5]
    """

    true_positive: NDArray[Any]
    false_positive: NDArray[Any]
    false_negative: NDArray[Any]

    def pool(self) -> Confusion:
        """Return the counts over all images."""
        return Confusion(*(np.asarray(counts.sum()) for counts in self))

    def iou(self) -> NDArray[np.float64]:
        """Return the intersection over union, TP / (TP + FP + FN)."""
        tp, fp, fn = self
        return _ratio(tp, tp + fn + fp)

    def dice(self) -> NDArray[np.float64]:
        """Return the Dice score, 2 TP / (2 TP + FP + FN)."""
        tp, fp, fn = self
        return _ratio(2 * tp, 2 * tp + fn + fp)

    def precision(self) -> NDArray[np.float64]:
        """Return the fraction of the predicted region that is right, TP / (TP + FP)."""
        return _ratio(self.true_positive, self.true_positive + self.false_positive)

    def recall(self) -> NDArray[np.float64]:
        """Return the fraction of the true region that was found, TP / (TP + FN)."""
        return _ratio(self.true_positive, self.true_positive + self.false_negative)


def confusion(predicted: NDArray[np.bool_], truth: NDArray[np.bool_]) -> Confusion:
    """Count the pixels of each kind.

    Args:
        predicted: (N, H, W), true in the predicted region.
        truth: (N, H, W), true in the true region.

    Returns:
        Counts of shape (N,).
    """
    return Confusion(
        _count(predicted & truth), _count(predicted & ~truth), _count(~predicted & truth)
    )


class TaskScores(NamedTuple):
    """Counts for the prediction of each of N tasks, arrays of shape (N,).

    Attributes:
        counts: pixels of each kind.
        connected: whether the region connects start and goal through free space, 8-connected.
        connected_4: the same, 4-connected.
        area: pixels of the region in free space.
        free: pixels of free space.
    """

    counts: Confusion
    connected: NDArray[np.bool_]
    connected_4: NDArray[np.bool_]
    area: NDArray[np.int64]
    free: NDArray[np.int64]

    def means(self, weights: NDArray[np.float64]) -> dict[str, NDArray[np.float64]]:
        """Return all scores over the tasks.

        Args:
            weights: (..., N), how often each task is counted.

        Returns:
            Of shape (...) each: ``iou``, ``dice``, ``precision`` and ``recall`` over the pixels of
            all images; the same with suffix ``_per_image`` as means over images;
            ``connectivity`` and ``connectivity_4``, the fractions of tasks whose start and goal are
            connected; ``area``, the fraction of free space in the region.
        """
        pooled = Confusion(*(weights @ counts for counts in self.counts))
        scores = {}
        for name in ("iou", "dice", "precision", "recall"):
            scores[name] = getattr(pooled, name)()
            scores[f"{name}_per_image"] = _mean(getattr(self.counts, name)(), weights)
        scores["connectivity"] = _mean(self.connected, weights)
        scores["connectivity_4"] = _mean(self.connected_4, weights)
        scores["area"] = (weights @ self.area) / (weights @ self.free)
        return scores


def task_scores(
    predicted: NDArray[np.bool_],
    truth: NDArray[np.bool_],
    free: NDArray[np.bool_],
    start: NDArray[np.floating[Any]],
    goal: NDArray[np.floating[Any]],
) -> TaskScores:
    """Compare predicted regions with the true ones, task by task.

    Args:
        predicted: (N, H, W), true in the predicted region.
        truth: (N, H, W), true in the true region.
        free: (N, H, W), true in free space.
        start: (N, 2), image coordinates (u, v) in pixels.
        goal: (N, 2), the same.
    """
    inside = predicted & free
    endpoints = [
        ((s[0], s[1]), (g[0], g[1]))
        for s, g in zip(start.astype(int).tolist(), goal.astype(int).tolist(), strict=True)
    ]

    def connected(connectivity: Connectivity) -> NDArray[np.bool_]:
        return np.array(
            [
                connects(mask, *pair, connectivity=connectivity)
                for mask, pair in zip(inside, endpoints, strict=True)
            ]
        )

    return TaskScores(
        confusion(predicted, truth), connected(8), connected(4), _count(inside), _count(free)
    )


def region_scores(
    predicted: NDArray[np.bool_],
    truth: NDArray[np.bool_],
    free: NDArray[np.bool_],
    start: NDArray[np.floating[Any]],
    goal: NDArray[np.floating[Any]],
) -> dict[str, float]:
    """Return all scores of predicted regions; arguments as for :func:`task_scores`.

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
    # An empty prediction scores 0, also where the true region is empty.
    return np.asarray(part / np.maximum(whole, 1), dtype=np.float64)
