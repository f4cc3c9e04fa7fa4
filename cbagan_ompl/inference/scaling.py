"""Maps at the size that a network works at, and its output at the size of the map."""

from __future__ import annotations

from weakref import WeakKeyDictionary

import cv2
import numpy as np
from numpy.typing import NDArray

from ..maps.grid_map import GridMap

# Small maps are enlarged by this factor at most: more shows the network nothing new, and the cost
# grows with its square.
_MAX_ENLARGEMENT = 2

# Side of the blocks of an output of which only those with a region are enlarged, in pixels.
_BLOCK = 16

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
    return np.logical_or.reduceat(np.logical_or.reduceat(free, rows, axis=0), columns, axis=1)


def enlarged_values(
    values: NDArray[np.float32], shape: tuple[int, int], least: float
) -> NDArray[np.float32]:
    """Return values at the size of a map, by linear interpolation; those that are too small are 0.

    On maps that are a whole number of times as large, only blocks that hold a value that is large
    enough are interpolated: a region of a few per cent costs a few per cent of the pixels.

    Args:
        values: (h, w).
        shape: (H, W).
        least: values below it become 0.
    """
    factor, remainder = divmod(shape[0], values.shape[0])
    if remainder or factor < 2 or shape[1] != factor * values.shape[1]:
        return _enlarge(values, shape, least)
    result = np.zeros(shape, np.float32)
    # Beyond its border a block needs one more pixel, for the interpolation.
    padded = np.pad(values, 1, mode="edge")
    for top in range(0, values.shape[0], _BLOCK):
        for left in range(0, values.shape[1], _BLOCK):
            block = padded[top : top + _BLOCK + 2, left : left + _BLOCK + 2]
            if (block >= least).any():
                size = factor * block.shape[0], factor * block.shape[1]
                inside = _enlarge(block, size, least)[factor:-factor, factor:-factor]
                rows, columns = (slice(factor * n, factor * (n + _BLOCK)) for n in (top, left))
                result[rows, columns] = inside
    return result


def _enlarge(
    values: NDArray[np.float32], shape: tuple[int, int], least: float
) -> NDArray[np.float32]:
    resized = cv2.resize(values, shape[::-1], interpolation=cv2.INTER_LINEAR)
    enlarged = np.asarray(resized, np.float32)
    enlarged[enlarged < least] = 0
    return enlarged
