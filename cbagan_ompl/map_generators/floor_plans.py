"""Map generators of floor plans at every scale: cells, offices, shelves, halls.

The dimensions in :mod:`.buildings` follow the size of the map. Here every map samples its own:
walls from one pixel, rooms of 8 to 60 pixels, passages of 2 to 20.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from math import pi

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import depth_first_order, minimum_spanning_tree

from .shapes import Mask, box, ellipse, empty_map, fill_pockets, sample_scale


def cell_maze(rng: np.random.Generator, width: int, height: int) -> Mask:
    """Generate a maze of long winding passages or short dead ends, with or without loops.

    Arguments and result as for every generator, see :mod:`cbagan_ompl.map_generators`.
    """
    pitch = sample_scale(rng, 4, min(width, height) / 4)
    wall = int(rng.integers(1, max(2, round(0.45 * pitch))))
    loops = 0.0 if rng.random() < 0.5 else rng.uniform(0.02, 0.3)
    return generate_cells(rng, width, height, pitch, wall, pitch, loops, winding=rng.random() < 0.6)


def room_grid(rng: np.random.Generator, width: int, height: int) -> Mask:
    """Generate rooms of one size side by side, with doors between most of them.

    Arguments and result as for every generator, see :mod:`cbagan_ompl.map_generators`.
    """
    pitch = sample_scale(rng, 10, min(width, height) / 2.5)
    wall = int(rng.integers(1, max(2, pitch // 5)))
    door = int(rng.integers(2, max(3, pitch // 3)))
    return generate_cells(
        rng, width, height, pitch, wall, door, rng.uniform(0.1, 0.9), winding=False
    )


def offices(rng: np.random.Generator, width: int, height: int) -> Mask:
    """Generate rooms of many sizes and corridors by recursive splitting.

    Arguments and result as for every generator, see :mod:`cbagan_ompl.map_generators`.
    """
    free = empty_map(width, height)
    wall = int(rng.integers(1, 5))
    door = int(rng.integers(max(2, wall), 11))
    smallest = int(rng.integers(door + 3, max(door + 4, min(width, height) // 3)))
    corridors = rng.uniform(0, 0.5)
    undivided = [(slice(0, height), slice(0, width))]
    while undivided:
        undivided += _divide(free, undivided.pop(), rng, wall, door, smallest, corridors)
    if free.all():  # a single room
        return offices(rng, width, height)
    _furnish(free, rng, rng.uniform(0, 0.06))
    return fill_pockets(free)


def shelves(rng: np.random.Generator, width: int, height: int) -> Mask:
    """Generate one or many rows of shelves, with aisles along and across.

    Arguments and result as for every generator, see :mod:`cbagan_ompl.map_generators`.
    """
    free = empty_map(width, height)
    room = free.T if rng.random() < 0.5 else free
    thick, aisle = int(rng.integers(1, 9)), int(rng.integers(2, 13))
    long, cross = int(rng.integers(8, 61)), int(rng.integers(2, 13))
    margin = int(rng.integers(0, max(1, min(width, height) // 5)))
    missing = rng.choice((0.0, 0.1))
    for top in range(margin + aisle, room.shape[0] - thick - margin, thick + aisle):
        for left in range(margin + cross, room.shape[1] - margin - 4, long + cross):
            if rng.random() >= missing:
                room[top : top + thick, left : left + long] = False
    if free.all():  # no shelf fits in, or all are missing
        return shelves(rng, width, height)
    return fill_pockets(free)


def halls(rng: np.random.Generator, width: int, height: int) -> Mask:
    """Generate halls in solid ground, connected by passages in a tree with a few loops.

    Arguments and result as for every generator, see :mod:`cbagan_ompl.map_generators`.
    """
    free = ~empty_map(width, height)
    count = int(rng.integers(4, 15))
    centres = rng.uniform((0.1, 0.1), (0.9, 0.9), (count, 2)) * (width, height)
    largest = 0.9 * min(width, height) / np.sqrt(count)
    for x, y in centres.tolist():
        half = rng.uniform(0.2, 0.6, 2) * largest
        shape = box if rng.random() < 0.7 else ellipse
        angle = 0.0 if rng.random() < 0.6 else rng.uniform(0, pi)
        free |= shape(free, (x, y), (half[0], half[1]), angle)
    distances = np.linalg.norm(centres[:, None] - centres, axis=-1)
    passage = int(rng.integers(2, 13))
    for i, j in _choose_passages(rng, distances, 0.1):
        _dig_passage(free, centres[i], centres[j], passage, rng.random() < 0.5)
    return fill_pockets(free)


def generate_cells(
    rng: np.random.Generator,
    width: int,
    height: int,
    pitch: int,
    wall: int,
    door: int,
    loops: float,
    winding: bool,
) -> Mask:
    """Generate cells in rows and columns, with doors along a spanning tree and some more.

    Args:
        rng: source of all random numbers.
        width: of the map.
        height: of the map.
        pitch: from one cell to the next, in pixels.
        wall: thickness of the walls in pixels.
        door: width of the doors in pixels; at most the width of the cell.
        loops: fraction of the other walls that have a door too.
        winding: build the tree depth first, with long passages and few junctions.
    """
    free = ~empty_map(width, height)
    columns, rows = max(2, width // pitch), max(2, height // pitch)
    x = np.rint(np.linspace(0, width - wall, columns + 1)).astype(int)
    y = np.rint(np.linspace(0, height - wall, rows + 1)).astype(int)
    for top, bottom in zip(y[:-1] + wall, y[1:], strict=True):
        for left, right in zip(x[:-1] + wall, x[1:], strict=True):
            free[top:bottom, left:right] = True
    for a, b in _choose_doors(rng, columns, rows, loops, winding):
        (row, column), (next_row, next_column) = divmod(a, columns), divmod(b, columns)
        if row == next_row:
            low, high = _sample_doorway(rng, y[row] + wall, y[row + 1], door)
            free[low:high, x[next_column] : x[next_column] + wall] = True
        else:
            low, high = _sample_doorway(rng, x[column] + wall, x[column + 1], door)
            free[y[next_row] : y[next_row] + wall, low:high] = True
    return fill_pockets(free)


def _sample_doorway(rng: np.random.Generator, low: int, high: int, door: int) -> tuple[int, int]:
    """Return the first pixel of a door in a wall, and the one behind its last."""
    if door >= high - low:
        return low, high
    first = int(rng.integers(low, high - door + 1))
    return first, first + door


def _choose_doors(
    rng: np.random.Generator, columns: int, rows: int, loops: float, winding: bool
) -> Iterator[tuple[int, int]]:
    """Yield the pairs of neighbouring cells with a door between them, smaller number first."""
    cells = np.arange(rows * columns).reshape(rows, columns)
    pairs = np.concatenate(
        (
            np.stack((cells[:, :-1], cells[:, 1:]), axis=-1).reshape(-1, 2),
            np.stack((cells[:-1], cells[1:]), axis=-1).reshape(-1, 2),
        )
    )
    # The search follows neighbours in the order of their numbers, so these are shuffled.
    number = rng.permutation(cells.size)
    weights = 1 + rng.random(len(pairs))
    # 32 bits, because older versions of SciPy search graphs of such indices alone.
    indices = number[pairs].T.astype(np.int32)
    graph = csr_array((weights, indices), shape=(cells.size, cells.size))
    if winding:
        first = int(rng.integers(cells.size))
        order, predecessor = depth_first_order(graph, first, directed=False)
        tree = np.stack((order[1:], predecessor[order[1:]]), axis=-1)
    else:
        tree = np.stack(minimum_spanning_tree(graph).nonzero(), axis=-1)
    extra = pairs[rng.random(len(pairs)) < loops]
    connected = np.argsort(number)[tree]
    for a, b in np.concatenate((connected, extra)).tolist():
        yield min(a, b), max(a, b)


def _choose_passages(
    rng: np.random.Generator, distances: NDArray[np.float64], loops: float
) -> list[tuple[int, int]]:
    """Return the edges of the minimum spanning tree, and a fraction of all others."""
    tree = minimum_spanning_tree(csr_array(distances)).toarray() > 0
    extra = np.triu(rng.random(distances.shape) < loops, 1)
    return [(int(i), int(j)) for i, j in np.argwhere(tree | extra)]


def _dig_passage(
    free: Mask, start: NDArray[np.float64], end: NDArray[np.float64], width: int, straight: bool
) -> None:
    """Dig a passage between two points, straight or with one right angle."""
    corners = [start, end] if straight else [start, np.array((end[0], start[1])), end]
    for a, b in pairwise(corners):
        middle, reach = (a + b) / 2, b - a
        half = float(np.hypot(*reach)) / 2 + width / 2, width / 2
        free |= box(free, (middle[0], middle[1]), half, float(np.arctan2(reach[1], reach[0])))


def _divide(
    free: Mask,
    room: tuple[slice, slice],
    rng: np.random.Generator,
    wall: int,
    door: int,
    smallest: int,
    corridors: float,
) -> list[tuple[slice, slice]]:
    """Put a wall, or the two walls of a corridor, across a room; return the new rooms."""
    across = room[0].stop - room[0].start > room[1].stop - room[1].start
    view = free.T if across else free
    rows, columns = (room[1], room[0]) if across else room
    width = columns.stop - columns.start
    if width < 2 * (smallest + wall) or (width < 4 * smallest and rng.random() < 0.2):
        return []
    gap = int(rng.integers(door, 2 * door + 1)) if rng.random() < corridors else 0
    if width < 2 * (smallest + wall) + gap:
        gap = 0
    left = columns.start + int(rng.integers(smallest, width - smallest - 2 * wall - gap + 1))
    walls = [left] if not gap else [left, left + wall + gap]
    for x in walls:
        if _blocks_door(view, rows, x, wall):
            return []
    for x in walls:
        view[rows, x : x + wall] = False
        for _ in range(1 + int(rng.random() < 0.3)):
            low, high = _sample_doorway(rng, rows.start + 1, rows.stop - 1, door)
            view[low:high, x : x + wall] = True
    halves = slice(columns.start, left), slice(walls[-1] + wall, columns.stop)
    return [(half, rows) if across else (rows, half) for half in halves]


def _blocks_door(view: Mask, rows: slice, x: int, wall: int) -> bool:
    """Return whether a wall would end at a door."""
    above = view[rows.start - 1, x : x + wall].any() if rows.start else False
    below = view[rows.stop, x : x + wall].any() if rows.stop < len(view) else False
    return bool(above or below)


def _furnish(free: Mask, rng: np.random.Generator, fraction: float) -> None:
    """Put small boxes on a fraction of the floor."""
    height, width = free.shape
    target = (~free).mean() + fraction
    while (~free).mean() < target:
        half = rng.uniform(1, 4), rng.uniform(1, 4)
        free &= ~box(free, (rng.uniform(0, width), rng.uniform(0, height)), half)
