"""Who asks the injected goal for samples: the planner that is attached, or somebody else.

Only the attached planner may get samples of the heat map. Anybody else who plans to the goal, or
shortens a path to it, would end in them, and must get the goal itself. A callback cannot see who
calls it, but it can see whether the attached planner is at work.
"""

from __future__ import annotations

from types import FrameType
from typing import Any

from .compat import planner_data
from .monitor import PlannerMonitor
from .states import StateAccess

# The goal bias of RRT while it is not known whether it is RRT that asks. Below 1, so that its tree
# grows elsewhere than towards the goal, which tells.
_PROBING_BIAS = 0.5

# Questions between two looks at the tree while it is somebody else who asks, at most.
_LONGEST_PAUSE = 256


class GoalMonitor(PlannerMonitor):
    """The monitor of a planner that goal injection reaches.

    Attributes:
        is_trusted: whether it is taken to be the planner that asks about nodes.
        nodes: how often somebody has asked about a node.
    """

    is_trusted = True

    def __init__(self, setup: Any, states: StateAccess) -> None:
        super().__init__(setup, states)
        self.nodes = 0
        self._paths = 0

    def is_sampling(self) -> bool:
        """Return whether it is the planner's main loop that asks how many samples there are."""
        raise NotImplementedError

    def takes_sample(self, caller: FrameType) -> bool:
        """Return whether it is the planner's main loop that asks for a sample.

        Args:
            caller: the frame that has called OMPL.
        """
        raise NotImplementedError

    def note_other(self) -> None:
        """Note a question that the planner never asks."""
        raise NotImplementedError

    def note_reached(self) -> None:
        """Note that a node is in the goal."""

    def _note_call(self, caller: FrameType) -> None:
        self._paths_at_call = self._paths
        self._call = caller.f_code, id(caller), caller.f_lasti


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
        """Note a question that the planner never asks: this iteration is not at work."""
        if self._planner is not None:
            self._sampled_iteration = self._asked_iteration = self._planner.numIterations()


class TreeMonitor(GoalMonitor):
    """The monitor of RRT, which counts nothing: whether it is at work is told by its tree.

    RRT asks once how many samples there are before each sample that it takes, and ends with its
    first node in the goal. Whatever does not fit ends the trust: another question, a new path, a
    new planner in the setup. Trust comes back once the tree is seen to have grown, or to be new.
    Until then the goal is handed out, and RRT samples on its own half of the time.
    """

    def __init__(self, setup: Any, states: StateAccess) -> None:
        super().__init__(setup, states)
        self.is_trusted = False
        self._current = self._planner
        self._asked = 0
        # Nodes of the tree when it was last looked at without trust; None before that.
        self._seen: int | None = 0
        # What to add to the questions about nodes for the nodes of the tree, and how many questions
        # there had been when the planner last asked for a sample.
        self._offset = self._nodes_at_ask = 0
        self._is_probing = False
        self._pause = self._left = 0

    def is_sampling(self) -> bool:
        """Return whether it is the planner's main loop that asks how many samples there are."""
        if self._planner is None:
            return False
        self._asked += 1
        paths, current = self._problem.getSolutionCount(), self._setup.getPlanner()
        if self._asked != 1 or paths != self._paths or current is not self._current:
            self._paths, self._current = paths, current
            self._distrust()
        if self.is_trusted or self._looks_at_work():
            self._nodes_at_ask = self.nodes
            return True
        return False

    def takes_sample(self, caller: FrameType) -> bool:
        """Return whether it is the planner's main loop that asks for a sample."""
        takes = self.is_trusted and self._asked == 1 and self._planner is not None
        self._asked = 0
        if takes:
            self._note_call(caller)
        return takes

    def note_other(self) -> None:
        """Note a question that the planner never asks."""
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

    def release(self) -> None:
        """Let go of the planner and its task."""
        super().release()
        self._current = None

    def _distrust(self) -> None:
        if self.is_trusted:
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
            self.is_trusted = nodes < self._offset + self._nodes_at_ask
        else:
            self.is_trusted = nodes != self._seen
        self._seen = nodes
        if self.is_trusted:
            self._offset = nodes - self.nodes
        else:
            self._left = self._pause
            self._pause = min(2 * self._pause + 1, _LONGEST_PAUSE)
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
