"""Several goals of one plan, any of which will do."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..maps.grid_map import GridMap
from ..sampling.heatmap import Heatmap
from . import compat
from .compat import ob
from .heatmap_sources import HeatmapSource
from .workspace import Workspace


def split_goals(goal: Any) -> list[ArrayLike]:
    """Return the goals that are meant, which may still be no points.

    Args:
        goal: one position or pose, or a sequence of them.

    Example:
        >>> split_goals((1.0, 2.0)), split_goals([(1.0, 2.0), (3.0, 4.0)])
        ([(1.0, 2.0)], [(1.0, 2.0), (3.0, 4.0)])
    """
    try:
        is_sequence = np.ndim(goal) == 2 and len(goal) > 0
    except Exception:  # rows of different lengths, or whatever the class raises
        is_sequence = False
    return list(goal) if is_sequence else [goal]


def set_goals(
    setup: Any, workspace: Workspace, goals: Sequence[NDArray[np.float64]], threshold: float
) -> None:
    """Give a setup several goals.

    Args:
        setup: of the workspace.
        workspace: the robot on its map.
        goals: positions (2,) or poses (3,).
        threshold: how near to one of them a path has to end, world units.
    """
    states = ob.GoalStates(setup.getSpaceInformation())
    states.setThreshold(threshold)
    for goal in goals:
        state = workspace.make_state(setup.getStateSpace(), goal)
        states.addState(state)
    setup.setGoal(states)


def heatmap_of_goals(
    source: HeatmapSource,
    grid: GridMap,
    start: NDArray[np.float64],
    goals: Sequence[NDArray[np.float64]],
) -> Heatmap:
    """Return the heat map of several goals: the largest of the values of each one's.

    Args:
        source: makes the heat map of one goal.
        grid: the map.
        start: position (2,), world.
        goals: positions (2,), world, one at least.
    """
    single = [source(grid, start, goal) for goal in goals]
    if len(single) == 1:
        return single[0]
    return Heatmap(np.maximum.reduce([heatmap.values for heatmap in single]), grid)


def reached_goal(
    setup: Any, workspace: Workspace, goals: Sequence[NDArray[np.float64]]
) -> NDArray[np.float64]:
    """Return the goal that the path of a setup ends nearest to.

    Args:
        setup: of the workspace, solved.
        workspace: the robot on its map.
        goals: positions (2,) or poses (3,).
    """
    space = setup.getStateSpace()
    states = setup.getSolutionPath().getStates()
    end = workspace.make_state(space, workspace.read_states(space, states)[-1])

    def distance(goal: NDArray[np.float64]) -> float:
        state = workspace.make_state(space, goal)
        return float(space.distance(compat.typed_state(end), compat.typed_state(state)))

    return min(goals, key=distance)
