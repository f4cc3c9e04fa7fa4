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
    spans = np.zeros((grid.height, 2), np.intp)
    count = _paint(np.ascontiguousarray(values), grid.free, np.float32(least), result, spans)
    if not count:
        return None
    result.setflags(write=False)
    # With room for one more, which is written and then passed over.
    support, found = np.empty(count + 1, np.intp), np.empty(count + 1, np.float32)
    _collect(result, spans, support, found)
    support, found = support[:-1], found[:-1]
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
    spans: NDArray[np.intp],
) -> int:  # pragma: no cover
    """Write the values of a heat map; return how many pixels have one.

    Args:
        values: (h, w).
        free: (H, W).
        least: smallest value that is written.
        result: (H, W), zeros.
        spans: (H, 2), zeros; becomes the first column of each row that may have a value, and the
            one behind the last.
    """
    rows, columns = values.shape
    height, width = free.shape
    # Of each column of the map, the column of the values to its left and the weight of the next.
    left, weights, begins = _positions(width, columns)
    above, shares, _ = _positions(height, rows)
    extents = _find_extents(values, least)
    blend = np.zeros(columns + 1, np.float32)
    count = 0
    for row in range(height):
        upper, lower, share = above[row], min(above[row] + 1, rows - 1), shares[row]
        first = min(extents[upper, 0], extents[lower, 0])
        last = max(extents[upper, 1], extents[lower, 1])
        if last < 0:
            continue
        # What lies beside a value that is large enough is part of an interpolation with it.
        first = max(first - 1, 0)
        one, other = values[upper], values[lower]
        for column in range(columns):
            blend[column] = one[column] + share * (other[column] - one[column])
        blend[columns] = blend[columns - 1]
        begin, end = begins[first], begins[last + 1]
        target, is_free = result[row, begin:end], free[row, begin:end]
        here, weight = left[begin:end], weights[begin:end]
        for i in range(end - begin):
            start = blend[here[i]]
            value = start + weight[i] * (blend[here[i] + 1] - start)
            target[i] = value if is_free[i] & (value >= least) else np.float32(0)
        here_count = 0
        for i in range(end - begin):
            here_count += target[i] > 0
        count += here_count
        spans[row, 0], spans[row, 1] = begin, end
    return count


@compiled
def _collect(
    values: NDArray[np.float32],
    spans: NDArray[np.intp],
    support: NDArray[np.intp],
    found: NDArray[np.float32],
) -> None:  # pragma: no cover
    """Write the flat indices of the pixels with a value above 0, and the values, in order.

    Args:
        values: (H, W).
        spans: see :func:`_paint`.
        support: (K + 1,), for K pixels.
        found: the same.
    """
    count, width = np.uintp(0), values.shape[1]
    for row in range(len(values)):
        begin, end = spans[row]
        here, number = values[row, begin:end], row * width + begin
        for i in range(end - begin):
            # Without a branch, which would be guessed wrong.
            support[count], found[count] = number + i, here[i]
            count += np.uintp(here[i] > 0)


@compiled
def _find_extents(
    values: NDArray[np.float32], least: np.float32
) -> NDArray[np.int64]:  # pragma: no cover
    """Return the first and last column of each row with a value of at least ``least``, (h, 2).

    Of rows without one: the number of columns, and -1.
    """
    rows, columns = values.shape
    extents = np.empty((rows, 2), np.int64)
    for row in range(rows):
        here, first, last = values[row], np.int32(columns), np.int32(-1)
        for column in range(columns):  # without a branch: side by side
            number = np.int32(column)
            first = min(first, number if here[column] >= least else np.int32(columns))
            last = max(last, number if here[column] >= least else np.int32(-1))
        extents[row, 0], extents[row, 1] = first, last
    return extents


@compiled
def _positions(
    size: int, source: int
) -> tuple[NDArray[np.int64], NDArray[np.float32], NDArray[np.int64]]:  # pragma: no cover
    """Return where the centres of ``size`` pixels lie among those of ``source`` pixels.

    Returns:
        The pixel of the source before each centre and the weight of the next one, (size,); and for
        each pixel of the source, and the end, the first centre that is not before it.
    """
    before = np.empty(size, np.int64)
    weights = np.empty(size, np.float32)
    begins = np.empty(source + 1, np.int64)
    known = 0
    for i in range(size):
        position = min(max((i + 0.5) * source / size - 0.5, 0.0), source - 1.0)
        number = int(position)
        before[i], weights[i] = number, np.float32(position - number)
        while known <= number:
            begins[known] = i
            known += 1
    begins[known:] = size
    return before, weights, begins
