from __future__ import annotations

import numpy as np
import pytest

from cbagan_ompl.datasets import augmentation
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


def test_shift_and_shear_have_the_papers_sizes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(augmentation, "ROTATION_PROBABILITY", 0.0)
    bar = np.ones((257, 257), dtype=np.bool_)
    bar[4:253, 126:131] = False  # around the centre
    down, right, slopes = set(), set(), []
    for seed in range(300):
        blocked = ~augment(bar, np.random.default_rng(seed))
        rows = np.flatnonzero(blocked.any(axis=1))
        across = [np.flatnonzero(blocked[row]).mean() for row in rows]
        down.add(round(rows.mean() - 128))
        right.add(round(across[len(across) // 2] - 128))
        slopes.append((across[-1] - across[0]) / (len(rows) - 1))
    assert down == right == {-2, -1, 0, 1, 2}
    angles = np.degrees(np.arctan(slopes))
    assert 4.6 < angles.max() < 5.2
    assert -5.2 < angles.min() < -4.6


def test_half_of_the_copies_are_rotated_by_any_angle() -> None:
    free = np.ones((65, 65), dtype=np.bool_)
    free[30:35, 50:55] = False  # to the right of the centre
    angles = []
    for seed in range(240):
        rows, columns = np.nonzero(~augment(free, np.random.default_rng(seed)))
        angles.append(np.degrees(np.arctan2(rows.mean() - 32, columns.mean() - 32)))
    # Shift and shear turn the block by less.
    rotated = np.abs(angles) > 12
    assert 0.4 < rotated.mean() < 0.6
    counts = np.histogram(np.array(angles)[rotated], bins=8, range=(-180, 180))[0]
    assert (counts >= 5).all(), "each eighth of the circle"
