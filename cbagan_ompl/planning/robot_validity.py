"""Exact checks of robots with shape and heading, for OMPL."""

from __future__ import annotations

from collections.abc import Callable
from math import pi
from typing import Any

from ..errors import PlannerError
from ..maps.checks import check_grid
from ..maps.grid_map import GridMap
from ..robots.robot import Robot, check_robot
from ..robots.shape_checker import Pose, ShapeChecker
from . import compat
from .compat import ob
from .states import pose_space, space_of, state_access
from .validity import set_last_valid


class RobotValidityChecker(ob.StateValidityChecker):  # type: ignore[misc]
    """A state is valid when the robot's shape touches no blocked pixel and is all on the map.

    Exact: contact counts, to within a billionth of a pixel. A point is valid as for
    :class:`cbagan_ompl.GridValidityChecker`.

    Args:
        si: the space information. Its space is a RealVectorStateSpace(2) for a robot without
            heading, else SE2StateSpace, DubinsStateSpace or ReedsSheppStateSpace; or a compound
            space whose first part is one of them. An ``ompl.control.SpaceInformation`` will do.
        grid: the map, not inflated.
        robot: what moves.

    Raises:
        MapError: not a :class:`GridMap`.
        RobotError: not a :class:`Robot`, or one that is larger than the map.
        PlannerError: no space information, or its states have no pose (x, y, yaw).

    Example:
        >>> from ompl import base as ob
        >>> from cbagan_ompl import GridMap, Robot
        >>> space = ob.SE2StateSpace()
        >>> bounds = ob.RealVectorBounds(2)
        >>> bounds.setLow(0)
        >>> bounds.setHigh(256)
        >>> space.setBounds(bounds)
        >>> si = ob.SpaceInformation(space)
        >>> robot = Robot.rectangle(12, 6)
        >>> si.setStateValidityChecker(
        ...     RobotValidityChecker(si, GridMap.load("bundled:rooms"), robot)
        ... )
    """

    def __init__(self, si: Any, grid: GridMap, robot: Robot) -> None:
        checker = shape_checker(grid, robot)
        self._read = pose_reader(space_of(si), robot)
        super().__init__(si)
        self._checker = checker

    def isValid(self, state: Any) -> bool:  # noqa: N802
        """Return whether a state is valid: a real ``bool``, as OMPL 2.0 demands."""
        return self._checker.pose_is_free(*self._read(state))

    def clearance(self, state: Any) -> float:
        """Return the distance from the robot to the nearest blocked pixel, world units.

        It is 0 in an invalid state, and infinite on a map without obstacles, whose border is none.
        """
        return self._checker.clearance(*self._read(state))


