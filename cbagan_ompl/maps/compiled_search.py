"""Shortest paths on a grid by compiled searches, for :mod:`.grid_search`.

Where every pixel costs the same, by jump point search, with the rules for diagonal steps that cut
no corner: D. Harabor and A. Grastien, "Online graph pruning for pathfinding on grid maps", AAAI
2011, https://doi.org/10.1609/aaai.v25i1.7994. Else by A*: P. E. Hart, N. J. Nilsson and B. Raphael,
"A formal basis for the heuristic determination of minimum cost paths", IEEE Transactions on Systems
Science and Cybernetics 4(2), 1968, https://doi.org/10.1109/TSSC.1968.300136. The heuristic is the
octile distance.
"""

from __future__ import annotations

from collections.abc import Callable
from math import floor
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..common.compilation import compiled
from .collision import segment_is_free

#: :func:`.collision.segment_is_free`, compiled: takes an array in place of bytes.
segment_is_free_compiled: Callable[..., bool] = compiled(segment_is_free)

# The eight steps: rows down, columns to the right; diagonal ones last.
_DOWN = np.array((0, 1, 0, -1, 1, 1, -1, -1))
_RIGHT = np.array((1, 0, -1, 0, 1, -1, 1, -1))
_DIAGONAL = 2**0.5

# Estimates of the whole cost are compared in steps of this fraction of the cheapest pixel length.
# Equal ones are sorted by what is left: otherwise rounding would decide, and every pixel of all the
# shortest paths through open space would be visited.
_STEPS = 4096.0


