from __future__ import annotations

import numpy as np
import pytest

from cbagan_ompl.evaluation.bootstrap import RESAMPLES, bootstrap_weights, percentile_interval


def test_weights_of_resamples() -> None:
    map_of = np.repeat([3, 5, 9], [10, 10, 20])
    weights = bootstrap_weights(map_of, 0)
    assert weights.shape == (RESAMPLES, 40)
    assert np.array_equal(weights, bootstrap_weights(map_of, 0))
    # Each resampled map brings as many samples as it has tasks.
    for k in (3, 5, 9):
        assert not (weights[:, map_of == k].sum(axis=1) % (map_of == k).sum()).any()
    assert weights.mean() == pytest.approx(1, abs=0.05)


def test_tasks_of_one_map_are_not_taken_as_independent() -> None:
    rng = np.random.default_rng(0)
    map_of = np.repeat(np.arange(10), 50)
    values = rng.normal(size=10)[map_of] + 0.1 * rng.normal(size=500)
    widths = []
    for groups in (map_of, np.arange(500)):
        weights = bootstrap_weights(groups, 0)
        low, high = percentile_interval(weights @ values / weights.sum(axis=1))
        assert low < values.mean() < high
        widths.append(high - low)
    assert widths[0] > 3 * widths[1]
