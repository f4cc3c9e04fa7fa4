"""What callbacks may know of the planner that calls them, and what they note of it."""

from __future__ import annotations

import atexit
import sys
from math import inf
from threading import get_ident
from time import perf_counter
from types import CodeType, FrameType
from typing import Any, TypeAlias

import numpy as np

from ..errors import PlannerError
from ..sampling.heatmap import Heatmap
from ..sampling.informed_set import InformedSet
from .awaited import AwaitedHeatmap
from .compat import best_cost, new_state, ob, planner_data, start_states, typed_state
from .solution_cost import SolutionCost
from .solve_watch import SolveWatch
from .states import StateAccess, is_distance_bound

# Positions (x, y).
_Points: TypeAlias = list[tuple[float, float]]

# A goal region without end is represented by this many samples of it in the informed set.
_MAX_GOALS = 100


class PlannerMonitor:
    """The state of a planner, read through the only references that callbacks have to it.

    A callback that refers to its planner closes a reference cycle through C++, which no garbage
    collector sees. :meth:`release` cuts it: when the planner is detached, when another one is
    attached or solves and nobody else refers to this one and its setup any more
    (:func:`release_forgotten`), and at interpreter exit, because OMPL 2.0 reports every object
    that is left.

    Attributes:
        injected_fraction: fraction of the planner's samples that it asks the goal for.

    Args:
        setup: a SimpleSetup with its planner and its own goal.
        states: access to the positions of its states.
    """

    def __init__(self, setup: Any, states: StateAccess) -> None:
        self._setup = setup
        self._planner = setup.getPlanner()
        self._problem = setup.getProblemDefinition()
        self._goal = setup.getGoal()
        self._states = states
        self._is_informed = is_informed(self._planner)
        tells_cost = hasattr(self._planner, "numIterations")
        self._cost = SolutionCost(self._problem) if tells_cost else None
        self.injected_goal: Any = None
        self.injected_fraction = 1.0
        # Endpoints of which it is known whether the heat map connects them.
        self._known: tuple[object, bool] = None, False
        self._call: tuple[CodeType, int, int] | None = None
        self._paths_at_call = 0
        self._watches: list[SolveWatch] = []
        self._awaited: AwaitedHeatmap | None = None

    def note_call(self, caller: FrameType) -> None:
        """Note that OMPL asks for a sample, for :meth:`is_planning`.

        Args:
            caller: the frame that has called OMPL.
        """
        if self._problem is not None:
            self._paths_at_call = self._problem.getSolutionCount()
            self._call = caller.f_code, id(caller), caller.f_lasti

    def is_planning(self, caller: FrameType | None) -> bool:
        """Return whether the planner is in the middle of a solve.

        That of the setup is watched. Of others, such as the planner's own on OMPL 2.0, OMPL does
        not tell. But a frame that has called OMPL, which has asked for a sample, stands at that
        call until it returns. Paths are added at the end of a solve alone.

        Args:
            caller: the frame that wants to know; it has called Python, not OMPL.
        """
        if self._is_solving:
            return True
        if self._call is None or self._problem.getSolutionCount() != self._paths_at_call:
            return False
        stacks: dict[int, FrameType | None] = {**sys._current_frames()}
        stacks[get_ident()] = None if caller is None else caller.f_back
        for frame in stacks.values():
            while frame is not None:
                if self._call == (frame.f_code, id(frame), frame.f_lasti):
                    return True
                frame = frame.f_back
        return False

    @property
    def _is_solving(self) -> bool:
        return any(watch.is_solving for watch in self._watches)

    @property
    def has_planned(self) -> bool:
        """Whether a solve has returned or the planner has asked for a sample, as far as is seen."""
        return self._call is not None or any(watch.has_solved for watch in self._watches)

    @property
    def has_solution(self) -> bool:
        """Whether a planner that goes on after its first solution has found it."""
        return self.best_cost() < inf

    def best_cost(self) -> float:
        """Return the cost of the best solution, see :class:`SolutionCost`.

        It is always infinite for planners that do not tell it; they stop at their first solution.
        """
        return inf if self._cost is None else self._cost.best(self._planner.bestCost())

    def informed_set(self) -> InformedSet | None:
        """Return the informed set of the task, once the planner has begun to plan.

        It is None for planners that are not informed, and where costs are no path lengths, or
        lengths that may be below those of the positions: these are the lower bound.
        """
        objective = self._problem.getOptimizationObjective()
        is_length = isinstance(objective, ob.PathLengthOptimizationObjective)
        is_bounded = is_length and is_distance_bound(self._setup.getStateSpace())
        return self._endpoints() if self._is_informed and is_bounded else None

    def connects(self, heatmap: Heatmap) -> bool:
        """Return whether a region connects a start with a goal, once planning has begun."""
        return self._connects(heatmap, self._starts(), self._goals())

    def prepare(self, heatmap: Heatmap, starts: _Points) -> None:
        """Find out beforehand what :meth:`connects` will ask, where the task is a plain one.

        Args:
            heatmap: what is sampled.
            starts: positions of the start states.
        """
        if len(starts) == 1 and isinstance(self._goal, ob.GoalState):
            self._connects(heatmap, starts, self._goals())

    def _connects(self, heatmap: Heatmap, starts: _Points, goals: _Points) -> bool:
        if not goals:
            return True  # a goal that has no samples yet can be anywhere
        if self._known[0] != (starts, goals):
            found = any(heatmap.connects(start, goal) for start in starts for goal in goals)
            self._known = (starts, goals), found
        return self._known[1]

    def node_count(self) -> int:
        """Return the number of nodes of the tree."""
        return 0 if self._planner is None else int(planner_data(self._planner).numVertices())

    def set_injected_fraction(self, fraction: float) -> None:
        """Leave all but a fraction of the samples to the planner's own sampler."""
        self.injected_fraction = fraction
        if self._planner is not None:
            self._planner.setGoalBias(fraction)

    @property
    def setup(self) -> Any:
        """The setup of the planner; None once it was let go of."""
        return self._setup

    def node_positions(self) -> list[tuple[float, float]]:
        """Return the (x, y) of the nodes of the planner's tree, world."""
        if self._planner is None:
            return []
        data, read = planner_data(self._planner), self._states.read
        return [read(data.getVertex(i).getState()) for i in range(data.numVertices())]

    def register(self, awaited: AwaitedHeatmap | None = None) -> None:
        """Let :func:`is_monitored` and the interpreter's exit know of this monitor.

        Args:
            awaited: the heat map that is waited for, whose failure a solve raises at its end.
        """
        _attached.add(self)
        self._awaited = awaited
        targets = [one for one in (self._setup, self._planner) if hasattr(one, "solve")]
        after = _do_nothing if awaited is None else awaited.raise_failure
        self._watches = [SolveWatch(target, self._begin_solve, after) for target in targets]

    def _begin_solve(self) -> None:
        release_forgotten()
        self.check_goal()

    def check_goal(self) -> None:
        """Raise if the goal was replaced: the planner would sample nothing but the new one.

        Raises:
            PlannerError: it was, and the planner samples its goal; see :class:`InjectedGoal`.
        """
        if self._problem is None or self.injected_goal is None:
            return
        is_set = self._setup.getPlanner() is self._planner
        if is_set and self._problem.getGoal() is not self.injected_goal:
            raise PlannerError(
                "the goal was replaced while the planner samples a heat map for another one: call "
                "detach() of its attachment, and attach again, with a heat map of the new task"
            )

    def refers_to(self, planner: Any) -> bool:
        """Return whether this is the monitor of a planner."""
        return self._planner is planner

    def is_forgotten(self) -> bool:
        """Return whether nothing but this monitor and OMPL refers to the setup and its planner."""
        # Each count includes the argument of the call. The setup holds the planner.
        return (
            self._setup is not None
            and not self._is_solving
            and sys.getrefcount(self._setup) <= 2 + self._watch_references(self._setup)
            and sys.getrefcount(self._planner) <= 3 + self._watch_references(self._planner)
        )

    def _watch_references(self, target: Any) -> int:
        return sum(watch.references_to(target) for watch in self._watches)

    @property
    def is_released(self) -> bool:
        """Whether the planner was let go of."""
        return self._planner is None

    def release(self) -> None:
        """Let go of the planner and its task."""
        for watch in self._watches:
            watch.release()
        self._watches = []
        if self._awaited is not None:
            self._awaited.release()
        self._planner = self._problem = self._goal = self._setup = self._call = None
        self._cost = self.injected_goal = None
        _attached.discard(self)

    def _endpoints(self) -> InformedSet:
        starts, goals = np.array(self._starts()), np.array(self._goals())
        return InformedSet(starts, goals, self._goal.getThreshold())

    def _starts(self) -> _Points:
        """Return positions of the start states, once the planner has begun to plan."""
        return [self._states.read(start) for start in start_states(self._planner)]

    def _goals(self) -> _Points:
        """Return positions of goal states, sampled from the goal."""
        state = new_state(self._planner.getSpaceInformation().getStateSpace())
        typed = typed_state(state)
        goals = []
        for _ in range(min(self._goal.maxSampleCount(), _MAX_GOALS)):
            self._goal.sampleGoal(typed)
            goals.append(self._states.read(typed))
        return goals


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
    return any(monitor.refers_to(planner) for monitor in _attached.copy())


def release_forgotten() -> None:
    """Let go of the planners that nobody can use any more: their setups are forgotten.

    Python's garbage collector would be the place for it, but an interrupt that arrives in one of
    its callbacks is lost.
    """
    for monitor in _attached.copy():
        if monitor.is_forgotten():
            monitor.release()


def _do_nothing() -> None:
    pass


# Monitors that are registered and not released. No weak set: an interrupt that arrives while
# Python removes a dead element from it is lost, too.
_attached: set[PlannerMonitor] = set()


@atexit.register
def _release_all() -> None:
    for monitor in _attached.copy():
        monitor.release()
