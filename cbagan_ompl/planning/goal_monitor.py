"""Who asks the injected goal for samples: the planner that is attached, or somebody else.

Only the attached planner may get samples of the heat map. Anybody else who plans to the goal, or
shortens a path to it, would end in them, and must get the goal itself. A callback cannot see who
calls it, but it can see whether the attached planner is at work.
"""

from __future__ import annotations

import sys
from math import inf
from types import FrameType
from typing import Any

from ..errors import PlannerError
from .hooks import asks_in_thread
from .monitor import PlannerMonitor
from .planner_kinds import class_name
from .states import StateAccess

# The goal bias of RRT while it is not known whether it is RRT that asks. Below 1, so that its tree
# grows elsewhere than towards the goal, which tells.
_PROBING_BIAS = 0.5

# How often PRM asks how many samples there are before it asks for the first one.
_QUESTIONS_OF_PRM = 3

# Samples in a row that are taken unasked: more than whoever takes some by hand.
_MOST_UNASKED = 10**5

# Questions between two looks at the tree while it is somebody else who asks, at most.
_LONGEST_PAUSE = 256


class GoalMonitor(PlannerMonitor):
    """The monitor of a planner that goal injection reaches.

    Attributes:
        is_trusted: whether it is taken to be the planner that asks about nodes.
        nodes: how often somebody has asked about a node.
        counts_asked: how often somebody has asked how many samples there are since the last one.
    """

    is_trusted = True

    def __init__(self, setup: Any, states: StateAccess) -> None:
        super().__init__(setup, states)
        self.nodes = self.counts_asked = 0
        self._paths = 0
        self._is_other = False

    def is_sampling(self) -> bool:
        """Return whether it is the planner's main loop that asks how many samples there are.

        To be called by the callback of the goal itself.
        """
        raise NotImplementedError

    def takes_sample(self, caller: FrameType) -> bool:
        """Return whether it is the planner's main loop that asks for a sample.

        Args:
            caller: the frame that has called OMPL.
        """
        raise NotImplementedError

    def note_other(self) -> None:
        """Note a question that the planner never asks, the first one of some other planners.

        Raises:
            PlannerError: another planner is set in the setup, one that cannot plan to a goal that
                is written in Python.
        """
        self._is_other, self.counts_asked = True, 0
        current = None if self._setup is None else self._setup.getPlanner()
        if current is not self._planner and asks_in_thread(class_name(current)):
            raise _threaded(class_name(current))

    def note_reached(self) -> None:
        """Note that a node is in the goal."""

    def check_asker(self) -> None:
        """Raise if a planner asks for a sample that cannot plan to a goal written in Python.

        Raises:
            PlannerError: of the planners that the setup does not know of, PRM is told by its
                questions.
        """
        is_prm = self._is_other and self.counts_asked >= _QUESTIONS_OF_PRM
        self._is_other = False
        if is_prm and self._planner is not None and self._setup.getPlanner() is self._planner:
            raise _threaded("PRM")

    def _note_call(self, caller: FrameType) -> None:
        self._paths_at_call = self._paths
        self._call = caller.f_code, id(caller), caller.f_lasti


def _threaded(planner: str) -> PlannerError:
    return PlannerError(
        f"{planner} asks its goal from a thread of its own, and this goal samples a heat map for "
        "another planner: call detach() of its attachment first"
    )


class IterationMonitor(GoalMonitor):
    """The monitor of RRT*-like planners, which count their iterations.

    They ask how many samples there are in each iteration, from 1 on, and take at most one sample.
    Informed samplers that are being built ask before the first iteration; the path is there when
    the main loop has ended.
    """

    def __init__(self, setup: Any, states: StateAccess) -> None:
        super().__init__(setup, states)
        self._sampled_iteration = self._asked_iteration = 0

    def is_sampling(self) -> bool:
        """Return whether it is the planner's main loop that asks how many samples there are."""
        if self._planner is None:
            return False
        iteration, paths = self._planner.numIterations(), self._problem.getSolutionCount()
        if iteration != self._asked_iteration:
            self._asked_iteration, self._paths = iteration, paths
        return iteration not in (0, self._sampled_iteration) and paths == self._paths

    def takes_sample(self, caller: FrameType) -> bool:
        """Return whether it is the planner's main loop that asks for a sample."""
        takes = self.is_sampling()
        self._sampled_iteration = self._asked_iteration
        if takes:
            self._note_call(caller)
        return takes

    def note_other(self) -> None:
        """Note a question that the planner never asks: its iteration is over."""
        super().note_other()
        if self._planner is not None:
            self._sampled_iteration = self._asked_iteration = self._planner.numIterations()


