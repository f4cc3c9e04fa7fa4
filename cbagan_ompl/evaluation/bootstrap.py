"""Bootstrap weights for scores over tasks that share maps."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

RESAMPLES = 1000


def resampled_weights(map_of: NDArray[np.int64], seed: int) -> NDArray[np.float64]:
    """How often each task is counted in each resample.

    Maps are drawn with replacement, then tasks of each drawn map: tasks on one map are alike, and
    intervals that took them for independent would be too narrow.

    Args:
        map_of: (N,), the map of each task.
        seed: the same seed gives the same weights.

    Returns:
        (:data:`RESAMPLES`, N).
    """
    rng = np.random.default_rng(seed)
    maps = [np.flatnonzero(map_of == k) for k in np.unique(map_of)]
    weights = np.zeros((RESAMPLES, len(map_of)))
    times = rng.multinomial(len(maps), np.full(len(maps), 1 / len(maps)), size=RESAMPLES)
    for tasks, drawn in zip(maps, times.T, strict=True):
        share = np.full(len(tasks), 1 / len(tasks))
        weights[:, tasks] = rng.multinomial(drawn * len(tasks), share)
    return weights


def interval(values: NDArray[np.float64]) -> tuple[float, float]:
    """The 95 % percentile interval of a resampled score."""
    low, high = np.percentile(values, (2.5, 97.5)).tolist()
    return low, high
