from __future__ import annotations

import numpy as np

from cbagan_ompl.datasets.augmentation import SHIFT, augment


def test_augmented_maps_hold_the_same_obstacles_elsewhere() -> None:
    free = np.ones((64, 64), dtype=np.bool_)
    free[20:34, 24:40] = False
    rotated = 0
    for seed in range(40):
        copy = augment(free, np.random.default_rng(seed))
        assert np.array_equal(copy, augment(free, np.random.default_rng(seed)))
        # A rotated or sheared box keeps its area, but for the pixels at its border.
        assert abs(int((~copy).sum()) - int((~free).sum())) < 0.12 * (~free).sum()
        upright = (~copy).any(axis=0).sum() <= 16 + 3
        rotated += not upright
        if upright and (~copy).any(axis=1).sum() <= 14 + 2:
            rows = np.nonzero((~copy).any(axis=1))[0]
            assert abs(rows.mean() - 26.5) <= SHIFT + 14
    assert 8 <= rotated <= 32, "about half of the copies are rotated"
