"""Bootstrap intervals of scores over tasks that share maps.

The bootstrap is that of B. Efron, "Bootstrap methods: another look at the jackknife", Annals of
Statistics 7, 1979, https://doi.org/10.1214/aos/1176344552.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

#: Number of resamples.
RESAMPLES = 1000


def bootstrap_weights(map_of: NDArray[np.int64], seed: int) -> NDArray[np.float64]:
    """Return how often each task is counted in each resample.

    Maps are resampled with replacement, and then the tasks of each resampled map. The tasks of one
    map resemble each other: intervals that took them as independent would be too narrow.

    Args:
        map_of: (N,), the map of each task.
        seed: the same seed gives the same weights.

    Returns:
        (:data:`RESAMPLES`, N).

    Example:
        >>> bootstrap_weights(np.array([0, 0, 1]), seed=0).shape
        (1000, 3)
    """
    rng = np.random.default_rng(seed)
    maps = [np.flatnonzero(map_of == k) for k in np.unique(map_of)]
    weights = np.zeros((RESAMPLES, len(map_of)))
    counts = rng.multinomial(len(maps), np.full(len(maps), 1 / len(maps)), size=RESAMPLES)
    for tasks, count in zip(maps, counts.T, strict=True):
        probabilities = np.full(len(tasks), 1 / len(tasks))
        weights[:, tasks] = rng.multinomial(count * len(tasks), probabilities)
    return weights


def percentile_interval(values: NDArray[np.float64]) -> tuple[float, float]:
    """Return the 95 % percentile interval of a resampled score.

    Args:
        values: the score of each resample.

    Example:
        >>> percentile_interval(np.arange(101.0))
        (2.5, 97.5)
    """
    low, high = np.percentile(values, (2.5, 97.5)).tolist()
    return low, high
