"""Shortest paths of a rectangle that turns, on a lattice of poses: one a pixel, 16 headings.

A rectangle is the same after half a turn, so 16 headings a half turn apart from the first to the
last make 32 of a whole one. A pose of the lattice is free by the exact checker
(:class:`cbagan_ompl.robots.shape_checker.ShapeChecker`). Robots move with a heading kept, in any
direction, and turn in place by one heading, where the rectangle is free in nine headings on the
way. Turning costs what it does in OMPL's SE2StateSpace: half a pixel for a radian.

The cost of the shortest path from a pixel is found by fast marching inside each heading (J. A.
Sethian, "A fast marching level set method for monotonically advancing fronts", PNAS 93(4), 1996,
https://doi.org/10.1073/pnas.93.4.1591), and by Dijkstra's steps between headings, in one queue. As
in the labels of the network, so lengths are those of paths at any angle, not of steps on the grid.

What it leaves out makes it conservative: centres of pixels only, 32 headings, no move while
turning; `refined_cost` says how much that matters. Past the corner of an obstacle a path may be too
near by less than a pixel.
"""

from __future__ import annotations

from functools import lru_cache
from heapq import heapify, heappop, heappush
from math import ceil, inf, pi
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from cbagan_ompl import GridMap, Robot
from cbagan_ompl.common.compilation import compiled
from cbagan_ompl.robots.shape_checker import ShapeChecker

HEADINGS = 16
#: Cost of a turn by one heading, in pixels.
TURN_COST = 0.5 * pi / HEADINGS
# Headings in which a turn is looked at, the last of which is the next one's first.
_LOOKS = 8
# Radius in which costs around the source are exact, as in cbagan_ompl.datasets.geodesic.
_EXACT_RADIUS = 12.0

Cells = NDArray[np.bool_]
Costs = NDArray[np.float32]
Mask = NDArray[np.uint8]


class PoseLattice(NamedTuple):
    """What a rectangle can do on a map.

    Attributes:
        free: (headings, H, W), whether a pose is free.
        turns: (headings, H, W), whether it can turn from there to the next heading.
        turn_cost: of such a turn, in pixels.
    """

    free: Cells
    turns: Cells
    turn_cost: float = TURN_COST

    @property
    def positions(self) -> Cells:
        """Where it fits with any heading, (H, W)."""
        return np.asarray(self.free.any(axis=0))

    def costs_from(
        self,
        source: tuple[int, int],
        target: tuple[int, int] | None = None,
        region: Cells | None = None,
    ) -> Costs:
        """Return the cost of the shortest path to each pose, whatever the heading at the source.

        Args:
            source: (column, row).
            target: (column, row); other costs may be too large once one is known there.
            region: (H, W), the positions that paths keep to; all by default.

        Returns:
            (headings, H, W) in pixels, infinite where no path leads.
        """
        free = self.free if region is None else self.free & region
        costs = np.full(free.shape, np.inf, np.float32)
        for layer, values in zip(free, costs, strict=True):
            _set_near(layer, values, source)
        # A blocked border, so that no step needs to be compared with the size of the map.
        around = ((0, 0), (1, 1), (1, 1))
        padded = np.pad(costs, around, constant_values=np.inf)
        end = (-1, -1) if target is None else (target[0] + 1, target[1] + 1)
        _march(np.pad(free, around), np.pad(self.turns, around), padded, *end, self.turn_cost)
        return padded[:, 1:-1, 1:-1]

    def cost_between(
        self, source: tuple[int, int], target: tuple[int, int], region: Cells | None = None
    ) -> float:
        """Return the cost of the shortest path between two pixels, whatever the headings there."""
        column, row = target
        return float(self.costs_from(source, target, region)[:, row, column].min())


def make_lattice(grid: GridMap, robot: Robot) -> PoseLattice:
    """Return the lattice of a rectangle on a map of pixels of 1, its reference point in the centre.

    Example:
        >>> lattice = make_lattice(GridMap([[1] * 20] * 5), Robot.rectangle(8, 2))
        >>> lattice.free[:, 2, 10].nonzero()[0].tolist()
        [0, 1, 15]
    """
    pixels = grid.free.astype(np.uint8)
    free, turns = (
        np.array(
            [
                cv2.erode(pixels, mask, borderType=cv2.BORDER_CONSTANT, borderValue=0)
                for mask in masks
            ],
            bool,
        )
        for masks in touched_masks(robot)
    )
    return PoseLattice(free, turns)


