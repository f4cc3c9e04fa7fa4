"""Families of maps that are built: rooms with doors, mazes, warehouses."""

from __future__ import annotations

from itertools import pairwise
from math import pi

import numpy as np

from .shapes import WALL, Mask, box, canvas, frame, without_pockets


def rooms(rng: np.random.Generator, width: int, height: int) -> Mask:
    """A floor plan: rooms by recursive splitting, walls of 3 pixels, one or two doors a wall."""
    free, unit = canvas(width, height)
    frame(free, WALL)
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
        if columns < 2 * smallest + WALL or (columns < 4.5 * smallest and rng.random() < 0.25):
            return
        places = np.arange(smallest, columns - smallest - WALL + 1)
        shut = doors[0, 1:-1] | doors[-1, 1:-1]
        blocked = np.array([shut[x : x + WALL].any() for x in places])
        if blocked.all():
            return
        x = int(rng.choice(places[~blocked]))
        mask[:, x : x + WALL] = False
        halves = [(0, rows)]
        if rows > 4 * smallest or (rows > 2.5 * smallest and rng.random() < 0.3):
            halves = [(0, rows // 2), (rows // 2, rows)]
        for low, high in halves:
            y = int(rng.integers(low + 2, high - door - 1))
            mask[y : y + door, x : x + WALL] = True
            doors[y : y + door + 2, x + 1 : x + 1 + WALL] = True
        split(mask[:, :x], doors[:, : x + 2])
        split(mask[:, x + WALL :], doors[:, x + WALL :])

    split(free[WALL:-WALL, WALL:-WALL], doorway[WALL - 1 : 1 - WALL, WALL - 1 : 1 - WALL])
    return without_pockets(free)


def maze(rng: np.random.Generator, width: int, height: int) -> Mask:
    """A maze with walls of 3 pixels; a few walls are taken out, so there are loops."""
    free, unit = canvas(width, height)
    free[:] = False
    pitch = max(4.5 * unit, 9)  # ways of 6 pixels at least
    columns, rows = (round(side / pitch) for side in (width, height))
    x = np.rint(np.linspace(0, width - WALL, columns + 1)).astype(int).tolist()
    y = np.rint(np.linspace(0, height - WALL, rows + 1)).astype(int).tolist()

    def carve(column: int, row: int, next_column: int, next_row: int) -> None:
        """Join two neighbouring cells."""
        left, right = min(column, next_column), max(column, next_column)
        top, bottom = min(row, next_row), max(row, next_row)
        free[y[top] + WALL : y[bottom + 1], x[left] + WALL : x[right + 1]] = True

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


def warehouse(rng: np.random.Generator, width: int, height: int) -> Mask:
    """Rows of racks along x with aisles, cross aisles, a loading zone with pallets on the left."""
    free, unit = canvas(width, height)
    frame(free, WALL)
    dock = round(0.16 * width)
    rack, aisle = round(3 * unit), max(5, round(3.4 * unit))
    cross = round(4 * unit)
    blocks = max(2, round((width - dock) / (22 * unit)))
    edges = np.rint(np.linspace(dock, width - WALL, blocks + 1)).astype(int).tolist()
    for top in range(WALL + aisle, height - WALL - aisle - rack + 2, rack + aisle):
        for left, right in pairwise(edges):
            bay = round(3.2 * unit)
            for start in range(left, right - cross - bay + 1, bay):
                if rng.random() < 0.93:
                    free[top : top + rack, start : start + bay] = False
    for _ in range(rng.integers(5, 9)):
        half = rng.uniform(0.7, 1.3) * unit, rng.uniform(0.7, 1.3) * unit
        centre = rng.uniform(0.2, 0.75) * dock, rng.uniform(0.06, 0.94) * height
        free &= ~box(free, centre, half, rng.normal(0, 0.15))
    for _ in range(rng.integers(3, 7)):  # things left standing in the aisles
        centre = rng.uniform(dock, width), rng.uniform(0, height)
        free &= ~box(free, centre, (0.6 * unit, 0.6 * unit), rng.uniform(0, pi))
    return without_pockets(free)
