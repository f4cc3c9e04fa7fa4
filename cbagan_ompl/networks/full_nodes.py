"""The nodes of :mod:`.passages` for maps that are scaled down, from all of their pixels.

On a map that is scaled down, thin walls and narrow passages are lost. So the components of a patch
are found among the pixels of the full map that it covers, and linked there. A pixel of the scaled
map belongs to a node when any of its pixels does, so that it may belong to several.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..common.compilation import compiled


def full_nodes(
    free: NDArray[np.bool_], shape: tuple[int, int], patches: tuple[int, int]
) -> tuple[NDArray[np.int32], NDArray[np.uint16]]:
    """Return the nodes of all patches and their links.

    Args:
        free: (H, W), true where free.
        shape: (h, w) of the scaled map, at most (H, W).
        patches: rows and columns of patches of 4 x 4 pixels of the scaled map; those beyond it are
            blocked.

    Returns:
        Codes (4, rows, columns), as of :func:`.passages.patch_codes`, and the links of the same
        shape, as of :func:`.fast_marching.link_bits`.

    Example:
        >>> codes, linked = full_nodes(np.ones((16, 16), np.bool_), (8, 8), (2, 2))
        >>> codes[:, 0, 0].tolist(), linked[0].tolist()
        ([65535, 0, 0, 0], [[4112, 4097], [272, 257]])
    """
    edges = [
        np.append(np.arange(n) * size // n, size) for n, size in zip(shape, free.shape, strict=True)
    ]
    nodes = np.zeros(free.shape, np.uint8)
    codes = np.zeros((4, *patches), np.int32)
    linked = np.zeros((4, *patches), np.uint16)
    _label(free, edges[0], edges[1], nodes, codes)
    _link(nodes, edges[0][::4], edges[1][::4], linked)
    return codes, linked


def full_node_of(
    free: NDArray[np.bool_],
    shape: tuple[int, int],
    codes: NDArray[np.int32],
    pixel: tuple[int, int],
) -> int:
    """Return the index of the node that a pixel of the full map belongs to.

    Args:
        free: as for :func:`full_nodes`.
        shape: the same.
        codes: from :func:`full_nodes`.
        pixel: (column, row).

    Returns:
        The index into the codes, flattened, as of :func:`.passages.endpoint_nodes`.
    """
    rows, columns = (
        np.append(np.arange(n) * size // n, size) for n, size in zip(shape, free.shape, strict=True)
    )
    row = (int(np.searchsorted(rows, pixel[1], "right")) - 1) // 4
    column = (int(np.searchsorted(columns, pixel[0], "right")) - 1) // 4
    top, bottom = rows[4 * row], rows[min(4 * row + 4, shape[0])]
    left, right = columns[4 * column], columns[min(4 * column + 4, shape[1])]
    block = free[top:bottom, left:right]
    nodes = np.zeros(block.shape, np.uint8)
    own = np.zeros((4, 1, 1), np.int32)
    heights = rows[4 * row : 4 * row + 5] - top
    widths = columns[4 * column : 4 * column + 5] - left
    _label(np.ascontiguousarray(block), heights, widths, nodes, own)
    node = max(0, int(nodes[pixel[1] - top, pixel[0] - left]) - 1)
    return (node * codes.shape[1] + row) * codes.shape[2] + column


@compiled
def _label(
    free: NDArray[np.bool_],
    row_edges: NDArray[np.int64],
    column_edges: NDArray[np.int64],
    nodes: NDArray[np.uint8],
    codes: NDArray[np.int32],
) -> None:  # pragma: no cover
    """Find the node of each pixel, from 1, and the codes of the nodes, both in place."""
    height, width = len(row_edges) - 1, len(column_edges) - 1
    largest = 0
    for i in range(0, height, 4):
        for j in range(0, width, 4):
            rows = row_edges[min(i + 4, height)] - row_edges[i]
            columns = column_edges[min(j + 4, width)] - column_edges[j]
            largest = max(largest, rows * columns)
    stack = np.empty(largest, np.int64)
    labels = np.zeros(largest, np.int32)
    keys = np.zeros(largest + 1, np.int64)
    rank = np.zeros(largest + 1, np.uint8)
    for i in range(0, height, 4):
        for j in range(0, width, 4):
            top, bottom = row_edges[i], row_edges[min(i + 4, height)]
            left, right = column_edges[j], column_edges[min(j + 4, width)]
            block = free[top:bottom, left:right]
            count = 0
            for y in range(bottom - top):
                for x in range(right - left):
                    count += block[y, x]
            if count == 0:
                continue
            if count == block.size:
                nodes[top:bottom, left:right] = 1
            else:
                _rank(block, labels, stack, keys, rank)
                columns = right - left
                for y in range(bottom - top):
                    for x in range(columns):
                        if block[y, x]:
                            nodes[top + y, left + x] = rank[labels[y * columns + x]]
            for a in range(i, min(i + 4, height)):
                for b in range(j, min(j + 4, width)):
                    bit = 1 << (4 * (a - i) + b - j)
                    if count == block.size:
                        codes[0, i // 4, j // 4] |= bit
                        continue
                    for y in range(row_edges[a], row_edges[a + 1]):
                        for x in range(column_edges[b], column_edges[b + 1]):
                            if nodes[y, x]:
                                codes[nodes[y, x] - 1, i // 4, j // 4] |= bit


@compiled
def _rank(
    block: NDArray[np.bool_],
    labels: NDArray[np.int32],
    stack: NDArray[np.int64],
    keys: NDArray[np.int64],
    rank: NDArray[np.uint8],
) -> None:  # pragma: no cover
    """Label the components of a block, and find the node of each label, in place."""
    rows, columns = block.shape
    labels[: rows * columns] = 0
    count = 0
    through = rows * columns + 1
    for first in range(rows * columns):
        if labels[first] or not block[first // columns, first % columns]:
            continue
        count += 1
        labels[first] = count
        stack[0], waiting, size, contacts = first, 1, 0, 0
        while waiting:
            waiting -= 1
            pixel = stack[waiting]
            y, x = pixel // columns, pixel % columns
            size += 1
            contacts += (y == 0) + (y == rows - 1) + (x == 0) + (x == columns - 1)
            for direction in range(4):
                v = y + (direction == 0) - (direction == 1)
                u = x + (direction == 2) - (direction == 3)
                if 0 <= v < rows and 0 <= u < columns:
                    other = v * columns + u
                    if block[v, u] and not labels[other]:
                        labels[other] = count
                        stack[waiting] = other
                        waiting += 1
        keys[count] = size + (through if contacts > 1 else 0)
        rank[count] = 0
    for node in range(1, 5):
        best = 0
        for label in range(1, count + 1):
            if rank[label] == 0 and (best == 0 or keys[label] > keys[best]):
                best = label
        if best == 0:
            return
        rank[best] = node
        if node == 4 and keys[best] > through:
            for label in range(1, count + 1):
                if rank[label] == 0 and keys[label] > through:
                    rank[label] = 4


@compiled
def _link(
    nodes: NDArray[np.uint8],
    row_edges: NDArray[np.int64],
    column_edges: NDArray[np.int64],
    linked: NDArray[np.uint16],
) -> None:  # pragma: no cover
    """Find the links of the nodes, in place.

    Args:
        nodes: of each pixel.
        row_edges: the first row of each patch.
        column_edges: the first column of each patch.
        linked: as of :func:`.fast_marching.link_bits`.
    """
    height, width = nodes.shape
    for row in range(len(row_edges)):
        top = row_edges[row]
        bottom = row_edges[row + 1] if row + 1 < len(row_edges) else height
        for column in range(len(column_edges)):
            left = column_edges[column]
            right = column_edges[column + 1] if column + 1 < len(column_edges) else width
            if right < width:
                for y in range(top, bottom):
                    a, b = nodes[y, right - 1], nodes[y, right]
                    if a and b:
                        linked[a - 1, row, column] |= 1 << (3 + b)
                        linked[b - 1, row, column + 1] |= 1 << (a - 1)
            if bottom < height:
                for x in range(left, right):
                    a, b = nodes[bottom - 1, x], nodes[bottom, x]
                    if a and b:
                        linked[a - 1, row, column] |= 1 << (11 + b)
                        linked[b - 1, row + 1, column] |= 1 << (7 + a)