def find_path(
    free: NDArray[np.bool_],
    start: tuple[int, int],
    goal: tuple[int, int],
    costs: NDArray[np.float32] | None = None,
    cheapest: float | None = None,
) -> NDArray[np.intp] | None:
    """Return the cheapest 8-connected path between two pixels, without cutting corners.

    Args:
        free: (H, W), true where free.
        start: (column, row) of a free pixel.
        goal: (column, row) of a free pixel.
        costs: (H, W), positive, see :func:`.grid_search.shortest_path`; 1 by default.
        cheapest: a lower bound of the costs; by default the least of them.

    Returns:
        Pixels (column, row), (K, 2), both endpoints included, at most a 4096th of the cheapest
        pixel length from the optimum; None where no path connects them.

    Example:
        >>> find_path(np.ones((3, 4), dtype=bool), (0, 0), (3, 1)).tolist()
        [[0, 0], [1, 1], [2, 1], [3, 1]]
    """
    # A blocked border: no step needs to be compared with the size of the map.
    cells = np.zeros((free.shape[0] + 2, free.shape[1] + 2), np.bool_)
    cells[1:-1, 1:-1] = free
    width = cells.shape[1]
    first, last = ((row + 1) * width + column + 1 for column, row in (start, goal))
    # Pages of memory are used when they are first written to: a search of a small part is cheap.
    before = np.zeros(cells.size, np.int32)
    paid = np.empty(cells.size, np.float64)
    if costs is None:
        found = _search_jumps(cells.ravel(), width, first, last, before, paid)
    else:
        padded = np.empty(cells.shape, np.float32)  # nobody asks for the costs of the border
        padded[1:-1, 1:-1] = costs
        least = float(costs.min()) if cheapest is None else cheapest
        found = _search_steps(
            cells.ravel(), padded.ravel(), width, first, last, least, before, paid
        )
    if not found:
        return None
    pixels = _trace(before, width, first, last)
    return np.stack((pixels % width - 1, pixels // width - 1), axis=-1)


@compiled
def _search_steps(
    cells: NDArray[np.bool_],
    costs: NDArray[np.float32],
    width: int,
    start: int,
    goal: int,
    cheapest: float,
    before: NDArray[np.int32],
    paid: NDArray[np.float64],
) -> bool:  # pragma: no cover
    """Search pixel by pixel, and return whether there is a path.

    Args:
        cells: true where free, flat, with a blocked border.
        costs: of a pixel length, flat.
        width: of the flat arrays.
        start: index of the first pixel.
        goal: index of the last one.
        cheapest: least of the costs.
        before: zeros; becomes the index of the pixel before each one that was reached.
        paid: becomes the cost of each pixel that was reached.
    """
    keys, nodes, size = np.empty(1024, np.float64), np.empty(1024, np.int64), 1
    before[start], paid[start] = start, 0.0
    keys[0], nodes[0] = _key(0.0, start, goal, width, cheapest), start
    while size > 0:
        key, here = keys[0], nodes[0]
        size = _remove_first(keys, nodes, size)
        if here == goal:
            return True
        if key > _key(paid[here], here, goal, width, cheapest):
            continue  # reached in a cheaper way since
        for i in range(8):
            down, right = _DOWN[i] * width, _RIGHT[i]
            there = here + down + right
            if not (cells[there] and cells[here + down] and cells[here + right]):
                continue
            length = 1.0 if i < 4 else _DIAGONAL
            cost = paid[here] + length * 0.5 * (costs[here] + costs[there])
            if before[there] == 0 or cost < paid[there]:
                before[there], paid[there] = here, cost
                if size == len(keys):
                    keys, nodes = _double(keys), _double(nodes)
                size = _add(keys, nodes, size, _key(cost, there, goal, width, cheapest), there)
    return False


@compiled
def _search_jumps(
    cells: NDArray[np.bool_],
    width: int,
    start: int,
    goal: int,
    before: NDArray[np.int32],
    paid: NDArray[np.float64],
) -> bool:  # pragma: no cover
    """Search from jump point to jump point; arguments and result as of :func:`_search_steps`."""
    keys, nodes, size = np.empty(1024, np.float64), np.empty(1024, np.int64), 1
    before[start], paid[start] = start, 0.0
    keys[0], nodes[0] = _key(0.0, start, goal, width, 1.0), start
    while size > 0:
        key, here = keys[0], nodes[0]
        size = _remove_first(keys, nodes, size)
        if here == goal:
            return True
        if key > _key(paid[here], here, goal, width, 1.0):
            continue
        came_down = np.sign(here // width - before[here] // width)
        came_right = np.sign(here % width - before[here] % width)
        for i in range(8):
            # Not where the pixel before comes without this one, on a way that is no longer.
            if came_down * _DOWN[i] < 0 or came_right * _RIGHT[i] < 0:
                continue
            there = _jump(cells, width, here, _DOWN[i] * width, _RIGHT[i], goal)
            if there < 0:
                continue
            down, right = abs(there // width - here // width), abs(there % width - here % width)
            cost = paid[here] + max(down, right) + (_DIAGONAL - 1) * min(down, right)
            if before[there] == 0 or cost < paid[there]:
                before[there], paid[there] = here, cost
                if size == len(keys):
                    keys, nodes = _double(keys), _double(nodes)
                size = _add(keys, nodes, size, _key(cost, there, goal, width, 1.0), there)
    return False


@compiled
def _jump(
    cells: NDArray[np.bool_], width: int, here: int, down: int, right: int, goal: int
) -> int:  # pragma: no cover
    """Return the next pixel in a direction in which a shortest path may turn; -1 if there is none.

    Args:
        cells: as of :func:`_search_steps`.
        width: of the flat array.
        here: where to begin.
        down: step along the rows, 0 or plus or minus ``width``.
        right: step along the columns, -1, 0 or 1.
        goal: where every path ends.
    """
    if down == 0:
        return _jump_straight(cells, here, right, width, goal)
    if right == 0:
        return _jump_straight(cells, here, down, 1, goal)
    while cells[here + down] and cells[here + right] and cells[here + down + right]:
        here += down + right
        if (
            here == goal
            or _jump_straight(cells, here, right, width, goal) >= 0
            or _jump_straight(cells, here, down, 1, goal) >= 0
        ):
            return here
    return -1


@compiled
def _jump_straight(
    cells: NDArray[np.bool_], here: int, step: int, side: int, goal: int
) -> int:  # pragma: no cover
    """Do the same for a step along a row or column; ``side`` is a step across it."""
    while cells[here + step]:
        here += step
        if here == goal:
            return here
        for beside in (here - side, here + side):
            # An obstacle ends beside here: behind it a path may turn.
            if cells[beside] and not cells[beside - step]:
                return here
    return -1


@compiled
def _key(
    paid: float, here: int, goal: int, width: int, cheapest: float
) -> float:  # pragma: no cover
    """Return what pixels are sorted by: the estimate of the whole cost, then what is left of it."""
    down, right = abs(here // width - goal // width), abs(here % width - goal % width)
    left = max(down, right) + (_DIAGONAL - 1) * min(down, right)
    return floor((paid / cheapest + left) * _STEPS + 0.5) + left / 2.0**20


@compiled
def _add(
    keys: NDArray[np.float64], nodes: NDArray[np.int64], size: int, key: float, node: int
) -> int:  # pragma: no cover
    """Add to the first ``size`` entries of a binary heap, and return how many there are then."""
    at = size
    while at > 0:
        above = (at - 1) // 2
        if keys[above] <= key:
            break
        keys[at], nodes[at] = keys[above], nodes[above]
        at = above
    keys[at], nodes[at] = key, node
    return size + 1


@compiled
def _remove_first(
    keys: NDArray[np.float64], nodes: NDArray[np.int64], size: int
) -> int:  # pragma: no cover
    """Remove the first entry of a binary heap, and return how many are left."""
    size -= 1
    key, node = keys[size], nodes[size]
    at, below = 0, 1
    while below < size:
        if below + 1 < size and keys[below + 1] < keys[below]:
            below += 1
        if keys[below] >= key:
            break
        keys[at], nodes[at] = keys[below], nodes[below]
        at, below = below, 2 * below + 1
    keys[at], nodes[at] = key, node
    return size


@compiled
def _double(values: NDArray[Any]) -> NDArray[Any]:  # pragma: no cover
    """Return a copy with room for as much again."""
    larger = np.empty(2 * len(values), values.dtype)
    larger[: len(values)] = values
    return larger


@compiled
def _trace(
    before: NDArray[np.int32], width: int, start: int, goal: int
) -> NDArray[np.int64]:  # pragma: no cover
    """Return the indices of all pixels of the path."""
    count, at = 1, goal
    while at != start:
        down, right = before[at] // width - at // width, before[at] % width - at % width
        count += max(abs(down), abs(right))
        at = before[at]
    pixels = np.empty(count, np.int64)
    at = goal
    pixels[count - 1] = goal
    while at != start:
        down, right = before[at] // width - at // width, before[at] % width - at % width
        step = np.sign(down) * width + np.sign(right)
        for _ in range(max(abs(down), abs(right))):
            count -= 1
            at += step
            pixels[count - 1] = at
    return pixels
