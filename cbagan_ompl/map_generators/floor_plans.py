"""Families of floor plans of every scale: cells, offices, shelves, halls; walls from one pixel up.

Unlike those of :mod:`.buildings`, whose measures follow the side of the map, each of these maps
draws its own: rooms of eight pixels and rooms of sixty, ways of two and of twenty.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from math import pi

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import depth_first_order, minimum_spanning_tree

from .shapes import Mask, box, ellipse, empty_map, scale_of, without_pockets


def cell_maze(rng: np.random.Generator, width: int, height: int) -> Mask:
    """A maze: long winding ways or short dead ends, with some walls taken out or none."""
    pitch = scale_of(rng, 4, min(width, height) / 4)
    wall = int(rng.integers(1, max(2, round(0.45 * pitch))))
    loops = 0.0 if rng.random() < 0.5 else rng.uniform(0.02, 0.3)
    return _cells(rng, width, height, pitch, wall, pitch, loops, winding=rng.random() < 0.6)


def room_grid(rng: np.random.Generator, width: int, height: int) -> Mask:
    """Rooms of one size side by side, doors between most of them."""
    pitch = scale_of(rng, 10, min(width, height) / 2.5)
    wall = int(rng.integers(1, max(2, pitch // 5)))
    door = int(rng.integers(2, max(3, pitch // 3)))
    return _cells(rng, width, height, pitch, wall, door, rng.uniform(0.1, 0.9), winding=False)


def offices(rng: np.random.Generator, width: int, height: int) -> Mask:
    """Rooms of many sizes by recursive splitting, some splits being corridors."""
    free = empty_map(width, height)
    wall = int(rng.integers(1, 5))
    door = int(rng.integers(max(2, wall), 11))
    smallest = int(rng.integers(door + 3, max(door + 4, min(width, height) // 3)))
    corridors = rng.uniform(0, 0.5)
    waiting = [(slice(0, height), slice(0, width))]
    while waiting:
        place = waiting.pop()
        waiting += _divide(free, place, rng, wall, door, smallest, corridors)
    if free.all():  # a single room
        return offices(rng, width, height)
    _furnish(free, rng, rng.uniform(0, 0.06))
    return without_pockets(free)


def shelves(rng: np.random.Generator, width: int, height: int) -> Mask:
    """Blocks of shelves with aisles along and across, one row of them or many."""
    free = empty_map(width, height)
    turned = rng.random() < 0.5
    room = free.T if turned else free
    thick, aisle = int(rng.integers(1, 9)), int(rng.integers(2, 13))
    long, cross = int(rng.integers(8, 61)), int(rng.integers(2, 13))
    margin = int(rng.integers(0, max(1, min(width, height) // 5)))
    missing = rng.choice((0.0, 0.1))
    for top in range(margin + aisle, room.shape[0] - thick - margin, thick + aisle):
        for left in range(margin + cross, room.shape[1] - margin - 4, long + cross):
            if rng.random() >= missing:
                room[top : top + thick, left : left + long] = False
    if free.all():  # no shelf has found room, or all are missing
        return shelves(rng, width, height)
    return without_pockets(free)


def halls(rng: np.random.Generator, width: int, height: int) -> Mask:
    """Halls in solid ground, joined by passages to a tree with a few loops."""
    free = ~empty_map(width, height)
    count = int(rng.integers(4, 15))
    middles = rng.uniform((0.1, 0.1), (0.9, 0.9), (count, 2)) * (width, height)
    largest = 0.9 * min(width, height) / np.sqrt(count)
    for x, y in middles.tolist():
        half = rng.uniform(0.2, 0.6, 2) * largest
        shape = box if rng.random() < 0.7 else ellipse
        angle = 0.0 if rng.random() < 0.6 else rng.uniform(0, pi)
        free |= shape(free, (x, y), (half[0], half[1]), angle)
    distances = np.linalg.norm(middles[:, None] - middles, axis=-1)
    thin = int(rng.integers(2, 13))
    for i, j in _tree_with_loops(rng, distances, 0.1):
        _join(free, middles[i], middles[j], thin, rng.random() < 0.5)
    return without_pockets(free)


def _cells(
    rng: np.random.Generator,
    width: int,
    height: int,
    pitch: int,
    wall: int,
    door: int,
    loops: float,
    winding: bool,
) -> Mask:
    """Cells in rows and columns, doors in the walls of a spanning tree and of some more.

    Args:
        rng: draws all.
        width: of the map.
        height: of the map.
        pitch: from one cell to the next, in pixels.
        wall: thickness.
        door: width of the doors; as wide as the cell where it has no room for them.
        loops: share of the other walls that have a door too.
        winding: the tree is made depth first, with long ways and few junctions.
    """
    free = ~empty_map(width, height)
    columns, rows = max(2, width // pitch), max(2, height // pitch)
    x = np.rint(np.linspace(0, width - wall, columns + 1)).astype(int)
    y = np.rint(np.linspace(0, height - wall, rows + 1)).astype(int)
    for top, bottom in zip(y[:-1] + wall, y[1:], strict=True):
        for left, right in zip(x[:-1] + wall, x[1:], strict=True):
            free[top:bottom, left:right] = True
    for a, b in _opened(rng, columns, rows, loops, winding):
        (row, column), (next_row, next_column) = divmod(a, columns), divmod(b, columns)
        if row == next_row:
            low, high = _doorway(rng, y[row] + wall, y[row + 1], door)
            free[low:high, x[next_column] : x[next_column] + wall] = True
        else:
            low, high = _doorway(rng, x[column] + wall, x[column + 1], door)
            free[y[next_row] : y[next_row] + wall, low:high] = True
    return without_pockets(free)


def _doorway(rng: np.random.Generator, low: int, high: int, door: int) -> tuple[int, int]:
    if door >= high - low:
        return low, high
    first = int(rng.integers(low, high - door + 1))
    return first, first + door


def _opened(
    rng: np.random.Generator, columns: int, rows: int, loops: float, winding: bool
) -> Iterator[tuple[int, int]]:
    """The pairs of neighbouring cells with a way between them, the smaller number first."""
    cells = np.arange(rows * columns).reshape(rows, columns)
    pairs = np.concatenate(
        (
            np.stack((cells[:, :-1], cells[:, 1:]), axis=-1).reshape(-1, 2),
            np.stack((cells[:-1], cells[1:]), axis=-1).reshape(-1, 2),
        )
    )
    # Numbered at random, since the search follows neighbours in the order of their numbers.
    name = rng.permutation(cells.size)
    weights = 1 + rng.random(len(pairs))
    graph = csr_array((weights, name[pairs].T), shape=(cells.size, cells.size))
    if winding:
        first = int(rng.integers(cells.size))
        order, before = depth_first_order(graph, first, directed=False)
        tree = np.stack((order[1:], before[order[1:]]), axis=-1)
    else:
        tree = np.stack(minimum_spanning_tree(graph).nonzero(), axis=-1)
    more = pairs[rng.random(len(pairs)) < loops]
    known = np.argsort(name)[tree]
    for a, b in np.concatenate((known, more)).tolist():
        yield min(a, b), max(a, b)


def _tree_with_loops(
    rng: np.random.Generator, distances: NDArray[np.float64], loops: float
) -> list[tuple[int, int]]:
    """Edges of the shortest spanning tree, and a share of all others."""
    tree = minimum_spanning_tree(csr_array(distances)).toarray() > 0
    some = np.triu(rng.random(distances.shape) < loops, 1)
    return [(int(i), int(j)) for i, j in np.argwhere(tree | some)]


def _join(
    free: Mask, start: NDArray[np.float64], end: NDArray[np.float64], thick: int, straight: bool
) -> None:
    """Dig a passage between two points, straight or with one right angle."""
    corners = [start, end] if straight else [start, np.array((end[0], start[1])), end]
    for a, b in pairwise(corners):
        middle, reach = (a + b) / 2, b - a
        half = float(np.hypot(*reach)) / 2 + thick / 2, thick / 2
        free |= box(free, (middle[0], middle[1]), half, float(np.arctan2(reach[1], reach[0])))


def _divide(
    free: Mask,
    place: tuple[slice, slice],
    rng: np.random.Generator,
    wall: int,
    door: int,
    smallest: int,
    corridors: float,
) -> list[tuple[slice, slice]]:
    """Put a wall, or a corridor of two, across a room; the rooms that this leaves."""
    across = place[0].stop - place[0].start > place[1].stop - place[1].start
    view = free.T if across else free
    rows, columns = (place[1], place[0]) if across else place
    width = columns.stop - columns.start
    if width < 2 * (smallest + wall) or (width < 4 * smallest and rng.random() < 0.2):
        return []
    gap = int(rng.integers(door, 2 * door + 1)) if rng.random() < corridors else 0
    if width < 2 * (smallest + wall) + gap:
        gap = 0
    left = columns.start + int(rng.integers(smallest, width - smallest - 2 * wall - gap + 1))
    walls = [left] if not gap else [left, left + wall + gap]
    for x in walls:
        if _shuts_a_door(view, rows, x, wall):
            return []
    for x in walls:
        view[rows, x : x + wall] = False
        for _ in range(1 + int(rng.random() < 0.3)):
            low, high = _doorway(rng, rows.start + 1, rows.stop - 1, door)
            view[low:high, x : x + wall] = True
    halves = slice(columns.start, left), slice(walls[-1] + wall, columns.stop)
    return [(half, rows) if across else (rows, half) for half in halves]


def _shuts_a_door(view: Mask, rows: slice, x: int, wall: int) -> bool:
    """Whether a wall would end where a door is."""
    above = view[rows.start - 1, x : x + wall].any() if rows.start else False
    below = view[rows.stop, x : x + wall].any() if rows.stop < len(view) else False
    return bool(above or below)


def _furnish(free: Mask, rng: np.random.Generator, share: float) -> None:
    """Put small boxes on a share of the floor."""
    height, width = free.shape
    wanted = (~free).mean() + share
    while (~free).mean() < wanted:
        half = rng.uniform(1, 4), rng.uniform(1, 4)
        free &= ~box(free, (rng.uniform(0, width), rng.uniform(0, height)), half)
