"""The nodes of :mod:`.passages` for maps that are scaled down, from all of their pixels.

On a map that is scaled down, thin walls and narrow passages are lost. So the components of a patch
are found among the pixels of the full map that it covers, and linked there. A pixel of the scaled
map belongs to a node when any of its pixels does, so that it may belong to several.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..common.compilation import compiled
from .fast_marching import link_bits

# The nodes of each code of a patch of 4 x 4 pixels, found when they are first needed.
_NODES_OF, _IS_KNOWN = np.zeros((2**16, 4), np.int32), np.zeros(2**16, np.bool_)


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
    if shape == free.shape:
        codes = np.zeros((4, *patches), np.int32)
        _read_patches(free, codes, _NODES_OF, _IS_KNOWN)
        return codes, link_bits(codes[None])[0]
    rows, columns = _edges(free.shape, shape)
    nodes = np.zeros(free.shape, np.uint8)
    codes = np.zeros((4, *patches), np.int32)
    linked = np.zeros((4, *patches), np.uint16)
    _label(free, rows, columns, nodes, codes)
    _link(nodes, rows[:-1:4], columns[:-1:4], linked)
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
    rows, columns = _edges(free.shape, shape)
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
    return int((node * codes.shape[1] + row) * codes.shape[2] + column)


def _edges(full: tuple[int, ...], scaled: tuple[int, int]) -> list[NDArray[np.int64]]:
    """Return where the rows and columns of the scaled map begin in the full one, and its end."""
    return [np.append(np.arange(n) * size // n, size) for n, size in zip(scaled, full, strict=True)]


@compiled
def _read_patches(
    free: NDArray[np.bool_],
    codes: NDArray[np.int32],
    nodes_of: NDArray[np.int32],
    is_known: NDArray[np.bool_],
) -> None:  # pragma: no cover
    """Find the codes of the nodes of a map that is not scaled, in place.

    Args:
        free: (H, W), true where free.
        codes: (4, h, w), zeros.
        nodes_of: (65536, 4), the nodes of each code, as far as they are known; more are added.
        is_known: (65536,), of which codes they are.
    """
    height, width = free.shape
    block, nodes = np.zeros((4, 4), np.bool_), np.zeros((4, 4), np.uint8)
    labels, stack = np.empty(16, np.int32), np.empty(16, np.int64)
    for row in range(0, height, 4):
        for column in range(0, width, 4):
            code = 0
            for i in range(min(4, height - row)):
                for j in range(min(4, width - column)):
                    code |= free[row + i, column + j] << (4 * i + j)
            if not is_known[code]:
                for bit in range(16):
                    block[bit // 4, bit % 4] = (code >> bit) & 1
                _label_patch(block, labels, stack, nodes)
                for bit in range(16):
                    if nodes[bit // 4, bit % 4]:
                        nodes_of[code, nodes[bit // 4, bit % 4] - 1] |= 1 << bit
                is_known[code] = True
            for node in range(4):
                codes[node, row // 4, column // 4] = nodes_of[code, node]


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
    most = 16 * np.max(np.diff(row_edges)) * np.max(np.diff(column_edges))
    labels, stack = np.empty(most, np.int32), np.empty(most, np.int64)
    for row in range(0, height, 4):
        rows = row_edges[row : min(row + 4, height) + 1]
        for column in range(0, width, 4):
            columns = column_edges[column : min(column + 4, width) + 1]
            block = free[rows[0] : rows[-1], columns[0] : columns[-1]]
            own = nodes[rows[0] : rows[-1], columns[0] : columns[-1]]
            code = codes[:, row // 4, column // 4]
            count = _count(block)
            if count == block.size:
                own[:] = 1
            elif count > 0:
                _label_patch(block, labels, stack, own)
            if count > 0:
                _set_bits(own, rows, columns, count == block.size, code)


@compiled
def _count(block: NDArray[np.bool_]) -> int:  # pragma: no cover
    """Return the number of free pixels."""
    count = 0
    for row in range(block.shape[0]):
        for column in range(block.shape[1]):
            count += block[row, column]
    return count


@compiled
def _set_bits(
    nodes: NDArray[np.uint8],
    rows: NDArray[np.int64],
    columns: NDArray[np.int64],
    all_free: bool,
    code: NDArray[np.int32],
) -> None:  # pragma: no cover
    """Set the bits of the nodes of a patch.

    Args:
        nodes: of the pixels.
        rows: of the full map where the rows of the scaled one begin, and where the last ends.
        columns: the same.
        all_free: whether there is one node, of all pixels.
        code: of each node, changed in place.
    """
    for i in range(len(rows) - 1):
        for j in range(len(columns) - 1):
            bit = 1 << (4 * i + j)
            if all_free:
                code[0] |= bit
                continue
            for row in range(rows[i] - rows[0], rows[i + 1] - rows[0]):
                for column in range(columns[j] - columns[0], columns[j + 1] - columns[0]):
                    if nodes[row, column]:
                        code[nodes[row, column] - 1] |= bit


@compiled
def _label_patch(
    block: NDArray[np.bool_],
    labels: NDArray[np.int32],
    stack: NDArray[np.int64],
    nodes: NDArray[np.uint8],
) -> None:  # pragma: no cover
    """Find the nodes of the pixels of a patch, in place.

    Args:
        block: the pixels, true where free.
        labels: room for one number for each pixel.
        stack: the same.
        nodes: of the pixels, from 1; 0 where blocked or left out.
    """
    columns = block.shape[1]
    labels[: block.size] = 0
    # The largest components that can be passed through, then the others: by one key.
    keys = np.zeros(block.size + 1, np.int64)
    count = 0
    for first in range(block.size):
        if labels[first] == 0 and block[first // columns, first % columns]:
            count += 1
            size, contacts = _fill(block, first, count, labels, stack)
            keys[count] = size + (block.size if contacts > 1 else 0)
    node_of = np.zeros(count + 1, np.uint8)
    order = np.argsort(-keys[1 : count + 1], kind="mergesort") + 1
    for rank in range(count):
        is_merged = rank > 3 and keys[order[rank]] > block.size
        if rank < 4 or is_merged:
            node_of[order[rank]] = min(rank + 1, 4)
    for row in range(block.shape[0]):
        for column in range(columns):
            nodes[row, column] = node_of[labels[row * columns + column]]


@compiled
def _fill(
    block: NDArray[np.bool_],
    first: int,
    label: int,
    labels: NDArray[np.int32],
    stack: NDArray[np.int64],
) -> tuple[int, int]:  # pragma: no cover
    """Label the component of a pixel; return its size, and its contacts with the border."""
    rows, columns = block.shape
    labels[first], stack[0] = label, first
    waiting, size, contacts = 1, 0, 0
    while waiting:
        waiting -= 1
        row, column = stack[waiting] // columns, stack[waiting] % columns
        size += 1
        contacts += (row == 0) + (row == rows - 1) + (column == 0) + (column == columns - 1)
        for y, x in ((row - 1, column), (row + 1, column), (row, column - 1), (row, column + 1)):
            if not (0 <= y < rows and 0 <= x < columns) or not block[y, x]:
                continue
            if labels[y * columns + x] == 0:
                labels[y * columns + x] = label
                stack[waiting] = y * columns + x
                waiting += 1
    return size, contacts


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
    rows, columns = np.append(row_edges, height), np.append(column_edges, width)
    for row in range(len(row_edges)):
        for column in range(len(column_edges)):
            right, bottom = columns[column + 1], rows[row + 1]
            if right < width:
                for y in range(rows[row], bottom):
                    a, b = nodes[y, right - 1], nodes[y, right]
                    if a and b:
                        linked[a - 1, row, column] |= 1 << (3 + b)
                        linked[b - 1, row, column + 1] |= 1 << (a - 1)
            if bottom < height:
                for x in range(columns[column], right):
                    a, b = nodes[bottom - 1, x], nodes[bottom, x]
                    if a and b:
                        linked[a - 1, row, column] |= 1 << (11 + b)
                        linked[b - 1, row + 1, column] |= 1 << (7 + a)
