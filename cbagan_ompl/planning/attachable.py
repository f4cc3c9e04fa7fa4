"""What can be attached: a SimpleSetup, geometric or of controls, or a planner with its task."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np

from ..errors import CbaganOmplWarning, PlannerError, TaskError, show
from ..sampling.heatmap import Heatmap
from . import compat
from .compat import ob, og
from .monitor import is_monitored
from .planner_kinds import is_control_setup, is_written_in_python, plans_controls
from .states import StateAccess


class BareSetup:
    """A planner and its problem definition, where a script has no SimpleSetup.

    It has those methods of a SimpleSetup that attachments use.

    Args:
        planner: an OMPL planner that has been given its problem definition.
    """

    def __init__(self, planner: Any) -> None:
        self._planner = planner

    def getPlanner(self) -> Any:  # noqa: N802
        """Return the planner."""
        return self._planner

    def getProblemDefinition(self) -> Any:  # noqa: N802
        """Return the problem definition of the planner."""
        return self._planner.getProblemDefinition()

    def getSpaceInformation(self) -> Any:  # noqa: N802
        """Return the space information of the planner."""
        return self._planner.getSpaceInformation()

    def getStateSpace(self) -> Any:  # noqa: N802
        """Return the state space of the planner."""
        return self.getSpaceInformation().getStateSpace()

    def getGoal(self) -> Any:  # noqa: N802
        """Return the goal of the problem definition."""
        return self.getProblemDefinition().getGoal()

    def setGoal(self, goal: Any) -> None:  # noqa: N802
        """Set the goal of the problem definition."""
        self.getProblemDefinition().setGoal(goal)


def setup_of(target: Any) -> Any:
    """Return the setup of what is to be attached.

    Args:
        target: a SimpleSetup, or a planner with its problem definition.

    Raises:
        PlannerError: it is neither.
    """
    if isinstance(target, ob.Planner):
        if target.getProblemDefinition() is None:
            raise PlannerError(
                "attach needs the planner's task: call planner.setProblemDefinition(...) first"
            )
        return BareSetup(target)
    if not (isinstance(target, og.SimpleSetup) or is_control_setup(target)):
        raise PlannerError(
            "attach takes a SimpleSetup of ompl.geometric or ompl.control with its planner, or a "
            f"planner with its problem definition, not {show(target)}"
        )
    return target


def planner_of(setup: Any) -> Any:
    """Return the planner of a setup.

    Args:
        setup: from :func:`setup_of`.

    Raises:
        PlannerError: there is none, one that no heat map can reach, or a control planner in a
            geometric setup or the other way round.
    """
    planner = setup.getPlanner()
    if planner is None:
        raise PlannerError("attach needs a planner: call setup.setPlanner(...) first")
    if setup.getPlanner() is not planner:
        # OMPL 1.x makes a new object at each call for a planner that C++ has made. One that was
        # set stays the same.
        setup.setPlanner(planner)
    if is_written_in_python(planner):
        raise PlannerError(
            f"{type(planner).__name__} is written in Python, so that it alone decides what it "
            "samples: let it take its samples from a HeatmapStateSampler(space, heatmap)"
        )
    if not isinstance(setup, BareSetup) and is_control_setup(setup) != plans_controls(planner):
        raise PlannerError(
            "planner and setup are not of one kind, one is of ompl.control and the other one of "
            "ompl.geometric: take both from the same module"
        )
    return planner


def warn_of_single_controls(planner: Any) -> None:
    """Warn if a planner tries one control for each sample, which then makes no difference.

    Args:
        planner: of ``ompl.control``.
    """
    si = planner.getSpaceInformation()
    if si.getStatePropagator() is None:
        return  # which its own setup complains of
    controls = si.allocDirectedControlSampler()
    if type(controls).__name__ != "SimpleDirectedControlSampler":
        return
    name = type(planner).__name__
    remedy = f"OMPL {compat.ompl_version()} lets Python set no other control sampler"
    if hasattr(controls, "getNumControlSamples"):
        if controls.getNumControlSamples() > 1:
            return
        remedy = (
            "si.setDirectedControlSamplerAllocator(...) with a SimpleDirectedControlSampler(si, 10)"
            " lets it try ten"
        )
    warnings.warn(
        CbaganOmplWarning(
            f"{name} takes its samples from the heat map, but tries a single control for each, so "
            f"that they make no difference: {remedy}; control.RRT is served as it is"
        ),
        stacklevel=3,
    )


def check_task(setup: Any, states: StateAccess) -> list[tuple[float, float]]:
    """Return the positions of the start states, or raise if a heat map cannot serve the task.

    Args:
        setup: from :func:`setup_of`, with its planner.
        states: access to the positions of its states.

    Raises:
        PlannerError: the start or the goal is missing, the goal cannot be sampled, or the planner
            is attached already.
    """
    problem, goal = setup.getProblemDefinition(), setup.getGoal()
    if goal is None or problem.getStartStateCount() == 0:
        raise PlannerError("attach needs the task: set the start and the goal of the setup first")
    if not isinstance(goal, ob.GoalSampleableRegion):
        raise PlannerError(
            "attach needs a goal that can be sampled, such as a GoalState or GoalStates, this one "
            f"is a {type(goal).__name__}"
        )
    if is_monitored(setup.getPlanner()):
        raise PlannerError(
            "this planner samples a heat map already: call detach() of its attachment first"
        )
    return compat.valid_starts(problem, setup.getSpaceInformation(), states.read)


def check_frames(starts: list[tuple[float, float]], heatmap: Heatmap) -> None:
    """Raise if the heat map and the task are not in the same coordinates.

    Args:
        starts: positions of the start states.
        heatmap: what is to be sampled.

    Raises:
        TaskError: no start is on free space of the heat map's map.
    """
    if starts and not heatmap.grid.is_free(np.array(starts)).any():
        _raise_frames(starts[0], heatmap)


def _raise_frames(start: tuple[float, float], heatmap: Heatmap) -> None:
    (left, low), (right, high) = heatmap.grid.bounds
    x, y = start
    is_inside = left <= x <= right and low <= y <= high
    where = "in an obstacle" if is_inside else "outside"
    raise TaskError(
        f"the start ({x:g}, {y:g}) is {where} of the heat map's map, which has x from {left:g} to "
        f"{right:g} and y from {low:g} to {high:g}: is one of them in pixels and the other one in "
        "metres, or turned over?"
    )
