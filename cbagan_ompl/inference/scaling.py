"""Maps at the size that a network works at."""

from __future__ import annotations

from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from ..maps.blocks import any_in_blocks
from ..maps.grid_map import GridMap

# Small maps are enlarged by this factor at most: more shows the network nothing new, and the cost
# grows with its square.
_MAX_ENLARGEMENT = 2

# Every map with its free mask at the size that it was asked at last: a second task on the same map
# does not pay for it.
_scaled: WeakKeyDictionary[GridMap, NDArray[np.bool_]] = WeakKeyDictionary()


def scaled_shape(shape: tuple[int, int], longest: int) -> tuple[int, int]:
    """Return rows and columns of a map scaled to ``longest`` pixels on its longer side.

    Small maps are doubled at most.

    Example:
        >>> scaled_shape((512, 256), 256), scaled_shape((30, 20), 256)
        ((256, 128), (60, 40))
    """
    factor = min(longest / max(shape), _MAX_ENLARGEMENT)
    return max(1, round(factor * shape[0])), max(1, round(factor * shape[1]))


def scaled_map(grid: GridMap, shape: tuple[int, int]) -> NDArray[np.bool_]:
    """Return the free mask of a map at another size, see :func:`scaled_free`; it is kept.

    Args:
        grid: the map.
        shape: (h, w).
    """
    kept = _scaled.get(grid)
    if kept is None or kept.shape != shape:
        kept = _scaled[grid] = scaled_free(grid.free, shape)
    return kept


def scaled_free(free: NDArray[np.bool_], shape: tuple[int, int]) -> NDArray[np.bool_]:
    """Return a free mask at another size; a pixel is free when any pixel of its block is.

    When a map is scaled down, narrow passages survive, thin walls may not. That is the lesser harm:
    where the predicted region then crosses a wall, the obstacles of the full map cut it, but
    through a passage that the network cannot see it predicts no region.

    Args:
        free: (H, W), true where free.
        shape: (h, w).
    """
    if shape == free.shape:
        return free
    rows, columns = (np.arange(n) * size // n for n, size in zip(shape, free.shape, strict=True))
    return any_in_blocks(free, rows, columns)
