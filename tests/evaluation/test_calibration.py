from __future__ import annotations

import numpy as np
import pytest

from cbagan_ompl import ConfigError
from cbagan_ompl.evaluation.calibration import (
    conformal_threshold,
    coverage_interval,
    largest_threshold,
)


def two_ways() -> tuple[np.ndarray, np.ndarray]:
    """Return values and free pixels: a short way of value 0.25, and a long one of 0.75."""
    free = np.ones((30, 21), bool)
    free[1:-1, 10] = False
    values = np.zeros(free.shape, np.float32)
    values[0] = 0.25
    values[:, :2] = values[:, -2:] = values[-1] = 0.75
    return values * free, free


def test_the_largest_threshold_needs_a_short_path() -> None:
    values, free = two_ways()
    assert largest_threshold(values, free, (0, 0), (20, 0)) == 0.25
    assert largest_threshold(values, free, (0, 0), (20, 0), within=3.0) == 0.75


def test_endpoints_count_as_part_of_the_pixels() -> None:
    values, free = two_ways()
    values[0, 0] = values[0, 20] = 0
    assert largest_threshold(values, free, (0, 0), (20, 0)) == 0.25


def test_without_a_path_in_the_heat_map_the_threshold_is_0() -> None:
    values, free = two_ways()
    values[0, 5] = values[-1, 5] = 0
    assert largest_threshold(values, free, (0, 0), (20, 0), within=3.0) == 0


@pytest.mark.parametrize(
    ("count", "rank"), [(18, 0), (19, 1), (38, 1), (39, 2), (99, 5), (100, 5), (1000, 50)]
)
def test_ranks_of_the_finite_sample_correction(count: int, rank: int) -> None:
    thresholds = np.random.default_rng(0).permutation(np.arange(1.0, count + 1))
    assert conformal_threshold(thresholds, 0.95) == rank


def test_coverage_of_exchangeable_tasks() -> None:
    rng = np.random.default_rng(0)
    covered = []
    for _ in range(3000):
        values = rng.random(120)
        covered.append(values[0] >= conformal_threshold(values[1:], 0.9))
    assert 0.9 - 0.015 <= np.mean(covered) <= 0.9 + 1 / 120 + 0.015


def test_the_interval_holds_what_tests_find() -> None:
    rng = np.random.default_rng(1)
    low, high = coverage_interval(99, 60, 0.95)
    inside = []
    for _ in range(2000):
        threshold = conformal_threshold(rng.random(99), 0.95)
        inside.append(low <= (rng.random(60) >= threshold).mean() <= high)
    assert np.mean(inside) >= 0.93
    assert coverage_interval(10, 60, 0.95) == (1, 1)


def test_calibrations_without_sense() -> None:
    with pytest.raises(ConfigError, match="needs tasks"):
        conformal_threshold(np.array([]), 0.95)
    with pytest.raises(ConfigError, match="probability is a fraction"):
        conformal_threshold(np.array([0.5]), 1.5)
