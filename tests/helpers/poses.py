"""Spaces of poses of OMPL, their states, and setups with a wall."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from cbagan_ompl.planning import compat
from cbagan_ompl.planning.compat import ob, og
from cbagan_ompl.robots.arcs import Pose

SIDE, RADIUS = 128, 6.0
POSE_SPACES = ("SE2", "Dubins", "ReedsShepp")


def make_space(kind: str, radius: float = RADIUS) -> Any:
    """A space of poses on a square of :data:`SIDE`."""
    make = getattr(ob, f"{kind}StateSpace")
    space = make() if kind == "SE2" else make(radius)
    bounds = ob.RealVectorBounds(2)
    bounds.setLow(0.0)
    bounds.setHigh(float(SIDE))
    space.setBounds(bounds)
    return space


def set_pose(typed: Any, x: float, y: float, yaw: float) -> None:
    typed.setX(x)
    typed.setY(y)
    typed.setYaw(yaw)


def new_pose(space: Any, pose: Pose) -> Any:
    """A state; what ``compat.typed_state`` makes of it is alive as long as it is."""
    handle = compat.new_state(space)
    set_pose(compat.typed_state(handle), *pose)
    return handle


class PositionChecker(ob.StateValidityChecker):  # type: ignore[misc]
    """Poses are valid where their position is."""

    def __init__(self, si: Any, is_free: Callable[[float, float], bool]) -> None:
        super().__init__(si)
        self._is_free = is_free

    def isValid(self, state: Any) -> bool:  # noqa: N802
        return self._is_free(state.getX(), state.getY())


def make_setup(
    kind: str,
    planner: str,
    ends: tuple[Pose, Pose],
    is_free: Callable[[float, float], bool],
    tolerance: float = 1.0,
    range: float = 15.0,
) -> Any:
    """A setup with a planner between two poses."""
    space = make_space(kind)
    setup = og.SimpleSetup(space)
    si = setup.getSpaceInformation()
    setup.setStateValidityChecker(PositionChecker(si, is_free))
    start, goal = (new_pose(space, pose) for pose in ends)
    setup.setStartAndGoalStates(start, goal, tolerance)
    setup.setPlanner(getattr(og, planner)(si))
    setup.getPlanner().setRange(range)
    return setup