class RobotMotionValidator(ob.MotionValidator):  # type: ignore[misc]
    """A motion is valid when the robot touches no blocked pixel at any pose of it.

    Straight motions of RealVectorStateSpace and SE2StateSpace, and the curves of DubinsStateSpace
    and ReedsSheppStateSpace, as OMPL interpolates them. No step width: a collision is never
    missed. A motion along which the robot comes nearer to an obstacle than
    :data:`cbagan_ompl.robots.pieces.CONSERVATISM` pixels may be refused; straight motions
    without a turn are exact. The check of straight motions is compiled,
    which takes seconds once and is kept on disk.

    Args:
        si: as for :class:`RobotValidityChecker`.
        grid: the map, not inflated.
        robot: what moves.

    Raises:
        MapError: not a :class:`GridMap`.
        RobotError: not a :class:`Robot`, or one that is larger than the map.
        PlannerError: no space information, or its states have no pose (x, y, yaw).

    Example:
        >>> from ompl import base as ob
        >>> from cbagan_ompl import GridMap, Robot
        >>> space = ob.ReedsSheppStateSpace(10.0)
        >>> bounds = ob.RealVectorBounds(2)
        >>> bounds.setLow(0)
        >>> bounds.setHigh(256)
        >>> space.setBounds(bounds)
        >>> si = ob.SpaceInformation(space)
        >>> car = Robot.rectangle(12, 6, turning_radius=10.0, reverse=True)
        >>> si.setMotionValidator(RobotMotionValidator(si, GridMap.load("bundled:rooms"), car))
    """

    def __init__(self, si: Any, grid: GridMap, robot: Robot) -> None:
        checker = shape_checker(grid, robot)
        self._space = space_of(si)
        self._read = pose_reader(self._space, robot)
        super().__init__(si)
        self._checker = checker
        self._curvature = _largest_curvature(pose_space(self._space))
        if self._curvature is None:
            checker.compile()
        # States of its own: one for poses on the way of a curve, one for the end of a part.
        self._middle, self._part_end = (compat.new_state(self._space) for _ in range(2))

    def checkMotion(self, s1: Any, s2: Any, *last_valid: Any) -> bool:  # noqa: N802
        """Return whether a motion is valid, as a real ``bool``.

        Args:
            s1: where the motion begins, a valid state.
            s2: where it ends.
            last_valid: on OMPL 1.x, some planners pass a pair of a state and a number, to be set
                to the last valid state (to within a thousandth of the motion) and how far along
                the motion it is.
        """
        free = self._is_free(s1, s2)
        if last_valid and not free:
            self._set_last_valid(last_valid[0], s1, s2)
        return free

    def _is_free(self, s1: Any, s2: Any) -> bool:
        if self._curvature is None:
            return self._checker.straight_is_free(*self._read(s1), *self._read(s2))
        interpolate, read = self._space.interpolate, self._read
        middle = compat.typed_state(self._middle)

        def pose_at(t: float) -> Pose:
            interpolate(s1, s2, t, middle)
            return read(middle)

        # Of the poses alone: in a compound space the other parts have a share in the distance.
        length = self._pose_distance(s1, s2)
        return self._checker.curve_is_free(pose_at, length, length * self._curvature)

    def _pose_distance(self, s1: Any, s2: Any) -> float:
        space = pose_space(self._space)
        if space is self._space:
            return float(space.distance(s1, s2))
        return float(space.distance(s1[0], s2[0]))

    def _set_last_valid(self, last_valid: Any, s1: Any, s2: Any) -> None:
        # The planner will take the motion to that state for valid, so that motion is checked. It
        # need not be a part of this one: after rounding, a curve may go another way.
        part_end = compat.typed_state(self._part_end)

        def is_free(part: float) -> bool:
            self._space.interpolate(s1, s2, part, part_end)
            return self._is_free(s1, part_end)

        set_last_valid(last_valid, self._space, s1, s2, is_free)


def shape_checker(grid: GridMap, robot: Robot) -> ShapeChecker:
    """Return the checks of a robot on a map, made once for each map and robot.

    Raises:
        MapError: not a :class:`GridMap`.
        RobotError: not a :class:`Robot`, or one that is larger than the map.
    """
    check_grid(grid)
    check_robot(robot)
    return ShapeChecker.of(grid, robot)


def pose_reader(space: Any, robot: Robot) -> Callable[[Any], Pose]:
    """Return a function from the states of a space to poses (x, y, yaw).

    Raises:
        PlannerError: the states have no pose, or no yaw for a robot that has a heading.
    """
    read = state_access(space).read_pose
    if pose_space(space) is None and robot.has_heading:
        raise PlannerError(
            f"a robot with a heading plans in {robot.state_space}, whose states have a yaw, not "
            "in RealVectorStateSpace"
        )
    return read


def _largest_curvature(space: Any) -> float | None:
    """Return the curvature of the curves of a space, 1 / world units; None for straight motions.

    The bindings do not tell the turning radius. To turn about on the spot takes a way that is a
    multiple of it, the same for each radius.
    """
    for kind in (ob.DubinsStateSpace, ob.ReedsSheppStateSpace):
        if isinstance(space, kind):
            return _way_to_turn_about(kind(1.0)) / _way_to_turn_about(space)
    return None


def _way_to_turn_about(space: Any) -> float:
    states = [compat.new_state(space) for _ in range(2)]
    for state, yaw in zip(map(compat.typed_state, states), (0.0, pi / 2), strict=True):
        state.setX(0.0)
        state.setY(0.0)
        state.setYaw(yaw)
    return float(space.distance(*map(compat.typed_state, states)))
