"""What stands in for a setup's goal and checks while its planner's samples are steered."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Any

from ..sampling.sampler import HeatmapSampler
from .awaited import AwaitedHeatmap
from .bounds_steering import BoundsSteering
from .compat import ob
from .states import StateAccess
from .steering_monitor import SteeringMonitor


class SteeredGoal(ob.GoalSampleableRegion):  # type: ignore[misc]
    """A goal as the original is, whose questions are seen.

    Args:
        si: the space information.
        original: the goal of the task.
        steering: is told of the questions.
    """

    def __init__(self, si: Any, original: Any, steering: BoundsSteering) -> None:
        super().__init__(si)
        self.setThreshold(original.getThreshold())
        self._original = original
        self._steering = steering

    def distanceGoal(self, state: Any) -> float:  # noqa: N802
        """Return the distance to the original goal."""
        return float(self._original.distanceGoal(state))

    def maxSampleCount(self) -> int:  # noqa: N802
        """Return the number of the original's samples, see :meth:`BoundsSteering.on_question`."""
        return self._steering.on_question(int(self._original.maxSampleCount()))

    def couldSample(self) -> bool:  # noqa: N802
        """Return whether the original could be sampled: the last question before a sample."""
        could = bool(self._original.couldSample())
        self._steering.on_possibility(sys._getframe(1))
        return could

    def sampleGoal(self, state: Any) -> None:  # noqa: N802
        """Sample the original goal."""
        self._steering.on_goal_sample()
        self._original.sampleGoal(state)


class SteeredChecker(ob.StateValidityChecker):  # type: ignore[misc]
    """A validity checker that answers as the original does, once the bounds are set back.

    Args:
        si: the space information, with the original checker.
        steering: is told of the checks.
    """

    is_steered = True

    def __init__(self, si: Any, steering: BoundsSteering) -> None:
        super().__init__(si)
        self.original = si.getStateValidityChecker()
        self._is_valid = self.original.isValid
        self._check = steering.check_state

    def isValid(self, state: Any) -> bool:  # noqa: N802
        """Return whether a state is valid."""
        return self._check(state, self._is_valid, sys._getframe(1))


class SteeredMotions(ob.MotionValidator):  # type: ignore[misc]
    """A motion validator that answers as the original does, once the bounds are set back.

    Args:
        si: the space information, with the original validator.
        steering: is told of the checks.
    """

    is_steered = True

    def __init__(self, si: Any, steering: BoundsSteering) -> None:
        super().__init__(si)
        self.original = si.getMotionValidator()
        self._check_original = self.original.checkMotion
        self._check = steering.check_motion

    def checkMotion(self, s1: Any, s2: Any) -> bool:  # noqa: N802
        """Return whether a motion is valid."""
        return self._check(self._check_original, s1, s2)


def install_steering(
    setup: Any,
    states: StateAccess,
    source: HeatmapSampler | AwaitedHeatmap,
    monitor: SteeringMonitor,
) -> Callable[[], None]:
    """Put goal, validity checker and motion validator of a setup into wrappers that steer.

    Args:
        setup: a SimpleSetup with its planner, start and goal.
        states: access to the positions of its states.
        source: the sampler of the heat map, or the heat map that is waited for.
        monitor: of the planner.

    Returns:
        What takes them out again.
    """
    si, goal = setup.getSpaceInformation(), setup.getGoal()
    was_set_up = si.isSetup()
    steering = BoundsSteering(setup.getStateSpace(), states, source, monitor)
    checker, motions = SteeredChecker(si, steering), SteeredMotions(si, steering)
    steered = SteeredGoal(si, goal, steering)
    si.setStateValidityChecker(checker)
    si.setMotionValidator(motions)
    setup.setGoal(steered)
    if was_set_up:
        si.setup()
    steering.guard_signals()

    def undo() -> None:
        steering.release()
        if setup.getGoal() is steered:
            setup.setGoal(goal)
        if si.getStateValidityChecker() is checker:
            si.setStateValidityChecker(checker.original)
        if si.getMotionValidator() is motions:
            si.setMotionValidator(motions.original)
        if was_set_up:
            si.setup()

    return undo
