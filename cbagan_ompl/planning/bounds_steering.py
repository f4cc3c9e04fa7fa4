"""Steering the samples of RRTConnect by the bounds of its space: where no sampler can be set.

A RealVectorStateSpace is sampled between its bounds, which are read for each sample. Where both
are the same point, so is the sample. In each iteration RRTConnect asks its goal whether there are
more goal states, samples a state, and checks it:

    termination condition, [goal: maxSampleCount, couldSample], sample, isValid or checkMotion, ...

So the bounds are set to a sample of ours when the goal is asked, after the termination condition,
and set back in the first check. In between only OMPL's own code runs: whatever else looks at the
bounds, sees the true ones. A solve that ends for lack of time leaves them as they were too.

The goal is asked once its tree has four nodes. To have them soon, the first step of the goal's
tree is taken in three short ones. Until then samples are OMPL's own, but for the first one.

Headings have no bounds to set: those of poses are OMPL's own, uniform.
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable
from types import FrameType
from typing import Any

from ..common.signals import ENDING
from ..sampling.sampler import HeatmapSampler
from .awaited import AwaitedHeatmap
from .compat import ob, plane_bounds
from .states import StateAccess, position_space
from .steering_monitor import SteeringMonitor

# Nodes of the goal's tree from which on RRTConnect asks for further goal states in each iteration.
_ASKING_SIZE = 4

# The short steps by which its tree gets there, as a fraction of the range.
_SHORT_STEP = 0.01


class BoundsSteering:
    """Hand a sample to a planner by the bounds of its space, and set them back.

    Args:
        space: of the planner.
        states: access to the positions of its states.
        source: the sampler of the heat map, which is told of every node of the trees; or the heat
            map that is waited for, until which nothing is steered.
        monitor: of the planner.
    """

    def __init__(
        self,
        space: Any,
        states: StateAccess,
        source: HeatmapSampler | AwaitedHeatmap,
        monitor: SteeringMonitor,
    ) -> None:
        self._space = position_space(space)
        self._read = states.read
        self._awaited: AwaitedHeatmap | None = None
        self._sampler: HeatmapSampler
        if isinstance(source, AwaitedHeatmap):
            self._awaited = source
            source.hand_to(self._follow)
        else:
            self._sampler = source
        self._monitor = monitor
        self._point = ob.RealVectorBounds(2)
        self._true = _copy_bounds(self._space.getBounds())
        self._is_steered = False
        # Whether the goal has just been asked, and whether a goal state has just been sampled.
        self._was_asked = self._goal_sampled = False
        # Whether it is known that the attached planner asks, and its nodes when it was last seen.
        self._is_ours, self._nodes_before, self._nodes_seen = False, 0, 0
        self._goals_sampled = 0
        self._checks_goal_tree = False
        self._is_in_motion = False
        self._passes = False
        self._has_steered = False  # in this solve
        self._growth = _FirstGrowth(monitor)
        self._handlers: dict[signal.Signals, _RestoringHandler] = {}

    def on_question(self, count: int) -> int:
        """Note that the number of goal states is asked, and return it.

        Args:
            count: how many there are.

        Returns:
            The number; now and then 0 where the goal has more of them, because RRTConnect would
            take a goal state in each iteration of those in which it asks.
        """
        self.restore()
        self._goal_sampled = False
        if not self._is_ours and self._nodes_seen:
            # A planner that goes on has grown; else it is another planner that asks.
            self._is_ours = self._monitor.node_count() > self._nodes_before
            self._nodes_seen = 0
        self._was_asked = True
        self._passes = 0 < self._goals_sampled < count and not self._passes
        return 0 if self._passes else count

    def on_goal_sample(self) -> None:
        """Note that a goal state is sampled."""
        self.restore()
        self._goals_sampled += 1
        self._was_asked, self._goal_sampled = False, True

    def on_possibility(self, caller: FrameType) -> None:
        """Note that it is asked whether goal states can come: at the start, or before a sample.

        Args:
            caller: the frame that has called OMPL.
        """
        self._goal_sampled = False
        if not self._was_asked:
            self._begin_solve()
            return
        self._was_asked = False
        if self._is_ours and not self._growth.lacks_goal:
            self._steer(caller)

    def check_state(self, state: Any, is_valid: Callable[[Any], bool], caller: FrameType) -> bool:
        """Check a state: one of the goal's, one towards which the goal's tree grows, or any."""
        if self._is_steered:
            self.restore()
        if self._is_in_motion:
            return is_valid(state)
        try:
            valid = is_valid(state)
        except BaseException:
            self._growth.end_iteration()
            raise
        if self._goal_sampled:
            self._goal_sampled = False
            if valid and self._is_ours:
                self._growth.lacks_goal = False
                self._steer(caller)
            return valid
        self._checks_goal_tree = valid
        if not valid:
            self._growth.end_iteration()
        return valid

    def check_motion(
        self, check: Callable[..., bool], from_state: Any, to_state: Any, *last_valid: Any
    ) -> bool:
        """Check a motion, the last check before a node is added to one of the trees."""
        if self._is_steered:
            self.restore()
        in_goal_tree, self._checks_goal_tree = self._checks_goal_tree, False
        self._goal_sampled = False
        self._is_in_motion = True
        try:
            valid = check(from_state, to_state, *last_valid)
        except BaseException:
            self._growth.end_iteration()
            raise
        finally:
            self._is_in_motion = False
        if not valid:
            self._growth.end_iteration()
            return valid
        self._nodes_seen += 1
        if self._is_ours:
            # The goal's tree grows backwards: its new node is where the motion begins.
            x, y = self._read(from_state if in_goal_tree else to_state)
            if self._awaited is None:
                self._sampler.on_new_node(x, y, False)
            self._growth.on_node(in_goal_tree, (x, y))
        return valid

    def restore(self) -> None:
        """Give the space its own bounds back."""
        if self._is_steered:
            self._space.setBounds(self._true)
            self._is_steered = False

    def restore_all(self) -> None:
        """Give the space its own bounds back, and the planner its range."""
        self.restore()
        self._growth.end_iteration()

    def release(self) -> None:
        """Give everything back, handlers of signals included."""
        self.restore_all()
        if threading.current_thread() is not threading.main_thread():
            return  # only the main thread sets handlers; ours go on to those before them
        for number, handler in self._handlers.items():
            previous = handler.previous
            if signal.getsignal(number) is handler:
                signal.signal(number, previous)
        self._handlers.clear()

    def _begin_solve(self) -> None:
        """Note that some planner begins to solve."""
        self.restore()
        self._true = _copy_bounds(self._space.getBounds())
        self._nodes_seen, self._passes, self._has_steered = 0, False, False
        self._monitor.check_wiring()
        self._is_ours = self._monitor.has_begun()
        if self._is_ours:
            self._goals_sampled = 0
            if self._awaited is None:
                self._sampler.restart()
            self._growth.begin()
        else:
            self._nodes_before = self._monitor.node_count()
        self.guard_signals()

    def _steer(self, caller: FrameType) -> None:
        """Make the next sample one of ours."""
        monitor = self._monitor
        if monitor.is_released:
            return  # detached in the middle of a solve, by one of its callbacks
        if self._awaited is not None and self._awaited.is_pending():
            return
        sampler = self._sampler
        fraction = monitor.injected_fraction
        if fraction < 1 and sampler.chance() >= fraction:
            return
        if not self._has_steered:
            self._has_steered = True
            monitor.note_call(caller)
            sampler.begin()
        x, y = sampler.next()
        point = self._point
        try:
            point.setLow(0, x)
            point.setHigh(0, x)
            point.setLow(1, y)
            point.setHigh(1, y)
            self._is_steered = True
            self._space.setBounds(point)
        except BaseException:
            self.restore()
            raise

    def _follow(self, sampler: HeatmapSampler, states: StateAccess) -> None:
        """Steer samples of a heat map from now on."""
        self._sampler, self._awaited = sampler, None

    def guard_signals(self) -> None:
        """Let handlers of signals that may raise set the bounds back first.

        Python runs them before the first line of a callback, where nothing could catch what they
        raise. Those that were set since the last call are looked after by the next one.
        """
        if threading.current_thread() is not threading.main_thread():
            return
        for number in ENDING:
            current = signal.getsignal(number)
            if callable(current) and current is not self._handlers.get(number):
                self._handlers[number] = _RestoringHandler(self, current)
                signal.signal(number, self._handlers[number])


class _RestoringHandler:
    """A handler of a signal that sets the bounds back before the one in whose place it is."""

    def __init__(self, steering: BoundsSteering, previous: Any) -> None:
        self.previous = previous
        self._steering = steering

    def __call__(self, number: int, frame: FrameType | None) -> None:
        self._steering.restore_all()
        self.previous(number, frame)


class _FirstGrowth:
    """The first steps of the goal's tree, made short so that RRTConnect soon asks its goal.

    RRTConnect extends one tree by a step, then the other one towards the new node by as many steps
    as it takes. Steps are short while the goal's tree is extended in this way, and only then: an
    iteration ends with a check, in which the range is set back.
    """

    def __init__(self, monitor: SteeringMonitor) -> None:
        self.lacks_goal = True
        self._monitor = monitor
        self._range: float | None = None
        self._is_growing = self._is_connecting = False
        self._goal_nodes = 1
        self._target = (0.0, 0.0)

    def begin(self) -> None:
        """Note that the trees are empty."""
        self.lacks_goal = self._is_growing = True
        self._is_connecting = False
        self._goal_nodes = 1

    def on_node(self, in_goal_tree: bool, position: tuple[float, float]) -> None:
        """Note a new node."""
        if not self._is_growing:
            return
        self._goal_nodes += in_goal_tree
        if self._goal_nodes >= _ASKING_SIZE:
            self._is_growing = False
            self._restore_range()
        elif self._is_connecting:
            if position == self._target:  # the trees have met
                self.end_iteration()
        else:
            self._is_connecting, self._target = True, position
            if not in_goal_tree:
                self._range = self._monitor.range()
                self._monitor.set_range(_SHORT_STEP * self._range)

    def end_iteration(self) -> None:
        """Note that an iteration has come to its end."""
        self._is_connecting = False
        self._restore_range()

    def _restore_range(self) -> None:
        if self._range is not None:
            self._monitor.set_range(self._range)
            self._range = None


def _copy_bounds(bounds: Any) -> Any:
    return plane_bounds(bounds.low, bounds.high)
