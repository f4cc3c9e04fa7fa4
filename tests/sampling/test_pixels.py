from __future__ import annotations

import numpy as np
import pytest

from cbagan_ompl.sampling.pixels import WeightedPixels


@pytest.mark.parametrize("count", [1, 2, 15, 16, 17, 32, 33, 500])
def test_weighted_pixels_are_those_of_the_cumulative_sum(count: int) -> None:
    rng = np.random.default_rng(count)
    pixels = np.sort(rng.choice(10_000, count, replace=False))
    weights = (rng.integers(1, 64, count) / 64).astype(np.float32)  # whose sums are exact
    weights[0] = 0 if count > 1 else 1
    weights[-1] = 1
    sums = weights.cumsum(dtype=np.float64)
    targets = np.random.default_rng(0).random(9000) * sums[-1]
    expected = pixels[np.searchsorted(sums, targets, side="right")]
    sampled = WeightedPixels(pixels, weights).sample(9000, np.random.default_rng(0))
    assert np.array_equal(sampled, expected)
