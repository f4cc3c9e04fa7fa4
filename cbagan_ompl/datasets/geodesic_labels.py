"""Exact labels of tasks, from the geodesic distances to start and goal."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

#: Relative detour at the border of the region, see :func:`geodesic_label`.
EPSILON = 0.05
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
        (H, W), from 0 to 1; 0 where a distance is infinite.

    Example:
        >>> from_start = np.array([[0, 1, 2]], np.float32)
        >>> geodesic_label(from_start, from_start[:, ::-1], (2, 0)).tolist()
        [[1.0, 1.0, 1.0]]
    """
    shortest = float(from_start[goal[1], goal[0]])
    detour = np.maximum(from_start + from_goal - np.float32(shortest), 0)
    label: NDArray[np.float32] = np.exp2(-detour / np.float32(epsilon * shortest + SLACK))
    return label
