"""Labels of the CBAGAN-RRT paper: where the paths of many runs of RRT pass.

The paper is "CBAGAN-RRT: Convolutional Block Attention Generative Adversarial Network for
Sampling-Based Path Planning", https://arxiv.org/abs/2305.10442.
"""

from __future__ import annotations

from itertools import count, repeat

import numpy as np
from numpy.typing import NDArray

from ..maps.grid_map import GridMap
from ..planning import compat
from ..planning.compat import og, ou
from ..planning.paths import checked_path
from ..planning.problem import make_setup
from ..planning.workspace import Endpoints, Workspace

# A path passes a pixel when one of its points that lie this far apart does, in pixels.
_SPACING = 0.25


def rrt_region(
    grid: GridMap, task: Endpoints, runs: int, range: float, iterations: int, seed: int
) -> NDArray[np.bool_]:
    """Return the pixels that the paths of some runs of OMPL's RRT pass.

    RRT is that of S. M. LaValle, "Rapidly-exploring random trees: a new tool for path planning",
    1998.

    Args:
        grid: the map.
        task: start and goal, as from :meth:`GridMap.check_task`.
        runs: of RRT, each with a tree of its own.
        range: longest edge of a tree, in world units.
        iterations: limit of each run; a run that finds no path by then adds nothing.
        seed: at least 0; the same seed gives the same region.

    Returns:
        (H, W), true where a path passes; false everywhere when no run found one.
    """
    workspace, tolerance = Workspace(grid), grid.resolution
    region = np.zeros(grid.shape, dtype=np.bool_)
    with compat.log_level(ou.LOG_ERROR):
        compat.seed_ompl(seed)
        setup = make_setup(workspace, task, tolerance)
        for _ in repeat(None, runs):
            planner = og.RRT(setup.getSpaceInformation())
            planner.setRange(float(range))
            setup.setPlanner(planner)
            setup.clear()
            if compat.is_exact(setup.solve(_stop_after(iterations))):
                path = checked_path(setup, workspace, task, tolerance)
                if path is not None:
                    columns, rows = _path_pixels(grid.to_pixel(path)).T
                    region[rows, columns] = True
    return region


def _stop_after(iterations: int) -> object:
    """Return a termination condition that holds after some iterations."""
    steps = count(1)
    return compat.termination_condition(lambda: next(steps) > iterations)


def _path_pixels(path: NDArray[np.float64]) -> NDArray[np.intp]:
    """Return the pixels (column, row) that a path passes, (N, 2) in pixels -> (M, 2)."""
    lengths = np.hypot(*np.diff(path, axis=0).T)
    along = np.concatenate(([0.0], lengths.cumsum()))
    positions = np.linspace(0, along[-1], max(2, int(np.ceil(along[-1] / _SPACING)) + 1))
    points = np.stack([np.interp(positions, along, axis) for axis in path.T], axis=-1)
    pixels: NDArray[np.intp] = np.floor(points).astype(np.intp)
    return pixels
