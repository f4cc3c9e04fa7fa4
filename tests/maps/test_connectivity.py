"""Connected parts of masks, with 4 and with 8 neighbours."""

from __future__ import annotations

from collections import deque

import numpy as np
import pytest
from numpy.typing import NDArray

from cbagan_ompl.maps.connectivity import Connectivity, connects, label_components


def mask(*rows: str) -> NDArray[np.bool_]:
    return np.array([[cell == "#" for cell in row] for row in rows])


def flood(free: NDArray[np.bool_], connectivity: int) -> NDArray[np.int32]:
    """Label as the module does, in plain Python."""
    steps = [(0, 1), (1, 0), (0, -1), (-1, 0)]
    if connectivity == 8:
        steps += [(1, 1), (1, -1), (-1, 1), (-1, -1)]
    labels = np.zeros(free.shape, np.int32)
    for first in zip(*np.nonzero(free), strict=True):
        if labels[first]:
            continue
        labels[first] = labels.max() + 1
        queue = deque([first])
        while queue:
            row, column = queue.popleft()
            for i, j in steps:
                cell = row + i, column + j
                inside = 0 <= cell[0] < free.shape[0] and 0 <= cell[1] < free.shape[1]
                if inside and free[cell] and not labels[cell]:
                    labels[cell] = labels[row, column]
                    queue.append(cell)
    return labels


@pytest.mark.parametrize("connectivity", [4, 8])
@pytest.mark.parametrize("seed", range(20))
def test_parts_are_those_of_a_flood(connectivity: Connectivity, seed: int) -> None:
    rng = np.random.default_rng(seed)
    free = rng.random(rng.integers(1, 14, 2)) < rng.uniform(0.2, 0.8)
    labels, flooded = label_components(free, connectivity=connectivity), flood(free, connectivity)
    assert labels.dtype == np.int32
    # The same parts, whatever their numbers.
    pairs = set(zip(labels.ravel().tolist(), flooded.ravel().tolist(), strict=True))
    assert len(pairs) == len(np.unique(labels)) == len(np.unique(flooded))
    assert sorted({label for label, _ in pairs} - {0}) == list(range(1, labels.max() + 1))
    np.testing.assert_array_equal(labels > 0, free)


def test_diagonals_tell_the_two_apart() -> None:
    diagonal = mask("#..", ".#.", "..#")
    assert connects(diagonal, (0, 0), (2, 2), connectivity=8)
    assert not connects(diagonal, (0, 0), (2, 2), connectivity=4)
    assert label_components(diagonal, connectivity=4).max() == 3
    assert label_components(diagonal, connectivity=8).max() == 1


@pytest.mark.parametrize("connectivity", [4, 8])
def test_pixels_are_columns_and_rows(connectivity: Connectivity) -> None:
    row = mask("....", "....", "####")
    assert connects(row, (0, 2), (3, 2), connectivity=connectivity)
    assert not connects(row, (0, 0), (3, 0), connectivity=connectivity)


@pytest.mark.parametrize("connectivity", [4, 8])
def test_start_and_goal_count_as_part_of_the_mask(connectivity: Connectivity) -> None:
    gap = mask(".##.")
    assert connects(gap, (0, 0), (3, 0), connectivity=connectivity)
    assert gap.tolist() == [[False, True, True, False]], "the mask stays as it is"
    assert connects(mask("..."), (1, 0), (1, 0), connectivity=connectivity)
    assert not connects(mask("..."), (0, 0), (2, 0), connectivity=connectivity)


@pytest.mark.parametrize("connectivity", [4, 8])
def test_empty_and_full_masks(connectivity: Connectivity) -> None:
    assert not label_components(np.zeros((3, 4), bool), connectivity=connectivity).any()
    assert (label_components(np.ones((3, 4), bool), connectivity=connectivity) == 1).all()


def test_views_that_are_not_contiguous() -> None:
    free = mask("#.#.", "....", "#.#.")[::2, ::2]
    np.testing.assert_array_equal(label_components(free, connectivity=4), [[1, 1], [1, 1]])
