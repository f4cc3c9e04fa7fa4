"""Heat maps of what a network paints: enlarged to a map, where there is something to enlarge."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..common.compilation import compiled
from ..maps.grid_map import GridMap
from .heatmap import Heatmap
from .painted_headings import PaintedHeatmap


def paint_heatmap(
    values: NDArray[np.float32],
    grid: GridMap,
    least: float,
    directions: NDArray[np.float32] | None = None,
    patches: tuple[float, float] = (1, 1),
) -> Heatmap | None:
    """Return the heat map of values at another size, by bilinear interpolation.

    A region of a few per cent of the pixels costs a few per cent of the time.

    Args:
        values: (h, w), in [0, 1].
        grid: the map.
        least: values below it, after the interpolation, become 0.
        directions: of travel, see :class:`.painted_headings.PaintedHeatmap`; None for no headings.
        patches: see there.

    Returns:
        None where all free pixels would be 0.

    Example:
        >>> grid = GridMap([[1, 1, 1, 0]])
        >>> paint_heatmap(np.array([[0.0, 1.0]], np.float32), grid, 0.1).values.tolist()
        [[0.0, 0.25, 0.75, 0.0]]
    """
    result = np.zeros(grid.shape, np.float32)
    # Pages of memory are used when they are first written to.
    support, found = np.empty(result.size + 1, np.intp), np.empty(result.size + 1, np.float32)
    smallest = np.float32(least)
    count = _paint(np.ascontiguousarray(values), grid.free, smallest, result, support, found)
    if not count:
        return None
    result.setflags(write=False)
    for array in support, found:
        array.resize(count, refcheck=False)  # in place, where a copy would take longer than these
    # All that Heatmap() would check is known: it reads every pixel.
    heatmap: Heatmap
    if directions is None:
        heatmap = Heatmap.__new__(Heatmap)
        heatmap.heading = None
    else:
        heatmap = painted = PaintedHeatmap.__new__(PaintedHeatmap)
        painted.directions, painted.patches, painted.painted = directions, patches, support
    heatmap.values, heatmap.grid = result, grid
    heatmap.guarantee = None
    heatmap.support, heatmap.support_values = support, found
    return heatmap


@compiled
def _paint(
    values: NDArray[np.float32],
    free: NDArray[np.bool_],
    least: np.float32,
    result: NDArray[np.float32],
    indices: NDArray[np.intp],
    found: NDArray[np.float32],
) -> int:  # pragma: no cover
    """Write the values of a heat map; return how many pixels have one.

    Args:
        values: (h, w).
        free: (H, W).
        least: smallest value that is written.
        result: (H, W), zeros.
        indices: becomes the flat indices of the pixels with a value, in order.
        found: becomes the values of these pixels.
    """
    rows, columns = values.shape
    height, width = free.shape
    # Of each column of the map, the column of the values to its left and the weight of the next.
    left, weights = _positions(width, columns)
    above, shares = _positions(height, rows)
    blend = np.empty(columns + 1, np.float32)
    count = 0
    for row in range(height):
        one, other, share = values[above[row]], values[min(above[row] + 1, rows - 1)], shares[row]
        first, last = columns, -1
        for column in range(columns):
            if max(one[column], other[column]) >= least:
                first, last = min(first, column), column
        if last < 0:
            continue
        for column in range(columns):
            blend[column] = one[column] + share * (other[column] - one[column])
        blend[columns] = blend[columns - 1]
        # What lies beside a value that is large enough is part of an interpolation with it.
        begin = np.searchsorted(left, first - 1)
        end = np.searchsorted(left, last + 1)
        target, is_free = result[row, begin:end], free[row, begin:end]
        here, weight = left[begin:end], weights[begin:end]
        for i in range(end - begin):
            start = blend[here[i]]
            value = start + weight[i] * (blend[here[i] + 1] - start)
            target[i] = value if is_free[i] and value >= least else np.float32(0)
        # Without a branch, which would be guessed wrong.
        number = row * width + begin
        for i in range(end - begin):
            indices[count], found[count] = number + i, target[i]
            count += target[i] > 0
    return count


@compiled
def _positions(
    size: int, source: int
) -> tuple[NDArray[np.int64], NDArray[np.float32]]:  # pragma: no cover
    """Return where the centres of ``size`` pixels lie among those of ``source`` pixels."""
    before = np.empty(size, np.int64)
    weights = np.empty(size, np.float32)
    for i in range(size):
        position = min(max((i + 0.5) * source / size - 0.5, 0.0), source - 1.0)
        before[i] = int(position)
        weights[i] = np.float32(position - before[i])
    return before, weights
