"""Connected parts of pixel masks; the connectivity, 4 or 8 neighbours, is always named.

Free space is 4-connected, because no motion passes between two obstacles that touch diagonally.
"""

from __future__ import annotations

from typing import Literal

import cv2
import numpy as np
from numpy.typing import NDArray

#: Neighbours of a pixel: those that share a side (4), or a side or a corner (8).
Connectivity = Literal[4, 8]


def label_components(mask: NDArray[np.bool_], *, connectivity: Connectivity) -> NDArray[np.int32]:
    """Label the connected parts of a mask with numbers.

    Args:
        mask: (H, W), true inside.
        connectivity: 4 or 8 neighbours.

    Returns:
        (H, W), the number of the part that each pixel belongs to, from 1; 0 outside the mask.

    Example:
        >>> label_components(np.eye(2, dtype=bool), connectivity=4).max()
        np.int32(2)
    """
    labels = cv2.connectedComponents(mask.astype(np.uint8), connectivity=connectivity)[1]
    return labels.astype(np.int32, copy=False)


def connects(
    mask: NDArray[np.bool_],
    start: tuple[int, int],
    goal: tuple[int, int],
    *,
    connectivity: Connectivity,
) -> bool:
    """Return whether one connected part of a mask holds both start and goal.

    Args:
        mask: (H, W), true inside; what is no free space must be false already.
        start: pixel (column, row). Start and goal count as part of the mask.
        goal: pixel (column, row).
        connectivity: 4 or 8 neighbours.

    Example:
        >>> connects(np.eye(2, dtype=bool), (0, 0), (1, 1), connectivity=8)
        True
    """
    both = mask.copy()
    both[start[1], start[0]] = both[goal[1], goal[0]] = True
    return in_one_component(both, start, goal, connectivity=connectivity)


def in_one_component(
    mask: NDArray[np.bool_],
    start: tuple[int, int],
    goal: tuple[int, int],
    *,
    connectivity: Connectivity,
) -> bool:
    """Return whether two pixels lie inside a mask and in one connected part of it.

    Args:
        mask: (H, W), true inside.
        start: pixel (column, row).
        goal: pixel (column, row).
        connectivity: 4 or 8 neighbours.

    Example:
        >>> in_one_component(np.array([[True, False, True]]), (0, 0), (2, 0), connectivity=8)
        False
    """
    if not (mask[start[1], start[0]] and mask[goal[1], goal[0]]):
        return False
    # To fill what the start is connected with takes a fraction of the time of labelling all parts.
    filled = mask.astype(np.uint8)
    cv2.floodFill(filled, None, start, 2, flags=connectivity)
    return bool(filled[goal[1], goal[0]] == 2)
