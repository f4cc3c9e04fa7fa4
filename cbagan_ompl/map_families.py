"""Random maps of a few kinds that planners find hard in different ways.

Every function draws one map: free pixels are true, row 0 is on top, lengths are in pixels and grow
with the shorter side where nothing else is said. The free pixels of a map are all connected
(4-connected): pockets that no path reaches are filled. Only NumPy draws, so that the same seed
gives the same bits with every version of OpenCV.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from math import cos, pi, sin

import cv2
import numpy as np
from numpy.typing import NDArray

from .errors import ConfigError

Mask = NDArray[np.bool_]
Point = tuple[float, float]

#: Shorter sides than this have no room for walls and doors.
MIN_SIDE = 48
_WALL = 3


def walls_with_gaps(rng: np.random.Generator, width: int, height: int) -> Mask:
    """Walls from border to border with one or two gaps each, and boxes between them."""
    free, unit = _canvas(width, height)
    count = max(2, round(width / (14 * unit)))
    lane = width / (count + 1)
    for i in range(count):
        thick = round(rng.uniform(1.2, 2.6) * unit)
        left = round((i + 1) * lane + rng.uniform(-0.08, 0.08) * lane - thick / 2)
        free[:, left : left + thick] = False
        for _ in range(rng.integers(1, 3)):
            gap = round(rng.uniform(3.0, 5.0) * unit)
            top = rng.integers(round(unit), height - gap - round(unit))
            free[top : top + gap, left : left + thick] = True
    for i in range(count + 1):
        for _ in range(rng.integers(2, 5)):
            # Too narrow to reach a wall and close its gap.
            centre = (i + rng.uniform(0.4, 0.6)) * lane, rng.uniform(0.05, 0.95) * height
            half = rng.uniform(0.06, 0.2) * lane, rng.uniform(0.06, 0.3) * lane
            free &= ~_box(free, centre, half)
    return without_pockets(free)


def rooms(rng: np.random.Generator, width: int, height: int) -> Mask:
    """A floor plan: rooms by recursive splitting, walls of 3 pixels, one or two doors a wall."""
    free, unit = _canvas(width, height)
    _frame(free, _WALL)
    door = max(5, round(2.4 * unit))
    smallest = 2 * door + 2
    # Where no wall may end, because a door is there.
    doorway = np.zeros_like(free)

    def split(mask: Mask, doors: Mask) -> None:
        """Put a wall across the longer side of a room, and go on with both parts.

        Both arguments are views of the room without its walls, on a side of a pixel more for
        ``doors``, so that the doors in the walls around the room can be seen.
        """
        if mask.shape[0] > mask.shape[1]:
            mask, doors = mask.T, doors.T
        rows, columns = mask.shape
        if columns < 2 * smallest + _WALL or (columns < 4.5 * smallest and rng.random() < 0.25):
            return
        places = np.arange(smallest, columns - smallest - _WALL + 1)
        shut = doors[0, 1:-1] | doors[-1, 1:-1]
        blocked = np.array([shut[x : x + _WALL].any() for x in places])
        if blocked.all():
            return
        x = int(rng.choice(places[~blocked]))
        mask[:, x : x + _WALL] = False
        halves = [(0, rows)]
        if rows > 4 * smallest or (rows > 2.5 * smallest and rng.random() < 0.3):
            halves = [(0, rows // 2), (rows // 2, rows)]
        for low, high in halves:
            y = int(rng.integers(low + 2, high - door - 1))
            mask[y : y + door, x : x + _WALL] = True
            doors[y : y + door + 2, x + 1 : x + 1 + _WALL] = True
        split(mask[:, :x], doors[:, : x + 2])
        split(mask[:, x + _WALL :], doors[:, x + _WALL :])

    split(free[_WALL:-_WALL, _WALL:-_WALL], doorway[_WALL - 1 : 1 - _WALL, _WALL - 1 : 1 - _WALL])
    return without_pockets(free)


def maze(rng: np.random.Generator, width: int, height: int) -> Mask:
    """A maze with walls of 3 pixels; a few walls are taken out, so there are loops."""
    free, unit = _canvas(width, height)
    free[:] = False
    pitch = max(4.5 * unit, 9)  # ways of 6 pixels at least
    columns, rows = (round(side / pitch) for side in (width, height))
    x = np.rint(np.linspace(0, width - _WALL, columns + 1)).astype(int).tolist()
    y = np.rint(np.linspace(0, height - _WALL, rows + 1)).astype(int).tolist()

    def carve(column: int, row: int, next_column: int, next_row: int) -> None:
        """Join two neighbouring cells."""
        left, right = min(column, next_column), max(column, next_column)
        top, bottom = min(row, next_row), max(row, next_row)
        free[y[top] + _WALL : y[bottom + 1], x[left] + _WALL : x[right + 1]] = True

    def neighbours(column: int, row: int) -> list[tuple[int, int]]:
        around = ((column + 1, row), (column - 1, row), (column, row + 1), (column, row - 1))
        return [(c, r) for c, r in around if 0 <= c < columns and 0 <= r < rows]

    way = [(int(rng.integers(columns)), int(rng.integers(rows)))]
    seen = set(way)
    while way:  # depth first
        ahead = [cell for cell in neighbours(*way[-1]) if cell not in seen]
        if not ahead:
            way.pop()
            continue
        cell = ahead[rng.integers(len(ahead))]
        carve(*way[-1], *cell)
        seen.add(cell)
        way.append(cell)
    for _ in range(columns * rows // 20):
        cell = int(rng.integers(columns)), int(rng.integers(rows))
        beside = neighbours(*cell)
        carve(*cell, *beside[rng.integers(len(beside))])
    return free


def clutter(rng: np.random.Generator, width: int, height: int) -> Mask:
    """Boxes and ellipses of many sizes, turned at random, on a quarter to a third of the map."""
    free, unit = _canvas(width, height)
    _scatter(free, rng, unit, rng.uniform(0.25, 0.34))
    return without_pockets(free)


def narrow_passage(rng: np.random.Generator, width: int, height: int) -> Mask:
    """A thick wall with one straight passage of 4 to 6 pixels, clutter on both sides of it."""
    free, unit = _canvas(width, height)
    gap, thick = int(rng.integers(4, 7)), round(rng.uniform(0.12, 0.2) * width)
    left = round(rng.uniform(0.42, 0.58) * width - thick / 2)
    top = int(rng.integers(height // 5, 4 * height // 5))
    # The mouths of the passage stay clear.
    clear = _box(free, (left + thick / 2, top + gap / 2), (thick / 2 + 4 * unit, 2 * unit))
    _scatter(free, rng, unit, rng.uniform(0.14, 0.2), clear)
    free[:, left : left + thick] = False
    free[top : top + gap, left : left + thick] = True
    return without_pockets(free)


def bug_trap(rng: np.random.Generator, width: int, height: int) -> Mask:
    """The classic trap: a hollow body with one mouth on the left, whose lips reach far inside.

    From inside the way to the right, along which a sampled tree grows at first, is shut.
    """
    free, unit = _canvas(width, height)
    x, y = (rng.uniform(0.48, 0.52) * side for side in (width, height))
    a, b = rng.uniform(0.26, 0.29) * width, rng.uniform(0.26, 0.3) * height
    thick, mouth = round(1.6 * unit), round(rng.uniform(2.2, 3.0) * unit)
    lip = rng.uniform(0.75, 0.9) * a
    hollow = _ellipse(free, (x, y), (a - thick, b - thick), power=3.0)
    free &= hollow | ~_ellipse(free, (x, y), (a, b), power=3.0)
    # The channel of the mouth: a block across the wall on the left, with the way in cut out of it.
    channel = x - a + lip / 2
    free &= ~_box(free, (channel, y), (lip / 2, mouth / 2 + thick))
    free |= _box(free, (channel - unit, y), (lip / 2 + 1.5 * unit, mouth / 2))
    # A way around the body and in front of its mouth stays clear.
    clear = _ellipse(free, (x, y), (a + 2.5 * unit, b + 2.5 * unit), power=3.0)
    clear |= _box(free, (x - a, y), (5 * unit, 3 * unit))
    _scatter(free, rng, 0.8 * unit, (~free).mean() + rng.uniform(0.07, 0.11), clear)
    return without_pockets(free)


def warehouse(rng: np.random.Generator, width: int, height: int) -> Mask:
    """Rows of racks along x with aisles, cross aisles, a loading zone with pallets on the left."""
    free, unit = _canvas(width, height)
    _frame(free, _WALL)
    dock = round(0.16 * width)
    rack, aisle = round(3 * unit), max(5, round(3.4 * unit))
    cross = round(4 * unit)
    blocks = max(2, round((width - dock) / (22 * unit)))
    edges = np.rint(np.linspace(dock, width - _WALL, blocks + 1)).astype(int).tolist()
    for top in range(_WALL + aisle, height - _WALL - aisle - rack + 2, rack + aisle):
        for left, right in pairwise(edges):
            bay = round(3.2 * unit)
            for start in range(left, right - cross - bay + 1, bay):
                if rng.random() < 0.93:
                    free[top : top + rack, start : start + bay] = False
    for _ in range(rng.integers(5, 9)):
        half = rng.uniform(0.7, 1.3) * unit, rng.uniform(0.7, 1.3) * unit
        centre = rng.uniform(0.2, 0.75) * dock, rng.uniform(0.06, 0.94) * height
        free &= ~_box(free, centre, half, rng.normal(0, 0.15))
    for _ in range(rng.integers(3, 7)):  # things left standing in the aisles
        centre = rng.uniform(dock, width), rng.uniform(0, height)
        free &= ~_box(free, centre, (0.6 * unit, 0.6 * unit), rng.uniform(0, pi))
    return without_pockets(free)


def blocks(rng: np.random.Generator, width: int, height: int) -> Mask:
    """Upright boxes, apart or overlapping."""
    free, unit = _canvas(width, height)

    def draw(centre: Point) -> Mask:
        return _box(free, centre, (rng.uniform(2, 9) * unit, rng.uniform(2, 9) * unit))

    return _strewn(free, rng, rng.uniform(0.1, 0.3), draw)


def ellipses(rng: np.random.Generator, width: int, height: int) -> Mask:
    """Ellipses at any angle."""
    free, unit = _canvas(width, height)

    def draw(centre: Point) -> Mask:
        half = rng.uniform(2, 9) * unit, rng.uniform(2, 9) * unit
        return _ellipse(free, centre, half, rng.uniform(0, pi))

    return _strewn(free, rng, rng.uniform(0.1, 0.3), draw)


def triangles(rng: np.random.Generator, width: int, height: int) -> Mask:
    """Triangles at any angle."""
    free, unit = _canvas(width, height)

    def draw(centre: Point) -> Mask:
        return _triangle(free, centre, rng.uniform(5, 14) * unit, rng.uniform(0, 2 * pi))

    return _strewn(free, rng, rng.uniform(0.08, 0.22), draw)


def tl_shapes(rng: np.random.Generator, width: int, height: int) -> Mask:
    """Shapes of the letters T and L, upright or turned by right angles or a little more."""
    free, unit = _canvas(width, height)

    def draw(centre: Point) -> Mask:
        angle = rng.integers(4) * pi / 2 + rng.normal(0, 0.1)
        bar, stem, thick = (rng.uniform(*span) * unit for span in ((4, 9), (4, 10), (1.2, 2.5)))
        # The stem hangs from the middle of the bar, or from one end of it.
        along = (bar - thick) * int(rng.integers(-1, 2))
        x = centre[0] + cos(angle) * along - sin(angle) * stem
        y = centre[1] + sin(angle) * along + cos(angle) * stem
        upper = _box(free, centre, (bar, thick), angle)
        return upper | _box(free, (x, y), (thick, stem), angle)

    return _strewn(free, rng, rng.uniform(0.1, 0.24), draw)


#: Every family by its name.
FAMILIES: dict[str, Callable[[np.random.Generator, int, int], Mask]] = {
    "blocks": blocks,
    "bug_trap": bug_trap,
    "clutter": clutter,
    "ellipses": ellipses,
    "maze": maze,
    "narrow_passage": narrow_passage,
    "rooms": rooms,
    "tl_shapes": tl_shapes,
    "triangles": triangles,
    "walls_with_gaps": walls_with_gaps,
    "warehouse": warehouse,
}


def _canvas(width: int, height: int) -> tuple[Mask, float]:
    """A free map and the unit of length, 4 pixels where the shorter side is 256.

    Raises:
        ConfigError: a side is shorter than :data:`MIN_SIDE`.
    """
    if min(width, height) < MIN_SIDE:
        raise ConfigError(
            f"maps are drawn from {MIN_SIDE} pixels a side up, got {width} x {height}"
        )
    return np.ones((height, width), dtype=np.bool_), min(width, height) / 64


def _frame(free: Mask, wall: int) -> None:
    """Draw a wall around the map."""
    free[:wall] = free[-wall:] = False
    free[:, :wall] = free[:, -wall:] = False


def _scatter(
    free: Mask, rng: np.random.Generator, unit: float, share: float, clear: Mask | None = None
) -> None:
    """Draw boxes and ellipses, none that touches ``clear``, until a share of the map is blocked."""

    def draw(centre: Point) -> Mask:
        long = rng.uniform(1.2, 4.2) * unit
        shape = _box if rng.random() < 0.6 else _ellipse
        return shape(free, centre, (long, long * rng.uniform(0.4, 1.0)), rng.uniform(0, pi))

    _strew(free, rng, share, draw, clear)


def _strewn(
    free: Mask, rng: np.random.Generator, share: float, draw: Callable[[Point], Mask]
) -> Mask:
    """The map with obstacles strewn over it, and without pockets."""
    _strew(free, rng, share, draw)
    return without_pockets(free)


def _strew(
    free: Mask,
    rng: np.random.Generator,
    share: float,
    draw: Callable[[Point], Mask],
    clear: Mask | None = None,
) -> None:
    """Block what is drawn around random points, nothing that touches ``clear``, up to a share."""
    height, width = free.shape
    while (~free).mean() < share:
        drawn = draw((rng.uniform(0, width), rng.uniform(0, height)))
        if clear is None or not (drawn & clear).any():
            free &= ~drawn


def _turned(
    free: Mask, centre: Point, angle: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Coordinates of the pixels' middles in a frame at ``centre`` that is turned by ``angle``."""
    rows, columns = np.ogrid[: free.shape[0], : free.shape[1]]
    x, y = columns + 0.5 - centre[0], rows + 0.5 - centre[1]
    return cos(angle) * x + sin(angle) * y, cos(angle) * y - sin(angle) * x