def refined_cost(
    grid: GridMap, robot: Robot, source: tuple[int, int], target: tuple[int, int]
) -> float:
    """Return the cost of the shortest path between two pixels on a lattice of half pixels.

    Rectangles get through more gaps on it. It begins in the middle of quarters of the pixels.
    """
    free = np.kron(grid.free, np.ones((2, 2), bool))
    large = Robot.polygon([(2 * x, 2 * y) for x, y in robot.corners])
    lattice = make_lattice(GridMap(free), large)._replace(turn_cost=2 * TURN_COST)
    ends = [
        (2 * column + right, 2 * row + down)
        for column, row in (source, target)
        for right in (0, 1)
        for down in (0, 1)
    ]
    fits = [end for end in ends if lattice.positions[end[::-1]]]
    starts, goals = ([end for end in fits if end in some] for some in (ends[:4], ends[4:]))
    if not (starts and goals):
        return inf
    return lattice.cost_between(starts[0], goals[0]) / 2


@lru_cache(maxsize=8)
def touched_masks(robot: Robot) -> tuple[list[Mask], list[Mask]]:
    """Return what a robot touches in each heading, and on the turn from there to the next."""
    step = pi / HEADINGS / _LOOKS
    looks = [touched_pixels(robot, look * step) for look in range(HEADINGS * _LOOKS)]
    around = [*looks, looks[0]]
    firsts = range(0, len(looks), _LOOKS)
    turning = [np.maximum.reduce(around[first : first + _LOOKS + 1]) for first in firsts]
    return looks[::_LOOKS], turning


def touched_pixels(robot: Robot, heading: float) -> Mask:
    """Return which pixels a robot in the centre of one touches, (N, N), N odd; 1 where it does."""
    reach = ceil(robot.circumscribed_radius) + 1
    middle = 2 * reach + 1
    cells = np.ones((2 * middle + 1, 2 * middle + 1), np.bool_)
    cells[middle, middle] = False
    checker = ShapeChecker(GridMap(cells), robot)
    # The robot at an offset touches the obstacle: without an offset it touches the opposite pixel.
    around = [middle - offset + 0.5 for offset in range(-reach, reach + 1)]
    touched = [[not checker.pose_is_free(x, y, heading) for x in around] for y in around]
    return np.array(touched, np.uint8)


def _set_near(free: Cells, values: Costs, source: tuple[int, int]) -> None:
    """Set the costs in a disc without obstacles around the source."""
    column, row = source
    if not free[row, column]:
        return
    padded = np.pad(free, 1).astype(np.uint8)
    clearance = cv2.distanceTransform(padded, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    radius = max(0.0, min(_EXACT_RADIUS, float(clearance[row + 1, column + 1]) - 1))
    rows, columns = np.ogrid[: free.shape[0], : free.shape[1]]
    exact = np.hypot(rows - row, columns - column)
    values[exact <= radius] = exact[exact <= radius]


@compiled
def _march(  # noqa: C901 - one loop on purpose
    free: Cells, turns: Cells, costs: Costs, column: int, row: int, turn_cost: float
) -> None:
    """Spread costs from those that are finite, until the target is reached in a heading."""
    headings, height, width = free.shape
    size = height * width
    cells, turning, values = free.reshape(-1), turns.reshape(-1), costs.reshape(-1)
    done = np.zeros(cells.size, np.bool_)
    queue = [(values[at], at) for at in np.flatnonzero(np.isfinite(values))]
    heapify(queue)
    goal = row * width + column if row >= 0 else -1
    while queue:
        cost, at = heappop(queue)
        if done[at]:
            continue
        done[at] = True
        layer = at // size
        if at - layer * size == goal:
            return
        for step in (-1, 1, -width, width):
            near = at + step
            if not cells[near] or done[near]:
                continue
            a = min(values[near - 1], values[near + 1])
            b = min(values[near - width], values[near + width])
            if a > b:
                a, b = b, a
            # The solution of (d - a)^2 + (d - b)^2 = 1, or of d - a = 1 if b is too large.
            new = a + 1 if b - a >= 1 else (a + b + np.sqrt(2 - (a - b) * (a - b))) / 2
            if new < values[near]:
                values[near] = new
                heappush(queue, (values[near], near))
        for other in (-1, 1):
            next_layer = (layer + other) % headings
            near = at + (next_layer - layer) * size
            if not cells[near] or done[near] or not turning[at if other == 1 else near]:
                continue
            new = cost + turn_cost
            if new < values[near]:
                values[near] = new
                heappush(queue, (values[near], near))
