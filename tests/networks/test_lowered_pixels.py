from __future__ import annotations

import numpy as np
import pytest

torch = pytest.importorskip("torch")

from cbagan_ompl.networks import passage_generator
from cbagan_ompl.networks.lowered_pixels import lowered_pixels


@pytest.mark.parametrize("share", [0.0, 0.3, 1.0])
@pytest.mark.parametrize("batch", [1, 3])
def test_the_compiled_function_computes_what_the_network_does(batch: int, share: float) -> None:
    rng = np.random.default_rng(0)
    codes = np.zeros((batch, 4, 6, 5), np.int32)
    codes[:, 0] = 0xFFFF
    several = rng.random((batch, 6, 5)) < share
    for node in range(4):
        codes[:, node][several] = rng.integers(0, 2**16, several.sum())
    codes[0, :, 2, 3] = 0
    costs = rng.uniform(0.2, 3, codes.shape).astype(np.float32)
    distances = rng.uniform(10, 12, (batch, 2, *codes.shape[1:])).astype(np.float32)
    distances[rng.random(distances.shape) < 0.2] = 1e4
    distances[np.stack((codes, codes), 1) == 0] = 1e4  # no path leads to a node that is none
    expected = passage_generator.lowered_pixels(*map(torch.from_numpy, (costs, codes, distances)))
    result = lowered_pixels(costs, codes, distances)
    np.testing.assert_allclose(result, expected.numpy(), rtol=0, atol=1e-4)
    assert (result < 0).any() == bool(share)