class TreeMonitor(GoalMonitor):
    """The monitor of RRT, which counts nothing: whether it is at work is told by its tree.

    RRT asks once how many samples there are before each sample that it takes, and ends with its
    first node in the goal. Whatever does not fit ends the trust: another question, a new path, a
    new planner in the setup, a new call of OMPL. Trust comes back once the tree is seen to have
    grown, or to be new. Until then the goal is handed out, and RRT samples on its own half of the
    time.
    """

    def __init__(self, setup: Any, states: StateAccess) -> None:
        super().__init__(setup, states)
        self.is_trusted = False
        self._is_set = True  # in the setup
        # Nodes of the tree when it was last looked at without trust; None before that.
        self._seen: int | None = None
        # What to add to the questions about nodes for the nodes of the tree, and how many questions
        # there had been when the planner last asked for a sample. A tree with less is a new one, as
        # the first one is.
        self._offset, self._nodes_at_ask = inf, 0
        self._is_probing = False
        self._pause = self._left = self._unasked = 0

    def is_sampling(self) -> bool:
        """Return whether it is the planner's main loop that asks how many samples there are."""
        if self._planner is None:
            return False
        caller = sys._getframe(2)
        call = caller.f_code, id(caller), caller.f_lasti
        paths = self._problem.getSolutionCount()
        is_set = self._setup.getPlanner() is self._planner
        if call != self._call or paths != self._paths or is_set != self._is_set:
            self._call, self._is_set = call, is_set
            self._paths = self._paths_at_call = paths
            self._distrust()
        elif self.counts_asked != 1 and self.is_trusted:
            self._distrust()
        if self.is_trusted or self._looks_at_work():
            self._nodes_at_ask = self.nodes
            return True
        return False

    def takes_sample(self, caller: FrameType) -> bool:
        """Return whether it is the planner's main loop that asks for a sample."""
        if self._planner is None:
            return False
        if self.counts_asked == 0:
            self._distrust()
            self._check_unasked()
        if self.is_trusted:
            self._paths_at_call = self._paths
        return self.is_trusted

    @property
    def has_solution(self) -> bool:
        """Whether RRT goes on after a solution: never."""
        return False

    def best_cost(self) -> float:
        """Return infinity: RRT does not tell the cost of its solution, and ends with it."""
        return inf

    def note_other(self) -> None:
        """Note a question that the planner never asks."""
        super().note_other()
        self._distrust()

    def note_reached(self) -> None:
        """Note that a node is in the goal, which ends the main loop of RRT."""
        self._distrust()

    def set_injected_fraction(self, fraction: float) -> None:
        """Leave all but a fraction of the samples to the planner's own sampler."""
        if self._is_probing:
            self.injected_fraction = fraction
        else:
            super().set_injected_fraction(fraction)

    def _check_unasked(self) -> None:
        """Raise rather than hand out samples for ever.

        Informed samplers ask once, when they are built, and take all samples that there are.
        """
        self._unasked += 1
        if self._unasked > _MOST_UNASKED + self._goal.maxSampleCount():
            self._unasked = 0
            raise PlannerError(
                "another planner takes all samples of a goal that samples a heat map: call "
                "detach() of its attachment before another planner plans to it"
            )

    def _distrust(self) -> None:
        self.is_trusted, self._seen = False, None
        self._pause = self._left = 0

    def _looks_at_work(self) -> bool:
        """Look at the tree, less and less often in vain."""
        if self._left > 0:
            self._left -= 1
            return False
        nodes = self.node_count()
        if self._seen is None:
            # Of the questions about nodes, those after the last sample may be somebody else's.
            is_new = nodes < self._offset + self._nodes_at_ask
            self.is_trusted = nodes > 0 and is_new
        else:
            self.is_trusted = 0 < nodes != self._seen
        self._seen = nodes
        if self.is_trusted:
            self._offset = nodes - self.nodes
        else:
            self._left = self._pause
            self._pause = min(2 * self._pause + 1, _LONGEST_PAUSE, nodes)
        self._set_probing(not self.is_trusted)
        return self.is_trusted

    def _set_probing(self, is_probing: bool) -> None:
        if is_probing != self._is_probing:
            self._is_probing = is_probing
            bias = _PROBING_BIAS if is_probing else self.injected_fraction
            self._planner.setGoalBias(bias)


def goal_monitor(setup: Any, states: StateAccess) -> GoalMonitor:
    """Return the monitor that fits a planner; arguments as for :class:`PlannerMonitor`."""
    counts_iterations = hasattr(setup.getPlanner(), "numIterations")
    return (IterationMonitor if counts_iterations else TreeMonitor)(setup, states)
