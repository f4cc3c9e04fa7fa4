"""Masks as bits, and the runs of true values in their rows: a sixty-fourth of the steps.

Runs of neighbouring rows that overlap are joined by a union-find over runs: L. He, Y. Chao and
K. Suzuki, "A run-based two-scan labeling algorithm", IEEE Transactions on Image Processing 17(5),
2008, https://doi.org/10.1109/TIP.2008.919369.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .compilation import compiled

#: Bits of a word.
WORD = 64

_ONE = np.uint64(1)
_LAST = np.uint64(WORD - 1)

# The place of the one bit of a word that is set, by a perfect hash of the word: C. E. Leiserson,
# H. Prokop and K. H. Randall, "Using de Bruijn sequences to index a 1 in a computer word", 1998.
_SEQUENCE, _SHIFT = 0x03F79D71B4CB0A89, np.uint64(58)
_HASH = np.uint64(_SEQUENCE)
_PLACES = np.zeros(WORD, np.int64)
for _place in range(WORD):
    _PLACES[((_SEQUENCE << _place) & (2**WORD - 1)) >> 58] = _place


def pack_rows(mask: NDArray[np.bool_]) -> NDArray[np.uint64]:
    """Return a mask as bits.

    Args:
        mask: (H, W).

    Returns:
        (H, ceil(W / 64)): the lowest bit of a word is the leftmost pixel; 0 beyond the last one.

    Example:
        >>> pack_rows(np.array([[True, False, True]])).tolist()
        [[5]]
    """
    height, width = mask.shape
    packed = np.packbits(mask, axis=1, bitorder="little")
    words = -(-width // WORD)
    if packed.shape[1] < 8 * words:
        packed = np.pad(packed, ((0, 0), (0, 8 * words - packed.shape[1])))
    return packed.view("<u8").reshape(height, words)


@compiled
def lowest_bit(word: np.uint64) -> int:  # pragma: no cover
    """Return the place of the lowest bit of a word that is set; the word is not 0."""
    return int(_PLACES[((word & (~word + _ONE)) * _HASH) >> _SHIFT])


@compiled
def cut_bits(
    bits: NDArray[np.uint64], row: int, begin: int, end: int, part: NDArray[np.uint64]
) -> None:  # pragma: no cover
    """Copy some columns of some rows of a mask.

    Args:
        bits: of the mask, see :func:`pack_rows`.
        row: the first one.
        begin: the first column.
        end: the column behind the last.
        part: becomes their bits, (rows, ceil((end - begin) / 64)).
    """
    for place in range(part.shape[1]):
        column = begin + WORD * place
        source, shift = column // WORD, np.uint64(column % WORD)
        is_split = shift > 0 and source + 1 < bits.shape[1]
        mask = ~np.uint64(0)
        if end - column < WORD:
            mask = (_ONE << np.uint64(end - column)) - _ONE
        for i in range(len(part)):
            word = bits[row + i, source] >> shift
            if is_split:
                word |= bits[row + i, source + 1] << (np.uint64(WORD) - shift)
            part[i, place] = word & mask


@compiled
def find_runs(
    bits: NDArray[np.uint64],
    begins: NDArray[np.int32],
    ends: NDArray[np.int32],
    firsts: NDArray[np.int32],
) -> int:  # pragma: no cover
    """Find the runs of true values in the rows of a mask.

    Args:
        bits: of the mask, see :func:`pack_rows`, H rows.
        begins: becomes the first column of each run, row by row; with room for all.
        ends: becomes the column behind each run.
        firsts: (H + 1,), becomes the number of runs above each row, and of all.

    Returns:
        Their number.
    """
    count = 0
    for row in range(len(bits)):
        firsts[row] = count
        before, is_inside = np.uint64(0), False
        for place in range(bits.shape[1]):
            word = bits[row, place]
            changes = word ^ ((word << _ONE) | before)
            before = word >> _LAST
            while changes:
                column = WORD * place + lowest_bit(changes)
                changes &= changes - _ONE
                if is_inside:
                    ends[count] = column
                    count += 1
                else:
                    begins[count] = column
                is_inside = not is_inside
        if is_inside:
            ends[count] = WORD * bits.shape[1]
            count += 1
    firsts[len(bits)] = count
    return count


@compiled
def join_runs(
    begins: NDArray[np.int32],
    ends: NDArray[np.int32],
    firsts: NDArray[np.int32],
    roots: NDArray[np.int32],
) -> None:  # pragma: no cover
    """Find the 4-connected components of runs.

    Args:
        begins: see :func:`find_runs`.
        ends: the same.
        firsts: the same.
        roots: becomes the first run of the component of each run.
    """
    for row in range(len(firsts) - 1):
        above, last = firsts[max(row - 1, 0)], firsts[row]
        for run in range(firsts[row], firsts[row + 1]):
            roots[run] = run
            while above < last and ends[above] <= begins[run]:
                above += 1
            other = above
            while other < last and begins[other] < ends[run]:
                one, two = _find_root(roots, run), _find_root(roots, other)
                roots[max(one, two)] = min(one, two)
                other += 1
    for run in range(firsts[-1]):
        roots[run] = roots[roots[run]]  # the root of an earlier run is known


@compiled
def _find_root(roots: NDArray[np.int32], run: int) -> int:  # pragma: no cover
    while roots[run] != run:
        roots[run] = roots[roots[run]]
        run = roots[run]
    return run
