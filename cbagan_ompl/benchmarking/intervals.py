"""Medians over tasks, of values and of ratios, with bootstrap intervals.

The bootstrap resamples the tasks, and the runs of each task, so that an interval covers both the
choice of the tasks and the chance in the runs. It is the percentile bootstrap of `Efron and
Tibshirani, An Introduction to the Bootstrap (1993) <https://doi.org/10.1201/9780429246593>`_, in
two stages.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

_RESAMPLES = 2000
_TAILS = (0.025, 0.975)


@dataclass(frozen=True)
class Interval:
    """A median over tasks with its bootstrap 95 % interval; infinite where most runs are unsolved.

    Attributes:
        median: median over the tasks of the medians over the runs.
        low: lower end of the interval.
        high: upper end of the interval.
    """

    median: float
    low: float
    high: float


@dataclass(frozen=True)
class Medians:
    """The medians over the runs on each task.

    Attributes:
        medians: shape (T,).
        resampled: the same with the runs of each task resampled, shape (B, T).
    """

    medians: NDArray[np.float64]
    resampled: NDArray[np.float64]

    @classmethod
    def of(cls, tasks: Sequence[NDArray[np.float64]], seed: int) -> Medians:
        """Return the medians of some runs.

        Args:
            tasks: for each task the values of its runs, shape (R,); infinite ones are allowed.
            seed: of the resampling; another one for what is divided by these.
        """
        rng = np.random.default_rng(seed)
        resampled = [_resample_medians(runs, rng) for runs in tasks]
        return cls(np.array([np.median(runs) for runs in tasks]), np.stack(resampled, axis=1))

    def over(self, baseline: Medians) -> Medians:
        """Return the ratios to the medians of a baseline on the same tasks."""
        return Medians(
            ratio(self.medians, baseline.medians), ratio(self.resampled, baseline.resampled)
        )

    def interval(self) -> Interval:
        """Return the median over the tasks with its interval."""
        resamples, tasks = self.resampled.shape
        chosen = np.random.default_rng(0).integers(tasks, size=(resamples, tasks))
        spread = _medians_of_rows(np.take_along_axis(self.resampled, chosen, axis=1))
        # Quantiles that are values of the sample, because there is nothing between infinite ones.
        low, high = np.quantile(spread, _TAILS, method="inverted_cdf")
        return Interval(float(np.median(self.medians)), float(low), float(high))


def median_interval(tasks: Sequence[NDArray[np.float64]]) -> Interval:
    """Return the median over tasks of the medians over runs.

    Args:
        tasks: for each task the values of its runs, shape (R,); infinite ones are allowed.

    Example:
        >>> median_interval([np.array([1.0, 3.0]), np.array([2.0, 2.0])]).median
        2.0
    """
    return Medians.of(tasks, 0).interval()


def ratio_interval(
    tasks: Sequence[NDArray[np.float64]], baseline: Sequence[NDArray[np.float64]]
) -> Interval:
    """Return the median over tasks of the ratio of the medians over runs.

    Args:
        tasks: as for :func:`median_interval`.
        baseline: the divisor: the values of the baseline, for the same tasks.

    Example:
        >>> ratio_interval([np.array([1.0, 1.0])], [np.array([2.0, 2.0])])
        Interval(median=0.5, low=0.5, high=0.5)
    """
    return Medians.of(tasks, 0).over(Medians.of(baseline, 1)).interval()


def ratio(values: NDArray[np.float64], baseline: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return quotients; two equal values have the ratio 1, also where both are infinite.

    Args:
        values: the dividends, of any shape, in any unit.
        baseline: the divisors, of the same shape and unit.
    """
    ones: NDArray[np.float64] = np.ones(values.shape)
    with np.errstate(divide="ignore"):
        return np.divide(values, baseline, out=ones, where=values != baseline)


def _resample_medians(runs: NDArray[np.float64], rng: np.random.Generator) -> NDArray[np.float64]:
    """Return medians of the runs on a task, resampled with replacement, shape (B,)."""
    return _medians_of_rows(runs[rng.integers(len(runs), size=(_RESAMPLES, len(runs)))])


def _medians_of_rows(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the median of each row, as ``np.median`` does; sorting takes a tenth of its time."""
    ordered = np.sort(values, axis=1)
    size = values.shape[1]
    middle: NDArray[np.float64] = (ordered[:, (size - 1) // 2] + ordered[:, size // 2]) / 2
    return middle
