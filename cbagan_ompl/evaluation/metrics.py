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
    """Pixel counts, one of each an image, or scalars for a pool of images."""

    true_positive: NDArray[np.int64]
    false_positive: NDArray[np.int64]
    false_negative: NDArray[np.int64]

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

    def count(mask: NDArray[np.bool_]) -> NDArray[np.int64]:
        return np.asarray(np.count_nonzero(mask, axis=(1, 2)), dtype=np.int64)

    return Confusion(count(predicted & truth), count(predicted & ~truth), count(~predicted & truth))


def joins(region: NDArray[np.bool_], start: tuple[int, int], goal: tuple[int, int]) -> bool:
    """Whether one 8-connected part of the region holds both start and goal.

    Args:
        region: (H, W), true inside; what is no free space must be false already.
        start: pixel (column, row). Start and goal count as part of the region.
        goal: pixel (column, row).
    """
    mask = region.astype(np.uint8)
    mask[start[1], start[0]] = mask[goal[1], goal[0]] = 1
    labels = cv2.connectedComponents(mask, connectivity=8)[1]
    return bool(labels[start[1], start[0]] == labels[goal[1], goal[0]])


def region_scores(
    predicted: NDArray[np.bool_],
    truth: NDArray[np.bool_],
    free: NDArray[np.bool_],
    start: NDArray[np.floating[Any]],
    goal: NDArray[np.floating[Any]],
) -> dict[str, float]:
    """All scores of predicted regions.

    Args:
        predicted: (N, H, W), true in the predicted region.
        truth: (N, H, W), true in the true region.
        free: (N, H, W), true in free space.
        start: (N, 2), pixel coordinates (u, v).
        goal: (N, 2), the same.

    Returns:
        ``iou``, ``dice``, ``precision`` and ``recall`` over the pixels of all images,
        the same with suffix ``_per_image`` as means over images, and ``connectivity``, the share
        of tasks whose start and goal are joined inside region and free space.
    """
    counts = confusion(predicted, truth)
    pooled = counts.pooled()
    scores: dict[str, float] = {}
    for name in ("iou", "dice", "precision", "recall"):
        scores[name] = float(getattr(pooled, name)())
        scores[f"{name}_per_image"] = float(getattr(counts, name)().mean())
    ends = zip(start.astype(int).tolist(), goal.astype(int).tolist(), strict=True)
    joined = [
        joins(region, (s[0], s[1]), (g[0], g[1]))
        for region, (s, g) in zip(predicted & free, ends, strict=True)
    ]
    scores["connectivity"] = float(np.mean(joined))
    return scores


def _ratio(part: NDArray[np.int64], whole: NDArray[np.int64]) -> NDArray[np.float64]:
    # Nothing predicted scores 0, also where there was nothing to find.
    return np.asarray(part / np.maximum(whole, 1), dtype=np.float64)
