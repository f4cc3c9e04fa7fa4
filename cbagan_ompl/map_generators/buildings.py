"""Map generators of buildings: rooms with doors, mazes, warehouses."""

from __future__ import annotations

from itertools import pairwise
from math import pi

import numpy as np

from .shapes import WALL, Mask, add_frame, box, canvas, fill_pockets


def rooms(rng: np.random.Generator, width: int, height: int) -> Mask:
    """Generate a floor plan by recursive splitting.

    Walls are 3 pixels thick and have one or two doors each.

    Arguments and result as for every generator, see :mod:`cbagan_ompl.map_generators`.
    """
    free, unit = canvas(width, height)
    add_frame(free, WALL)
    door = max(5, round(2.4 * unit))
    smallest = 2 * door + 2
    # Pixels of doors, at which no wall may end.
    doorways = np.zeros_like(free)

    def split(mask: Mask, doors: Mask) -> None:
        """Put a wall across the longer side of a room, and split both parts further.

        Args:
            mask: view of the room without its walls.
            doors: view of the doors, one pixel wider on each side, so that it covers the doors in
                the walls around the room.
        """
        if mask.shape[0] > mask.shape[1]:
            mask, doors = mask.T, doors.T
        rows, columns = mask.shape
        if columns < 2 * smallest + WALL or (columns < 4.5 * smallest and rng.random() < 0.25):
            return
        positions = np.arange(smallest, columns - smallest - WALL + 1)
        beside_door = doors[0, 1:-1] | doors[-1, 1:-1]
        excluded = np.array([beside_door[x : x + WALL].any() for x in positions])
        if excluded.all():
            return
        x = int(rng.choice(positions[~excluded]))
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

    split(free[WALL:-WALL, WALL:-WALL], doorways[WALL - 1 : 1 - WALL, WALL - 1 : 1 - WALL])
    return fill_pockets(free)


def maze(rng: np.random.Generator, width: int, height: int) -> Mask:
    """Generate a maze with walls of 3 pixels, and with loops where walls were removed.

    Arguments and result as for every generator, see :mod:`cbagan_ompl.map_generators`.
    """
    free, unit = canvas(width, height)
    free[:] = False
    pitch = max(4.5 * unit, 9)  # passages of at least 6 pixels
    columns, rows = (round(length / pitch) for length in (width, height))
    x = np.rint(np.linspace(0, width - WALL, columns + 1)).astype(int).tolist()
    y = np.rint(np.linspace(0, height - WALL, rows + 1)).astype(int).tolist()

    def carve(column: int, row: int, next_column: int, next_row: int) -> None:
        """Connect two neighbouring cells."""
        left, right = min(column, next_column), max(column, next_column)
        top, bottom = min(row, next_row), max(row, next_row)
        free[y[top] + WALL : y[bottom + 1], x[left] + WALL : x[right + 1]] = True

    def neighbours(column: int, row: int) -> list[tuple[int, int]]:
        cells = ((column + 1, row), (column - 1, row), (column, row + 1), (column, row - 1))
        return [(c, r) for c, r in cells if 0 <= c < columns and 0 <= r < rows]

    stack = [(int(rng.integers(columns)), int(rng.integers(rows)))]
    visited = set(stack)
    while stack:  # depth first
        unvisited = [cell for cell in neighbours(*stack[-1]) if cell not in visited]
        if not unvisited:
            stack.pop()
            continue
        cell = unvisited[rng.integers(len(unvisited))]
        carve(*stack[-1], *cell)
        visited.add(cell)
        stack.append(cell)
    for _ in range(columns * rows // 20):
        cell = int(rng.integers(columns)), int(rng.integers(rows))
        adjacent = neighbours(*cell)
        carve(*cell, *adjacent[rng.integers(len(adjacent))])
    return free


def warehouse(rng: np.random.Generator, width: int, height: int) -> Mask:
    """Generate rows of racks along x, aisles, cross aisles, and a dock with pallets on the left.

    Arguments and result as for every generator, see :mod:`cbagan_ompl.map_generators`.
    """
    free, unit = canvas(width, height)
    add_frame(free, WALL)
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
    for _ in range(rng.integers(3, 7)):  # goods left in the aisles
        centre = rng.uniform(dock, width), rng.uniform(0, height)
        free &= ~box(free, centre, (0.6 * unit, 0.6 * unit), rng.uniform(0, pi))
    return fill_pockets(free)
