"""A robot on a map: the state space that it plans in, its checks, and the states of a task."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise
from math import remainder, tau
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..common.validation import is_finite_number
from ..errors import MapError, RobotError, TaskError, show
from ..maps.endpoints import Moves, snap_endpoints
from ..maps.grid_map import GridMap
from ..robots.poses import check_poses, position_map, snap_poses
from ..robots.robot import Robot
from ..robots.shape_checker import ShapeChecker
from ..sampling.heatmap import Heatmap
from ..sampling.robot_heatmaps import robot_heatmap
from . import compat
from .robot_validity import RobotMotionValidator, RobotValidityChecker
from .states import state_access
from .validity import GridMotionValidator, GridValidityChecker

#: Start and goal as from :meth:`Workspace.check_task`: positions (2,) or poses (3,).
Endpoints = tuple[NDArray[np.float64], NDArray[np.float64]]


@dataclass(frozen=True)
class Workspace:
    """A robot on a map.

    Attributes:
        source: the map.
        robot: what moves, a point by default.

    Example:
        >>> workspace = Workspace(GridMap.load("bundled:rooms"), Robot.rectangle(12, 6))
        >>> type(workspace.make_space()).__name__
        'SE2StateSpace'
    """

    source: GridMap
    robot: Robot = field(default_factory=Robot.point)

    @cached_property
    def grid(self) -> GridMap:
        """The map of the positions of the robot's reference point, which heat maps lie on."""
        return position_map(self.source, self.robot)

    @cached_property
    def checker(self) -> ShapeChecker:
        """The exact check of poses."""
        return ShapeChecker.of(self.source, self.robot)

    def check_task(self, start: ArrayLike, goal: ArrayLike) -> Endpoints:
        """Return start and goal as arrays, or raise if they cannot be planned for.

        Args:
            start: (x, y), world, or (x, y, yaw) for a robot with heading.
            goal: the same.

        Raises:
            TaskError: one of them is no such position or pose, outside the map, or collides; the
                two are equal, or no path connects them.
        """
        if self.robot.has_heading:
            return check_poses(self.checker, start, goal)
        for role, point in (("start", start), ("goal", goal)):
            if _has_yaw(point):
                raise TaskError(
                    f"{role} has a yaw, but the robot, a {self.robot.shape}, has no heading: give "
                    "x, y alone, or a robot with a shape or a turning radius"
                )
        return self.grid.check_task(start, goal)

    def adapt(
        self, source: Callable[[GridMap, ArrayLike, ArrayLike], Heatmap]
    ) -> Callable[[GridMap, ArrayLike, ArrayLike], Heatmap]:
        """Return a source of heat maps that looks for ways on which the robot fits.

        Args:
            source: makes the heat map of a point on a map.

        Returns:
            The same for the robot, on :attr:`grid`, whichever map it is given.
        """
        return lambda _, start, goal: robot_heatmap(source, self.source, self.robot, start, goal)

    def snap(self, start: ArrayLike, goal: ArrayLike, distance: float) -> tuple[Endpoints, Moves]:
        """Return start and goal, each moved to the nearest place where the robot may be.

        Args:
            start: as for :meth:`check_task`.
            goal: the same.
            distance: the farthest that each is moved, world units.

        Returns:
            The endpoints, and those that were moved, see :func:`.endpoints.snap_endpoints`.

        Raises:
            TaskError: one of them is none, outside the map, or nothing near it is free.
        """
        if self.robot.has_heading:
            return snap_poses(self.checker, start, goal, distance)
        return snap_endpoints(self.grid, start, goal, distance)

    def make_space(self) -> Any:
        """Return the state space of the robot, with the bounds of the map."""
        low, high = self.source.bounds
        if not self.robot.has_heading:
            return compat.plane_space(low, high)
        return compat.make_pose_space(self.robot.state_space, self.robot.turning_radius, low, high)

    def make_checks(self, si: Any) -> tuple[Any, Any]:
        """Return a validity checker and a motion validator, both exact.

        Args:
            si: the space information.
        """
        if self.robot.has_heading:
            return (
                RobotValidityChecker(si, self.source, self.robot),
                RobotMotionValidator(si, self.source, self.robot),
            )
        return GridValidityChecker(si, self.grid), GridMotionValidator(si, self.grid)

    def make_state(self, space: Any, endpoint: NDArray[np.float64]) -> Any:
        """Return the state of an endpoint.

        Args:
            space: from :meth:`make_space`.
            endpoint: a position or a pose.
        """
        state = compat.new_state(space)
        values = compat.typed_state(state)
        if not self.robot.has_heading:
            values[0], values[1] = endpoint.tolist()
        else:
            x, y, yaw = endpoint.tolist()
            values.setXY(x, y)
            values.setYaw(yaw)
        return state

    def read_states(self, space: Any, states: Any) -> NDArray[np.float64]:
        """Return positions (N, 2) or poses (N, 3) of states, world.

        Args:
            space: from :meth:`make_space`.
            states: a sequence of states of the space.
        """
        access = state_access(space)
        if self.robot.has_heading:
            return np.array([access.read_pose(state) for state in states]).reshape(-1, 3)
        return np.array([access.read(state) for state in states]).reshape(-1, 2)

    def reach_of_motion(self, space: Any, start: Any, end: Any) -> float:
        """Return how far any point of a robot with heading moves along a motion, world units.

        Args:
            space: from :meth:`make_space`.
            start: from :meth:`make_state`.
            end: the same.
        """
        first, last = compat.typed_state(start), compat.typed_state(end)
        robot = self.robot
        if robot.turning_radius is not None:
            turned = robot.circumscribed_radius / robot.turning_radius
            return float(space.distance(first, last)) * (1 + turned)
        a, b = self.read_states(space, [first, last])
        turn = abs(remainder(b[2] - a[2], tau))
        return float(np.hypot(*(b - a)[:2])) + robot.circumscribed_radius * turn

    def is_free(self, setup: Any, path: NDArray[np.float64]) -> bool:
        """Return whether a robot can follow a path, checked anew.

        Args:
            setup: a SimpleSetup of the space.
            path: from :meth:`read_states`.
        """
        if not self.robot.has_heading:
            return self.grid.path_is_free(path)
        si = setup.getSpaceInformation()
        checker, motions = self.make_checks(si)
        states = [self.make_state(si.getStateSpace(), pose) for pose in path]
        return all(checker.isValid(compat.typed_state(state)) for state in states) and all(
            motions.checkMotion(compat.typed_state(a), compat.typed_state(b))
            for a, b in pairwise(states)
        )


def _has_yaw(point: ArrayLike) -> bool:
    try:
        return np.shape(point) == (3,)
    except Exception:  # rows of different lengths, or whatever the class raises
        return False


def robot_of(robot: Robot | None, radius: float) -> Robot:
    """Return the robot that is meant by two options.

    Args:
        robot: what moves, or None.
        radius: that of a disc, or 0.

    Raises:
        RobotError: no robot, or both are given.
        MapError: no radius.

    Example:
        >>> robot_of(None, 0.5) == Robot.disc(0.5)
        True
    """
    if robot is not None and not isinstance(robot, Robot):
        raise RobotError(
            f"robot is a Robot, such as Robot.rectangle(length, width), got {show(robot)}"
        )
    if not is_finite_number(radius) or radius < 0:
        raise MapError(f"the robot radius must be a length of at least 0, got {show(radius)}")
    if radius == 0:
        return robot or Robot.point()
    if robot is not None:
        raise RobotError("give robot or radius, which is short for robot=Robot.disc(radius)")
    return Robot.disc(radius)
