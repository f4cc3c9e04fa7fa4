"""What callbacks may know of the planner that calls them, and what they note of it."""

from __future__ import annotations

import atexit
import weakref
from math import inf
from time import perf_counter
from typing import Any

import numpy as np

from ..sampling.heatmap import Heatmap
from ..sampling.informed_set import InformedSet
from .compat import best_cost, new_state, ob, planner_data, start_states, typed_state
from .states import StateAccess

# A goal region without end is represented by this many samples of it in the informed set.
_MAX_GOALS = 100


class PlannerMonitor:
    """The state of a planner, read through the only references that callbacks have to it.

    A callback that refers to its planner closes a reference cycle through C++, which no garbage
    collector sees. :meth:`release` cuts it; at interpreter exit all are cut, because OMPL 2.0
    reports every object that is left.

    Attributes:
        injected_fraction: fraction of the planner's samples that it asks the goal for.

    Args:
        setup: a SimpleSetup with its planner and its own goal.
        states: access to the positions of its states.
    """

    def __init__(self, setup: Any, states: StateAccess) -> None:
        self._planner = setup.getPlanner()
        self._problem = setup.getProblemDefinition()
        self._goal = setup.getGoal()
        self._states = states
        self._is_informed = is_informed(self._planner)
        self._counts_iterations = hasattr(self._planner, "numIterations")
        self._last_iteration = self._asked_iteration = self._paths = 0
        self.injected_fraction = 1.0

    def is_sampling(self) -> bool:
        """Return whether the planner's main loop asks for a goal, rather than OMPL around it.

        An informed sampler that is being built, and the path simplifier, ask the goal for samples
        as well, and must get the goal itself. RRT*-like planners count iterations, ask how many
        samples there are in each, from 1 on, and take at most one; their path is there when their
        loop has ended. The others stop at their first solution.
        """
        if self._planner is None:
            return False
        if self._counts_iterations:
            iteration, paths = self._planner.numIterations(), self._problem.getSolutionCount()
            if iteration != self._asked_iteration:
                self._asked_iteration, self._paths = iteration, paths
            return iteration not in (0, self._last_iteration) and paths == self._paths
        # A solution may be older than the tree, after the planner alone was cleared.
        return not (
            self._problem.hasExactSolution() and planner_data(self._planner).numGoalVertices()
        )

    def note_sample(self) -> None:
        """Remember the iteration that has had its sample."""
        if self._counts_iterations and self._planner is not None:
            self._last_iteration = self._planner.numIterations()

    @property
    def has_solution(self) -> bool:
        """Whether a planner that goes on after its first solution has found it."""
        return self.best_cost() < inf

    def best_cost(self) -> float:
        """Return the cost of the best solution, infinite before there is one.

        It is always infinite for planners that do not tell it; they stop at their first solution.
        """
        if self._planner is None or not self._counts_iterations:
            return inf
        return best_cost(self._planner)

    def informed_set(self) -> InformedSet | None:
        """Return the informed set of the task, once the planner has begun to plan.

        It is None for planners that are not informed, and where costs are no path lengths.
        """
        objective = self._problem.getOptimizationObjective()
        is_length = isinstance(objective, ob.PathLengthOptimizationObjective)
        return self._endpoints() if self._is_informed and is_length else None

    def connects(self, heatmap: Heatmap) -> bool:
        """Return whether a region connects a start with a goal, once planning has begun."""
        endpoints = self._endpoints()
        return any(
            heatmap.connects(start, goal) for start in endpoints.starts for goal in endpoints.goals
        )

    def node_count(self) -> int:
        """Return the number of nodes of the tree."""
        return 0 if self._planner is None else int(planner_data(self._planner).numVertices())

    def set_injected_fraction(self, fraction: float) -> None:
        """Leave all but a fraction of the samples to the planner's own sampler."""
        self.injected_fraction = fraction
        if self._planner is not None:
            self._planner.setGoalBias(fraction)

    def register(self) -> None:
        """Let :func:`is_monitored` and the interpreter's exit know of this monitor."""
        _alive.add(self)

    def refers_to(self, planner: Any) -> bool:
        """Return whether this is the monitor of a planner."""
        return self._planner is planner

    def release(self) -> None:
        """Let go of the planner and its task."""
        self._planner = self._problem = self._goal = None

    def _endpoints(self) -> InformedSet:
        state = new_state(self._planner.getSpaceInformation().getStateSpace())
        typed = typed_state(state)
        goals = []
        for _ in range(min(self._goal.maxSampleCount(), _MAX_GOALS)):
            self._goal.sampleGoal(typed)
            goals.append(self._states.read(typed))
        starts = [self._states.read(start) for start in start_states(self._planner)]
        return InformedSet(np.array(starts), np.array(goals), self._goal.getThreshold())


class CostHistory:
    """Each better solution of a planner, with the time at which it was seen.

    Attributes:
        costs: (seconds since the history began, cost); stays empty for planners that do not tell
            the cost of their best solution.

    Args:
        planner: an OMPL planner, about to plan.
    """

    def __init__(self, planner: Any) -> None:
        self.costs: list[tuple[float, float]] = []
        self._planner = planner if hasattr(planner, "bestCost") else None
        self._best = inf
        self._began = perf_counter()

    def look(self) -> float:
        """Note the best cost if it is a better one; return the seconds since the history began."""
        elapsed = perf_counter() - self._began
        if self._planner is not None and (cost := best_cost(self._planner)) < self._best:
            self._best = cost
            self.costs.append((elapsed, cost))
        return elapsed


def is_informed(planner: Any) -> bool:
    """Return whether a planner samples the informed set once it has a path."""
    return bool(hasattr(planner, "getInformedSampling") and planner.getInformedSampling())


def is_monitored(planner: Any) -> bool:
    """Return whether callbacks refer to a planner at the moment."""
    return any(monitor.refers_to(planner) for monitor in _alive)


_alive: weakref.WeakSet[PlannerMonitor] = weakref.WeakSet()


@atexit.register
def _release_all() -> None:
    for monitor in list(_alive):
        monitor.release()
