"""A task as OMPL sees it, and the parameters of planners."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..errors import ConfigError, show
from .compat import ob, og
from .workspace import Endpoints, Workspace

_LEAST_THRESHOLD = float(np.finfo(np.float64).eps)

# OMPL's range of a planner that was given none, as a fraction of the extent of the space.
_OMPL_RANGE = 0.2

# Setters of every planner that set no parameter.
_NO_PARAMETERS = frozenset(
    {"setName", "setOptimizationObjective", "setProblemDefinition", "settings", "setup"}
)

# How near to the shortest cost the search for a shorter path ends, relative.
_OPTIMUM_SLACK = 1e-6

# Paths this short, as a fraction of the distance of start and goal, are not made shorter: they are
# found where the start is in the goal region already, or nearly.
_NEGLIGIBLE_FRACTION = 1e-2


def make_setup(workspace: Workspace, endpoints: Endpoints, tolerance: float) -> Any:
    """Return a SimpleSetup with exact checks, start and goal, but no planner.

    Args:
        workspace: the robot on its map.
        endpoints: start and goal, as from :meth:`.workspace.Workspace.check_task`.
        tolerance: how far from the goal a path may end, world units.
    """
    space = workspace.make_space()
    setup = og.SimpleSetup(space)
    si = setup.getSpaceInformation()
    checker, motions = workspace.make_checks(si)
    setup.setStateValidityChecker(checker)
    si.setMotionValidator(motions)
    start, goal = (workspace.make_state(space, endpoint) for endpoint in endpoints)
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


def range_of(planner: Any) -> float:
    """Return how far a planner extends its tree at most, world units.

    Before its setup a planner may have no range yet; OMPL then takes a fraction of the space.

    Args:
        planner: an OMPL planner.
    """
    range = planner.getRange() if hasattr(planner, "getRange") else 0.0
    return float(range or _OMPL_RANGE * planner.getSpaceInformation().getMaximumExtent())


def stop_at_optimum(setup: Any, endpoints: Endpoints, tolerance: float) -> None:
    """Let planners of a setup end once no path can be shorter, by a millionth.

    SORRT* needs it. It makes samples that may shorten its path until it has a batch of them, and
    where the path is the straight line there are none: its solve would never return. Where the
    start is nearly in the goal region there are few, and it would go on far beyond its time.

    Args:
        setup: whose planner has been set up, and has set the objective.
        endpoints: start and goal.
        tolerance: how far from the goal a path may end, world units.
    """
    distance = float(np.hypot(*(endpoints[1] - endpoints[0])[:2]))
    shortest = max(distance - tolerance, 0.0)
    _set_cost_threshold(
        setup, max(shortest * (1 + _OPTIMUM_SLACK), distance * _NEGLIGIBLE_FRACTION)
    )


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