def _box(free: Mask, centre: Point, half: Point, angle: float = 0.0) -> Mask:
    """The pixels of a box with half sides ``half``."""
    x, y = _turned(free, centre, angle)
    return (abs(x) <= half[0]) & (abs(y) <= half[1])


def _ellipse(
    free: Mask, centre: Point, half: Point, angle: float = 0.0, power: float = 2.0
) -> Mask:
    """The pixels of an ellipse with half axes ``half``; a power above 2 makes it squarer."""
    x, y = _turned(free, centre, angle)
    return abs(x / half[0]) ** power + abs(y / half[1]) ** power <= 1


def _triangle(free: Mask, centre: Point, size: float, angle: float) -> Mask:
    """The pixels of a triangle with equal sides, ``size`` from its middle to its corners."""
    inside = np.ones_like(free)
    for side in range(3):
        x, _ = _turned(free, centre, angle + 2 * pi * side / 3)
        inside &= x <= size / 2
    return inside


def without_pockets(free: Mask) -> Mask:
    """Fill all but the largest connected free part."""
    count, labels = cv2.connectedComponents(free.astype(np.uint8), connectivity=4)
    if count <= 2:
        return free
    sizes = np.bincount(labels.ravel())[1:]
    return np.asarray(labels == 1 + int(sizes.argmax()))
