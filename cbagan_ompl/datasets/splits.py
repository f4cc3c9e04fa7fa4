"""Splits of tasks into those for training and those for testing."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..common.validation import finite_number, whole_number
from ..errors import ConfigError, show

#: Kinds of splits, see :func:`select_test_tasks`.
SPLITS = ("task", "map")


def select_test_tasks(
    split: str, originals: NDArray[np.int64], fraction: float, seed: int
) -> NDArray[np.bool_]:
    """Select the tasks for testing at random.

    Args:
        split: ``task`` selects single tasks, as the CBAGAN-RRT paper does, so that the maps of the
            test tasks are in training too; ``map`` selects original maps with all their copies and
            tasks.
        originals: (N,), for each task the number of the original of its map: maps that are
            augmented copies of one original have the same number.
        fraction: of the tasks, or of the original maps; at least one of them is selected.
        seed: the same seed gives the same selection.

    Returns:
        (N,), true for testing.

    Raises:
        ConfigError: an unknown split, a fraction that is not between 0 and 1, a single task or
            original map, or a negative seed.

    Example:
        >>> select_test_tasks("map", np.array([0, 0, 1, 1]), 0.5, seed=0).sum()
        np.int64(2)
    """
    if split not in SPLITS:
        raise ConfigError(f"a split is one of {', '.join(SPLITS)}, got {show(split)}")
    if not 0 < finite_number("test_fraction", fraction, 0) < 1:
        raise ConfigError(f"the fraction of test tasks is between 0 and 1, got {fraction}")
    whole_number("seed", seed, 0)
    units = np.arange(len(originals)) if split == "task" else originals
    different = np.unique(units)
    if len(different) < 2:
        what = "task" if split == "task" else "original map"
        raise ConfigError(f"a split by {split} needs two {what}s, there is {len(different)}")
    count = min(max(1, round(fraction * len(different))), len(different) - 1)
    selected = np.random.default_rng(seed).permutation(different)[:count]
    return np.isin(units, selected)
