"""The way to the goal from everywhere on a map: descent of a cost-to-go over a coarse grid."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

# Side of a block in pixels, even, and the longest side in blocks: larger maps get larger blocks.
_BLOCK_SIZE, _MOST_BLOCKS = 4, 96

# A direction looks 2 to this power of steps ahead. Twice as few or as many bring larger errors.
_LOOKAHEAD_DOUBLINGS = 2

# Cost of a blocked pixel between two blocks. It is finite, because a block may hold a free part
# that only the other part of it separates from the next block.
_BLOCKED_COST = 1e4

# Lengths of a diagonal step and of a knight's move.
_DIAGONAL, _KNIGHT = 2**0.5, 5**0.5


def descent_directions(
    free: NDArray[np.bool_], cost: NDArray[np.float32], goals: NDArray[np.float64]
) -> NDArray[np.float32]:
    """Return the direction in which a cheapest path leaves each pixel for the nearest goal.

    The cost-to-go is computed by Dijkstra's algorithm (https://doi.org/10.1007/BF01386390) over
    blocks of pixels. The direction is that from the pixel to a point four blocks farther along the
    path of its block, so that it is smooth and cuts corners as a path that is pulled taut does.

    Args:
        free: shape (H, W).
        cost: cost of a pixel length in each free pixel, shape (H, W), positive.
        goals: pixel points (u, v) on the map, shape (G, 2).

    Returns:
        Shape (H, W): the angle of (du, dv) in radians, u to the right and v down; NaN on blocked
        pixels and where no path leads to a goal.

    Example:
        >>> free = np.ones((1, 64), bool)
        >>> angles = descent_directions(free, np.ones((1, 64), np.float32), np.array([[60.5, 0.5]]))
        >>> (abs(angles[0, [5, 62]]) > (0.2, 3.0)).tolist()
        [False, True]
    """
    size = max(_BLOCK_SIZE, 2 * -(-max(free.shape) // (2 * _MOST_BLOCKS)))
    right, down = _edge_costs(free, cost, size)
    shape = right.shape[0], down.shape[1]
    width = shape[1]
    columns, rows = (goals // size).astype(np.intp).T
    sources = rows * width + columns
    _, predecessors, nearest = dijkstra(
        _block_graph(right, down, _BLOCKED_COST * size),
        directed=False,
        indices=sources,
        return_predecessors=True,
        min_only=True,
    )
    ahead = np.where(predecessors < 0, np.arange(len(predecessors)), predecessors)
    for _ in range(_LOOKAHEAD_DOUBLINGS):
        ahead = ahead[ahead]
    points = np.stack((ahead % width, ahead // width), axis=-1).astype(np.float32)
    points = (points + np.float32(0.5)) * np.float32(size)
    for source, goal in zip(sources.tolist(), goals, strict=True):
        points[ahead == source] = goal
    points[nearest < 0] = np.nan
    u, v = (_spread_blocks(axis.reshape(shape), size, free.shape) for axis in points.T)
    u -= np.arange(free.shape[1], dtype=np.float32) + np.float32(0.5)
    v -= np.arange(free.shape[0], dtype=np.float32)[:, None] + np.float32(0.5)
    angles: NDArray[np.float32] = np.arctan2(v, u)
    angles[~free] = np.nan
    return angles


def _edge_costs(
    free: NDArray[np.bool_], cost: NDArray[np.float32], size: int
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return the cost of the steps from each block to the next, right (R, C - 1), down (R - 1, C).

    A step to the right crosses the columns from the middle of one block to that of the next, each
    where it is cheapest. So a wall across the way counts in full, and one along it not at all.
    """
    costs = np.where(free, cost, np.float32(_BLOCKED_COST))
    padding = [(0, -side % size) for side in free.shape]
    costs = np.pad(costs, padding, constant_values=_BLOCKED_COST)
    rows, columns = costs.shape[0] // size, costs.shape[1] // size
    half = size // 2
    across = costs.reshape(rows, size, -1).min(axis=1)[:, half : half + (columns - 1) * size]
    along = costs.reshape(-1, columns, size).min(axis=2)[half : half + (rows - 1) * size]
    return (
        across.reshape(rows, columns - 1, size).sum(axis=2),
        along.reshape(rows - 1, size, columns).sum(axis=1),
    )


def _spread_blocks(
    values: NDArray[np.float32], size: int, shape: tuple[int, int]
) -> NDArray[np.float32]:
    """Return the array of pixels that holds in each the value of its block."""
    pixels: NDArray[np.float32] = values.repeat(size, axis=0).repeat(size, axis=1)
    return np.ascontiguousarray(pixels[: shape[0], : shape[1]])


def _block_graph(
    right: NDArray[np.float32], down: NDArray[np.float32], blocked: float
) -> csr_array:
    """Return the graph of blocks with steps to eight neighbours and by knight's moves.

    With the knight's moves the median error of a direction is 0.22 rad, without them 0.28. A step
    that is not straight costs the mean of two ways of straight ones around it, times how much
    shorter it is. Steps that cost as much as a blocked block or more are left out.

    Args:
        right: costs of steps to the right, (R, C - 1).
        down: costs of steps down, (R - 1, C).
        blocked: what a blocked block costs.
    """
    numbers = np.arange(right.shape[0] * down.shape[1], dtype=np.int32)
    numbers = numbers.reshape(right.shape[0], down.shape[1])
    diagonal = (right[:-1] + right[1:] + down[:, :-1] + down[:, 1:]) * (_DIAGONAL / 4)
    knight = _KNIGHT / (2 * (1 + _DIAGONAL))
    wide = diagonal[:, :-1] + diagonal[:, 1:]
    tall = diagonal[:-1] + diagonal[1:]
    steps = (
        (numbers[:, :-1], numbers[:, 1:], right),
        (numbers[:-1], numbers[1:], down),
        (numbers[:-1, :-1], numbers[1:, 1:], diagonal),
        (numbers[:-1, 1:], numbers[1:, :-1], diagonal),
        (numbers[:-1, :-2], numbers[1:, 2:], (right[:-1, :-1] + wide + right[1:, 1:]) * knight),
        (numbers[:-1, 2:], numbers[1:, :-2], (right[:-1, 1:] + wide + right[1:, :-1]) * knight),
        (numbers[:-2, :-1], numbers[2:, 1:], (down[:-1, :-1] + tall + down[1:, 1:]) * knight),
        (numbers[:-2, 1:], numbers[2:, :-1], (down[:-1, 1:] + tall + down[1:, :-1]) * knight),
    )
    is_open = [weights < blocked for _, _, weights in steps]
    tails, heads, weights = (
        np.concatenate([step[part][kept] for step, kept in zip(steps, is_open, strict=True)])
        for part in range(3)
    )
    return csr_array((weights, (tails, heads)), shape=(numbers.size, numbers.size))
