"""The components of the free pixels of a block of a map, as the nodes of :mod:`.passages`."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..common.bit_runs import WORD, cut_bits, find_runs, join_runs
from ..common.compilation import compiled


class Block(NamedTuple):
    """The pixels of a block as bits, and the runs of its free ones.

    Attributes:
        bits: see :func:`.bit_runs.pack_rows`.
        begins: of the runs, see :func:`.bit_runs.find_runs`.
        ends: the same.
        firsts: the same.
        roots: see :func:`.bit_runs.join_runs`.
        keys: by which components are ranked, at their first runs.
        codes: of the components, at their first runs.
        nodes: of the runs, from 1; 0 for those that belong to none.
    """

    bits: NDArray[np.uint64]
    begins: NDArray[np.int32]
    ends: NDArray[np.int32]
    firsts: NDArray[np.int32]
    roots: NDArray[np.int32]
    keys: NDArray[np.int32]
    codes: NDArray[np.int32]
    nodes: NDArray[np.uint8]


@compiled
def make_room(
    row_edges: NDArray[np.int64], column_edges: NDArray[np.int64]
) -> Block:  # pragma: no cover
    """Return room for the largest block of a map."""
    height, width = 4 * np.max(np.diff(row_edges)), 4 * np.max(np.diff(column_edges))
    bits = np.empty((height, (width + WORD - 1) // WORD), np.uint64)
    firsts = np.empty(height + 1, np.int32)
    # At most every second pixel begins a run.
    begins, ends, roots, keys, codes = np.empty((5, height * ((width + 1) // 2)), np.int32)
    return Block(bits, begins, ends, firsts, roots, keys, codes, keys.astype(np.uint8))


@compiled
def cut_block(
    room: Block,
    bits: NDArray[np.uint64],
    rows: NDArray[np.int64],
    columns: NDArray[np.int64],
) -> Block:  # pragma: no cover
    """Return a block of a map, in some of the room."""
    height, width = rows[-1] - rows[0], columns[-1] - columns[0]
    part = room.bits[:height, : (width + WORD - 1) // WORD]
    cut_bits(bits, rows[0], columns[0], columns[-1], part)
    _, begins, ends, firsts, roots, keys, codes, nodes = room
    return Block(part, begins, ends, firsts[: height + 1], roots, keys, codes, nodes)


@compiled
def label_block(
    block: Block, rows: NDArray[np.int64], columns: NDArray[np.int64], code: NDArray[np.int32]
) -> None:  # pragma: no cover
    """Find the nodes of the runs of a block.

    Args:
        block: with its bits; the rest is found.
        rows: of the full map where those of the scaled one begin, and where the last ends.
        columns: the same.
        code: of each node, zeros, changed in place.
    """
    count = find_runs(block.bits, block.begins, block.ends, block.firsts)
    if count == 0:
        return
    if _is_all_free(block, count, columns[-1] - columns[0]):
        block.nodes[:count] = 1
        for i in range(len(rows) - 1):
            code[0] |= ((1 << (len(columns) - 1)) - 1) << (4 * i)
        return
    join_runs(block.begins, block.ends, block.firsts, block.roots)
    size = (rows[-1] - rows[0]) * (columns[-1] - columns[0])
    _measure_components(block, rows, columns)
    # The largest components that can be passed through, then the others: by one key.
    for node in range(1, 5):
        best = -1
        for run in range(count):
            if block.nodes[run] == 0 and (best < 0 or block.keys[run] > block.keys[best]):
                best = run
        if best < 0 or block.keys[best] == 0:
            break
        block.nodes[best] = node
        code[node - 1] = block.codes[best]
    for run in range(count):
        root = block.roots[run]
        if block.nodes[root] == 0 and block.keys[root] > size:
            block.nodes[root] = 4
            code[3] |= block.codes[root]
        block.nodes[run] = block.nodes[root]


@compiled
def _is_all_free(block: Block, count: int, width: int) -> bool:  # pragma: no cover
    """Return whether the runs of a block are its rows."""
    if count != len(block.bits):
        return False
    length = 0
    for run in range(count):
        length += block.ends[run] - block.begins[run]
    return length == count * width


@compiled
def _measure_components(
    block: Block, rows: NDArray[np.int64], columns: NDArray[np.int64]
) -> None:  # pragma: no cover
    """Find the keys and the codes of the components of a block.

    A key is the number of pixels, with more than any for those that can be passed through: that
    touch the sides of the block in more than one place.
    """
    height, width = rows[-1] - rows[0], columns[-1] - columns[0]
    count = block.firsts[-1]
    contacts = block.nodes  # for the moment
    block.keys[:count] = 0
    block.codes[:count] = 0
    contacts[:count] = 0
    for i in range(len(rows) - 1):
        for row in range(rows[i] - rows[0], rows[i + 1] - rows[0]):
            sides = (row == 0) + (row == height - 1)
            for run in range(block.firsts[row], block.firsts[row + 1]):
                root, begin, end = block.roots[run], block.begins[run], block.ends[run]
                block.keys[root] += end - begin
                touching = sides * (end - begin) + (begin == 0) + (end == width)
                contacts[root] = min(contacts[root] + touching, 2)
                for j in range(len(columns) - 1):
                    if begin < columns[j + 1] - columns[0] and end > columns[j] - columns[0]:
                        block.codes[root] |= 1 << (4 * i + j)
    for run in range(count):
        if contacts[run] > 1:
            block.keys[run] += height * width
        contacts[run] = 0


@compiled
def read_column(block: Block, column: int, nodes: NDArray[np.uint8]) -> None:  # pragma: no cover
    """Find the nodes of the pixels in a column of a block; 0 for those of none."""
    for row in range(len(nodes)):
        nodes[row] = 0
        for run in range(block.firsts[row], block.firsts[row + 1]):
            if block.begins[run] <= column < block.ends[run]:
                nodes[row] = block.nodes[run]


@compiled
def read_row(block: Block, row: int, nodes: NDArray[np.uint8]) -> None:  # pragma: no cover
    """Find the nodes of the pixels in a row of a block; 0 for those of none."""
    nodes[:] = 0
    for run in range(block.firsts[row], block.firsts[row + 1]):
        nodes[block.begins[run] : block.ends[run]] = block.nodes[run]
