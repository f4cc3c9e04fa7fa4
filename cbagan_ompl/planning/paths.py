"""The paths that OMPL gives back: checked again, measured and followed."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .compat import new_state, typed_state
from .states import state_access
from .workspace import Endpoints, Workspace

# Slack of the check that a path ends in the goal region, for the rounding of a distance.
_ROUNDING = 1e-9


def checked_path(
    setup: Any, workspace: Workspace, endpoints: Endpoints, tolerance: float
) -> NDArray[np.float64] | None:
    """Return the path that a setup has, or None when it is no path of the task after all.

    Args:
        setup: from :func:`.problem.make_setup`, solved.
        workspace: the robot on its map.
        endpoints: start and goal.
        tolerance: how far from the goal a path may end, world units.

    Returns:
        Positions (N, 2) or poses (N, 3), world.
    """
    space = setup.getStateSpace()
    path = workspace.read_states(space, setup.getSolutionPath().getStates())
    goal = workspace.make_state(space, endpoints[1])
    end = workspace.make_state(space, path[-1])
    at_start = np.array_equal(path[0], endpoints[0])
    at_goal = float(space.distance(typed_state(end), typed_state(goal))) <= tolerance + _ROUNDING
    return path if at_start and at_goal and workspace.is_free(setup, path) else None


def path_cost(setup: Any, workspace: Workspace, path: NDArray[np.float64]) -> float:
    """Return the length of a path, world units: as OMPL measures it for robots with heading.

    In SE(2) half of each turn in radians counts as well.

    Args:
        setup: whose space is that of the path.
        workspace: the robot on its map.
        path: from :func:`checked_path`.
    """
    if not workspace.robot.has_heading:
        return float(np.hypot(*np.diff(path, axis=0).T).sum())
    space = setup.getStateSpace()
    states = [workspace.make_state(space, pose) for pose in path]
    return sum(float(space.distance(typed_state(a), typed_state(b))) for a, b in pairwise(states))


def follow_path(
    setup: Any, workspace: Workspace, path: NDArray[np.float64], step: float
) -> NDArray[np.float64]:
    """Return states along a path, its way points among them.

    Args:
        setup: whose space is that of the path.
        workspace: the robot on its map.
        path: from :func:`checked_path`.
        step: the farthest that any point of the robot moves between two states, world units.

    Returns:
        Positions (M, 2) or poses (M, 3), world; each motion is divided into equal steps.
    """
    if not len(path):
        return path
    if not workspace.robot.has_heading:
        return divide_segments(path, step)
    space = setup.getStateSpace()
    states = [workspace.make_state(space, endpoint) for endpoint in path]
    passed, read = new_state(space), state_access(space).read_pose
    points = [path[0]]
    for (start, end), way_point in zip(pairwise(states), path[1:], strict=True):
        count = int(np.ceil(workspace.reach_of_motion(space, start, end) / step))
        for i in range(1, count):
            space.interpolate(typed_state(start), typed_state(end), i / count, typed_state(passed))
            points.append(np.array(read(typed_state(passed))))
        points.append(way_point)
    return np.array(points)


def divide_segments(path: NDArray[np.float64], step: float) -> NDArray[np.float64]:
    """Return points along a polyline, its corners among them.

    Args:
        path: corners, (N, 2), world.
        step: the longest distance between two points, world units.

    Returns:
        (M, 2), world; each segment is divided into equal steps.

    Example:
        >>> divide_segments(np.array([[0.0, 0.0], [0.0, 1.0]]), 0.5).tolist()
        [[0.0, 0.0], [0.0, 0.5], [0.0, 1.0]]
    """
    moves = np.diff(path, axis=0)
    counts = np.ceil(np.hypot(*moves.T) / step).astype(int).clip(1)
    # Of each point: its segment, and which step of it.
    segments = np.repeat(np.arange(len(counts)), counts)
    steps = np.arange(len(segments)) - np.repeat(counts.cumsum() - counts, counts)
    fractions = (steps / counts[segments])[:, None]
    return np.vstack((path[segments] + fractions * moves[segments], path[-1:]))
