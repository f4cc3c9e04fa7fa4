from __future__ import annotations

import numpy as np
import pytest

from cbagan_ompl import GridMap
from cbagan_ompl.maps import clearance as clearances
from cbagan_ompl.maps.clearance import map_clearance


def exact(free: np.ndarray) -> np.ndarray:
    """From the centre of each free pixel to that of the nearest blocked one."""
    blocked, pixels = np.argwhere(~free), np.argwhere(free)
    return np.sqrt(((pixels[:, None] - blocked) ** 2).sum(2)).min(1)


def test_small_maps_know_each_pixel() -> None:
    free = np.random.default_rng(0).random((30, 40)) > 0.02
    clearance = GridMap(free).clearance
    assert clearance.block == 1
    np.testing.assert_allclose(clearance.values[free], exact(free), rtol=0.02)
    assert (clearance.values[~free] == 0).all()


@pytest.mark.parametrize(("largest", "block"), [(32, 2), (16, 4), (7, 8), (2, 8)])
def test_large_maps_know_blocks_which_are_never_farther(
    monkeypatch: pytest.MonkeyPatch, largest: int, block: int
) -> None:
    monkeypatch.setattr(clearances, "_LARGEST_SIZE", largest)
    free = np.ones((45, 53), bool)
    free[20:22, 10:12] = free[44, 52] = False
    clearance = map_clearance(free)
    assert clearance.block == block
    rows, columns = np.nonzero(free)
    values = [clearance.at(u, v) for u, v in zip(columns.tolist(), rows.tolist(), strict=True)]
    assert (np.array(values) <= 1.02 * exact(free)).all()
    assert (np.array(values) >= 0.98 * exact(free) - 2 * np.sqrt(2) * block).all()
