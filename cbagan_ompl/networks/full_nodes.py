"""The nodes of :mod:`.passages` for maps that are scaled down, from all of their pixels.

On a map that is scaled down, thin walls and narrow passages are lost. So the components of a patch
are found among the pixels of the full map that it covers, its block, and linked there. A pixel of
the scaled map belongs to a node when any of its pixels does, so that it may belong to several.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..common.bit_runs import pack_rows
from ..common.compilation import compiled
from .block_nodes import cut_block, label_block, make_room, read_column, read_row
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
    codes = np.zeros((4, *patches), np.int32)
    if shape == free.shape:
        _read_patches(free, codes, _NODES_OF, _IS_KNOWN)
        return codes, link_bits(codes[None])[0]
    linked = np.zeros((4, *patches), np.uint16)
    rows, columns = _edges(free.shape, shape)
    _read_blocks(pack_rows(free), rows, columns, codes, linked)
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
    # Of the scaled map: the last row, and column, that begins no later than the pixel.
    v, u = (((pixel[1 - i] + 1) * shape[i] - 1) // free.shape[i] for i in (0, 1))
    row, column = v // 4, u // 4
    own = codes[:, row, column].tolist()
    if not any(own[1:]):
        node = 0
    elif shape == free.shape:
        bits = [code >> (4 * (v % 4) + u % 4) & 1 for code in own]
        node = bits.index(max(bits))
    else:
        rows, columns = (
            edges[4 * i : 4 * i + 5]
            for edges, i in zip(_edges(free.shape, shape), (row, column), strict=True)
        )
        block = pack_rows(free[rows[0] : rows[-1], columns[0] : columns[-1]])
        offset = pixel[1] - int(rows[0]), pixel[0] - int(columns[0])
        node = max(0, _node_at(block, rows - rows[0], columns - columns[0], *offset) - 1)
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
    edges = np.arange(5)
    block = make_room(edges, edges)
    for row in range(0, height, 4):
        for column in range(0, width, 4):
            code = 0
            for i in range(min(4, height - row)):
                for j in range(min(4, width - column)):
                    code |= free[row + i, column + j] << (4 * i + j)
            if not is_known[code]:
                for i in range(4):
                    block.bits[i, 0] = (code >> (4 * i)) & 15
                label_block(block, edges, edges, nodes_of[code])
                is_known[code] = True
            for node in range(4):
                codes[node, row // 4, column // 4] = nodes_of[code, node]


@compiled
def _read_blocks(
    bits: NDArray[np.uint64],
    row_edges: NDArray[np.int64],
    column_edges: NDArray[np.int64],
    codes: NDArray[np.int32],
    linked: NDArray[np.uint16],
) -> None:  # pragma: no cover
    """Find the codes of the nodes, and their links, both in place.

    Args:
        bits: of the full map, see :func:`.bit_runs.pack_rows`.
        row_edges: where the rows of the scaled map begin in the full one, and its end.
        column_edges: the same for columns.
        codes: (4, rows, columns), zeros.
        linked: the same.
    """
    room = make_room(row_edges, column_edges)
    # The nodes of the pixels on both sides of where two blocks meet.
    before, left = np.zeros((2, row_edges[-1]), np.uint8)
    above, top = np.zeros((2, column_edges[-1]), np.uint8)
    for i in range(0, len(row_edges) - 1, 4):
        rows, row = row_edges[i : i + 5], i // 4
        lines = slice(rows[0], rows[-1])
        for j in range(0, len(column_edges) - 1, 4):
            columns, column = column_edges[j : j + 5], j // 4
            across = slice(columns[0], columns[-1])
            block = cut_block(room, bits, rows, columns)
            label_block(block, rows, columns, codes[:, row, column])
            if column > 0:
                read_column(block, 0, left[lines])
                here = linked[:, row, column]
                _link(before[lines], left[lines], linked[:, row, column - 1], here, 0)
            if row > 0:
                read_row(block, 0, top[across])
                here = linked[:, row, column]
                _link(above[across], top[across], linked[:, row - 1, column], here, 8)
            read_column(block, columns[-1] - columns[0] - 1, before[lines])
            read_row(block, rows[-1] - rows[0] - 1, above[across])


@compiled
def _link(
    first: NDArray[np.uint8],
    second: NDArray[np.uint8],
    before: NDArray[np.uint16],
    here: NDArray[np.uint16],
    axis: int,
) -> None:  # pragma: no cover
    """Link the nodes of two neighbouring blocks, in place.

    Args:
        first: the nodes of the pixels of the left, or upper, block where they meet.
        second: those of the other block.
        before: links of the nodes of the first block, see :func:`.fast_marching.link_bits`.
        here: those of the other block.
        axis: the first bit of its directions: 0 along rows, 8 along columns.
    """
    for place in range(len(first)):
        a, b = first[place], second[place]
        if a and b:
            before[a - 1] |= 1 << (axis + 3 + b)
            here[b - 1] |= 1 << (axis + a - 1)


@compiled
def _node_at(
    bits: NDArray[np.uint64],
    rows: NDArray[np.int64],
    columns: NDArray[np.int64],
    row: int,
    column: int,
) -> int:  # pragma: no cover
    """Return the node of a pixel of a map that is one block, from 1; 0 for none."""
    block = cut_block(make_room(rows, columns), bits, rows, columns)
    label_block(block, rows, columns, np.zeros(4, np.int32))
    nodes = np.zeros(columns[-1], np.uint8)
    read_row(block, row, nodes)
    return int(nodes[column])
