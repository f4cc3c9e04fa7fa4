"""Which tasks are for training and which for testing."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..common.validation import check_at_least
from ..errors import ConfigError

SPLITS = ("task", "map")


def is_test_task(
    split: str, originals: NDArray[np.int64], fraction: float, seed: int
) -> NDArray[np.bool_]:
    """Choose the tasks for testing.

    Args:
        split: ``task`` draws single tasks, as the paper does, so that the maps of the test tasks
            are in training too; ``map`` draws original maps with all their copies and tasks.
        originals: (N,), for each task the number of the original of its map: maps that are
            copies of one another, shifted or turned, have the same.
        fraction: share of the tasks, or of the originals, at least one of them.
        seed: the same seed gives the same choice.

    Returns:
        (N,), true for testing.

    Raises:
        ConfigError: an unknown split, a fraction that is none, a single original to split, or a
            negative seed.
    """
    if split not in SPLITS:
        raise ConfigError(f"a split is one of {', '.join(SPLITS)}, got {split!r}")
    if not 0 < fraction < 1:
        raise ConfigError(f"the share of test tasks is between 0 and 1, got {fraction}")
    check_at_least("seed", seed, 0)
    units = np.arange(len(originals)) if split == "task" else originals
    different = np.unique(units)
    if len(different) < 2:
        what = "task" if split == "task" else "original map"
        raise ConfigError(f"a split by {split} needs two {what}s, there is {len(different)}")
    count = min(max(1, round(fraction * len(different))), len(different) - 1)
    chosen = np.random.default_rng(seed).permutation(different)[:count]
    return np.isin(units, chosen)
