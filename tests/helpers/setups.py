"""Setups of OMPL on a small map, ready to attach."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from cbagan_ompl import GridMap, Heatmap
from cbagan_ompl.planning import compat
from cbagan_ompl.planning.compat import og
from cbagan_ompl.planning.problem import make_setup
from cbagan_ompl.planning.workspace import Workspace

SMALL_START, SMALL_GOAL, TOLERANCE = (5.5, 5.5), (58.2, 58.3), 1.0


def small_walls() -> GridMap:
    """64 x 64, two walls with one gap each, on opposite sides."""
    free = np.ones((64, 64), np.bool_)
    free[20:24, :50] = False
    free[40:44, 14:] = False
    return GridMap(free, name="small_walls")


def small_setup(grid: GridMap, planner: str) -> Any:
    setup = make_setup(Workspace(grid), grid.check_task(SMALL_START, SMALL_GOAL), TOLERANCE)
    setup.setPlanner(getattr(og, planner)(setup.getSpaceInformation()))
    return setup


def small_heatmap(grid: GridMap) -> Heatmap:
    return Heatmap.corridor(grid, SMALL_START, SMALL_GOAL)


def solve_for(solver: Any, iterations: int) -> Any:
    """Let a setup or a planner solve for some evaluations of its termination condition."""
    count = iter(range(iterations))
    return solver.solve(compat.termination_condition(lambda: next(count, None) is None))


def path_positions(path: Any) -> NDArray[np.float64]:
    """The positions of a geometric path in the plane, (N, 2)."""
    return np.array([(state[0], state[1]) for state in path.getStates()])
