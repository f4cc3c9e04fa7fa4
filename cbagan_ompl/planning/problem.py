"""A task on a map as OMPL sees it, and the check of what OMPL gives back."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import ConfigError, show
from ..maps.grid_map import GridMap
from . import compat
from .compat import ob, og
from .validity import GridMotionValidator, GridValidityChecker

#: Start and goal, as from :meth:`GridMap.check_task`.
Endpoints = tuple[NDArray[np.float64], NDArray[np.float64]]

_LEAST_THRESHOLD = float(np.finfo(np.float64).eps)

# Setters of every planner that set no parameter.
_NO_PARAMETERS = frozenset(
    {"setName", "setOptimizationObjective", "setProblemDefinition", "settings", "setup"}
)

# How near to the shortest cost the search for a shorter path ends, relative.
_OPTIMUM_SLACK = 1e-6

# Slack of the check that a path ends in the goal region, for the rounding of a distance.
_ROUNDING = 1e-9


def make_setup(grid: GridMap, endpoints: Endpoints, tolerance: float) -> Any:
    """Return a SimpleSetup with exact checks, start and goal, but no planner.

    Args:
        grid: the map.
        endpoints: start and goal, as from :meth:`GridMap.check_task`.
        tolerance: how far from the goal a path may end, world units.
    """
    space = compat.plane_space(*grid.bounds)
    setup = og.SimpleSetup(space)
    si = setup.getSpaceInformation()
    setup.setStateValidityChecker(GridValidityChecker(si, grid))
    si.setMotionValidator(GridMotionValidator(si, grid))
    start, goal = compat.new_state(space), compat.new_state(space)
    for state, point in ((start, endpoints[0]), (goal, endpoints[1])):
        state[0], state[1] = float(point[0]), float(point[1])
    # A goal is reached at less than its threshold; OMPL's own default is the least one as well.
    setup.setStartAndGoalStates(start, goal, max(float(tolerance), _LEAST_THRESHOLD))
    return setup


def set_range(planner: Any, range: float) -> bool:
    """Set the longest edge of a planner.

    Args:
        planner: an OMPL planner.
        range: the length, world units.

    Returns:
        Whether the planner has this parameter.
    """
    has_range = hasattr(planner, "setRange")
    if has_range:
        planner.setRange(float(range))
    return has_range


def stop_at_optimum(setup: Any, endpoints: Endpoints, tolerance: float) -> None:
    """Let planners of a setup end once no path can be shorter, by a millionth.

    SORRT* needs it. It makes samples that may shorten its path until it has a batch of them, and
    where the path is the straight line there are none: its solve would never return.

    Args:
        setup: whose planner has been set up, and has set the objective.
        endpoints: start and goal.
        tolerance: how far from the goal a path may end, world units.
    """
    shortest = max(float(np.hypot(*(endpoints[1] - endpoints[0]))) - tolerance, 0.0)
    _set_cost_threshold(setup, shortest * (1 + _OPTIMUM_SLACK))


def search_to_the_end(setup: Any) -> None:
    """Take :func:`stop_at_optimum` back: planners go on to their limits."""
    _set_cost_threshold(setup, 0.0)


def _set_cost_threshold(setup: Any, cost: float) -> None:
    objective = setup.getProblemDefinition().getOptimizationObjective()
    if objective is not None:
        objective.setCostThreshold(ob.Cost(cost))


def set_parameter(planner: Any, name: str, value: bool | float | str) -> None:
    """Set a parameter of a planner by the name of its setter.

    Args:
        planner: an OMPL planner.
        name: in lower case with underscores: ``rewire_factor`` calls ``setRewireFactor``,
            ``delay_cc`` calls ``setDelayCC``.
        value: what the setter is called with.

    Raises:
        ConfigError: the planner has no such setter, or the setter does not take the value.
    """
    setters = {
        setter.removeprefix("set").lower(): setter
        for setter in sorted(set(dir(planner)) - _NO_PARAMETERS)
        if setter.startswith("set")
    }
    kind = type(planner).__name__
    wanted = name.replace("_", "")
    if wanted not in setters:
        raise ConfigError(
            f"{kind} has no parameter {show(name)} to set; its setters are "
            f"{', '.join(setters.values())}"
        )
    try:
        getattr(planner, setters[wanted])(value)
    except Exception as error:  # whatever the bindings, and OMPL itself, raise
        raise ConfigError(
            f"{kind}.{setters[wanted]} does not take {show(value)} ({type(value).__name__})"
        ) from error


def checked_path(
    setup: Any, grid: GridMap, endpoints: Endpoints, tolerance: float
) -> NDArray[np.float64] | None:
    """Return the path that a setup has, (N, 2); None when it is no path of the task after all."""
    path = compat.path_positions(setup.getSolutionPath())
    at_start = np.array_equal(path[0], endpoints[0])
    at_goal = np.hypot(*(path[-1] - endpoints[1])) <= tolerance + _ROUNDING
    return path if at_start and at_goal and grid.path_is_free(path) else None


def path_length(path: NDArray[np.float64]) -> float:
    """Return the length of a path, (N, 2), world units."""
    return float(np.hypot(*np.diff(path, axis=0).T).sum())


def follow_path(path: NDArray[np.float64], step: float) -> NDArray[np.float64]:
    """Return points along a path, the way points among them.

    Args:
        path: way points, (N, 2), world.
        step: the longest distance between two points, world units.

    Returns:
        (M, 2), world; each segment is divided into equal steps.

    Example:
        >>> follow_path(np.array([[0.0, 0.0], [0.0, 1.0]]), 0.5).tolist()
        [[0.0, 0.0], [0.0, 0.5], [0.0, 1.0]]
    """
    counts = np.ceil(np.hypot(*np.diff(path, axis=0).T) / step).astype(int).clip(1)
    pieces = [
        np.linspace(start, end, count, endpoint=False)
        for start, end, count in zip(path[:-1], path[1:], counts.tolist(), strict=True)
    ]
    return np.vstack((*pieces, path[-1:]))
