"""Exact labels of tasks, from the geodesic distances to start and goal."""

from __future__ import annotations

from math import isfinite

import numpy as np
from numpy.typing import NDArray

#: Relative detour at the border of the region, see :func:`geodesic_label`.
EPSILON = 0.05
#: Side of the patches of :func:`travel_directions`, in pixels.
DIRECTION_PATCH = 4
#: Detour in pixels that is added to it, so that the region of a short task has some width.
SLACK = 1.0


def geodesic_label(
    from_start: NDArray[np.float32],
    from_goal: NDArray[np.float32],
    goal: tuple[int, int],
    epsilon: float = EPSILON,
) -> NDArray[np.float32]:
    """Return the label of a task: 1 on a shortest path, 0.5 where paths take epsilon more.

    The shortest path through a pixel x has the length D_s(x) + D_g(x), the shortest path of all
    the length D*. The label is

        2 ** -((D_s(x) + D_g(x) - D*) / (epsilon D* + SLACK)).

    Its values of at least 0.5 are the informed set of the task (Gammell, Srinivasa and Barfoot,
    "Informed RRT*", 2014, https://arxiv.org/abs/1404.2334) with obstacles taken into account: they
    hold every path that is at most epsilon D* + SLACK longer than D*, of every homotopy class.

    Args:
        from_start: geodesic distances D_s from the start, (H, W) in pixels.
        from_goal: geodesic distances D_g from the goal, (H, W) in pixels.
        goal: (column, row) of the goal.
        epsilon: relative detour at the border of the region.

    Returns:
        (H, W), from 0 to 1; 0 where a distance is infinite, and everywhere without a path.

    Example:
        >>> from_start = np.array([[0, 1, 2]], np.float32)
        >>> geodesic_label(from_start, from_start[:, ::-1], (2, 0)).tolist()
        [[1.0, 1.0, 1.0]]
    """
    shortest = float(from_start[goal[1], goal[0]])
    if not isfinite(shortest):
        return np.zeros_like(from_start)
    detour = np.maximum(from_start + from_goal - np.float32(shortest), 0)
    label: NDArray[np.float32] = np.exp2(-detour / np.float32(epsilon * shortest + SLACK))
    return label


def travel_directions(
    from_goal: NDArray[np.float32], label: NDArray[np.float32]
) -> NDArray[np.float32]:
    """Return the direction of travel in each patch: where the distance from the goal falls.

    The mean over the free pixels of a patch of 4 x 4, each with the weight of its label. Where two
    ways are about as good, it is the better one's or between both.

    Args:
        from_goal: geodesic distances D_g from the goal, (H, W) in pixels.
        label: see :func:`geodesic_label`.

    Returns:
        (2, H // 4, W // 4): unit vectors (u, v), u right and v down; 0 where nothing is known.

    Example:
        >>> from_goal = np.arange(4, dtype=np.float32)[None].repeat(4, axis=0)
        >>> travel_directions(from_goal, np.ones((4, 4), np.float32)).ravel().tolist()
        [-1.0, 0.0]
    """
    known = np.where(np.isfinite(from_goal), from_goal, np.float32(1e6))
    steps = []
    for axis in (1, 0):
        before = np.roll(known, 1, axis)
        after = np.roll(known, -1, axis)
        edge = (slice(None), 0) if axis else 0, (slice(None), -1) if axis else -1
        before[edge[0]] = after[edge[1]] = np.float32(1e6)
        fall = np.maximum(known - np.minimum(before, after), 0)
        steps.append(np.where(before < after, -fall, fall))
    vectors = np.stack(steps) * (known < 1e6)
    vectors = _unit(vectors) * label
    rows, columns = (n // DIRECTION_PATCH for n in label.shape)
    cut = vectors[:, : rows * DIRECTION_PATCH, : columns * DIRECTION_PATCH]
    blocks = cut.reshape(2, rows, DIRECTION_PATCH, columns, DIRECTION_PATCH)
    return _unit(blocks.sum(axis=(2, 4)))


def _unit(vectors: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return vectors (2, ...) of length 1; what is next to 0 becomes 0."""
    length = np.hypot(*vectors)
    unit = vectors / np.where(length > 1e-4, length, np.float32(np.inf))
    return np.asarray(unit, np.float32)
