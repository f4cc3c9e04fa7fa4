"""The threshold from which on the pixels of a heat map hold a nearly shortest path.

Split conformal calibration: V. Vovk, A. Gammerman and G. Shafer, "Algorithmic learning in a random
world", 2005, https://doi.org/10.1007/b106715. An introduction: A. N. Angelopoulos and S. Bates, "A
gentle introduction to conformal prediction and distribution-free uncertainty quantification", 2021,
https://arxiv.org/abs/2107.07511. Each calibration task has a largest threshold at which its pixels
hold such a path. With n of them and a new task exchangeable with them, the chance that the new
task's is below the k-th smallest is at most k / (n + 1).
"""

from __future__ import annotations

from math import floor

import numpy as np
from numpy.typing import NDArray
from scipy.stats import betabinom

from ..common.validation import check_fraction
from ..errors import ConfigError

# Thresholds are found to 1 / 2 to the power of this.
_BISECTIONS = 9


def largest_threshold(
    values: NDArray[np.float32],
    free: NDArray[np.bool_],
    start: tuple[int, int],
    goal: tuple[int, int],
    within: float = 0.05,
) -> float:
    """Return the largest threshold at which the pixels of a heat map hold a nearly shortest path.

    Lengths are geodesic distances at any angle, see
    :func:`cbagan_ompl.datasets.geodesic.distance_field`, through pixels that share a side.

    Args:
        values: of the heat map, (H, W).
        free: of the map, (H, W).
        start: pixel (column, row), which counts as one of the pixels, as the goal does.
        goal: pixel (column, row).
        within: relative excess of the path's length over the shortest one.

    Returns:
        A multiple of 1/512, rounded down; 0 where only all of free space holds one.

    Example:
        >>> values = np.array([[0.5, 0.75, 1.0]], np.float32)
        >>> largest_threshold(values, values > 0, (0, 0), (2, 0))
        0.75
    """
    from ..datasets.geodesic import distance_field  # here, since numba takes long to import

    def length(mask: NDArray[np.bool_]) -> float:
        mask[start[1], start[0]] = mask[goal[1], goal[0]] = True
        field: NDArray[np.float32] = distance_field(mask, start)
        return float(field[goal[1], goal[0]])

    most = (1 + within) * length(free.copy())
    steps = 1 << _BISECTIONS
    # The threshold ``low`` is known to be small enough, ``high`` to be too large.
    low, high = 0, steps + 1
    while high - low > 1:
        middle = (low + high) // 2
        if length(free & (values >= middle / steps)) <= most:
            low = middle
        else:
            high = middle
    return low / steps


def conformal_threshold(thresholds: NDArray[np.float64], probability: float) -> float:
    """Return the threshold that a new task reaches with a probability.

    Args:
        thresholds: the largest ones of n calibration tasks, see :func:`largest_threshold`, (n,).
        probability: at least which a new task's is as large, if it is exchangeable with them.

    Returns:
        The k-th smallest with k = floor((1 - probability) (n + 1)); 0, which every task reaches,
        where n is too small for any.

    Raises:
        ConfigError: no thresholds, or a probability that is none.

    Example:
        >>> conformal_threshold(np.arange(1.0, 100.0), 0.95)
        5.0
        >>> conformal_threshold(np.array([0.7, 0.8]), 0.95)
        0.0
    """
    check_fraction("probability", probability)
    if not len(thresholds):
        raise ConfigError("a calibration needs tasks, got none")
    # Rounding must not turn a whole number into the one below it.
    rank = floor((1 - probability) * (len(thresholds) + 1) + 1e-9)
    return float(np.sort(thresholds)[rank - 1]) if rank else 0.0


def coverage_interval(
    calibrated: int, tested: int, probability: float, confidence: float = 0.95
) -> tuple[float, float]:
    """Return where the coverage in a test lies if its tasks are like those of the calibration.

    The number of test tasks that reach the k-th smallest of n thresholds has a beta-binomial
    distribution with the parameters n + 1 - k and k, where no two thresholds are equal.

    Args:
        calibrated: n, tasks of the calibration.
        tested: tasks of the test.
        probability: as for :func:`conformal_threshold`.
        confidence: of the interval.

    Returns:
        Lowest and highest fraction of the test tasks.

    Example:
        >>> coverage_interval(999, 1000, 0.95)
        (0.93, 0.968)
    """
    rank = floor((1 - probability) * (calibrated + 1) + 1e-9)
    if not rank:
        return 1.0, 1.0
    tail = (1 - confidence) / 2
    limits = betabinom.ppf([tail, 1 - tail], tested, calibrated + 1 - rank, rank) / tested
    return float(limits[0]), float(limits[1])
