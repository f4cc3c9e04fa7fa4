"""The positions and poses that a robot can take on a map."""

from __future__ import annotations

from math import cos, pi, remainder, sin, tau

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..common.validation import is_finite_number
from ..errors import MapError, TaskError, show
from ..maps.endpoints import Moves, check_position, name_blocked
from ..maps.grid_map import GridMap
from .robot import Robot, check_robot
from .shape_checker import ShapeChecker

#: Start and goal as poses (x, y, yaw), world, (3,) each.
Poses = tuple[NDArray[np.float64], NDArray[np.float64]]


def position_map(grid: GridMap, robot: Robot) -> GridMap:
    """Return the map of the positions of a robot's reference point.

    For robots without heading it is the map inflated by their radius, in which a point moves as the
    robot does. For robots with heading every position stays free that the robot can take with
    any heading, and some others: the map, with its border, is inflated by the inscribed radius,
    less the diagonal of a pixel that inflation gives away.

    Args:
        grid: the map.
        robot: the robot.

    Raises:
        RobotError: no robot.
        MapError: the robot fits nowhere.

    Example:
        >>> grid = GridMap([[1] * 9] * 9)
        >>> position_map(grid, Robot.rectangle(4, 2)) is grid
        True
    """
    check_robot(robot)
    if not robot.has_heading:
        return grid.inflated(robot.radius)
    radius = max(0.0, robot.inscribed_radius - np.sqrt(2) * grid.resolution)
    return grid.inflated(radius, border=True)


def passable_map(grid: GridMap, robot: Robot, start: ArrayLike, goal: ArrayLike) -> GridMap:
    """Return the map on which a way for a robot is to be looked for.

    On the map of positions a way may lead through gaps that the robot does not fit through. So it
    is the map, with its border, inflated by the whole inscribed radius, if that still connects
    start and goal.

    Args:
        grid: the map.
        robot: the robot.
        start: (x, y), world.
        goal: (x, y), world.

    Returns:
        Otherwise, and for robots without heading, the map of positions.

    Example:
        >>> grid = GridMap.load("bundled:rooms")
        >>> passable_map(grid, Robot.rectangle(12, 6), (20, 20), (230, 230)).name
        'rooms (inflated by 3)'
    """
    positions = position_map(grid, robot)
    if not robot.has_heading:
        return positions
    try:
        passable = grid.inflated(robot.inscribed_radius, border=True)
        passable.check_task(start, goal)
    except (MapError, TaskError):
        return positions
    return passable


def position_of(robot: Robot, role: str, endpoint: ArrayLike) -> ArrayLike:
    """Return the position of an endpoint, which may be a pose where the robot has a heading.

    Args:
        robot: what moves.
        role: "start" or "goal", for messages.
        endpoint: (x, y), world; or (x, y, yaw), radians.

    Raises:
        RobotError: no robot.
        TaskError: a pose that is none.

    Example:
        >>> position_of(Robot.rectangle(4, 2), "start", (4, 4, 0))
        array([4., 4.])
    """
    check_robot(robot)
    is_pose = robot.has_heading and np.shape(endpoint) == (3,)
    return check_pose(role, endpoint)[:2] if is_pose else endpoint


def check_pose(role: str, pose: ArrayLike) -> NDArray[np.float64]:
    """Return a pose as an array (3,), its yaw in [-pi, pi).

    Args:
        role: "start" or "goal", for messages.
        pose: (x, y, yaw), world, radians.

    Raises:
        TaskError: not three finite numbers; positions have no yaw.
    """
    try:
        values = np.asarray(pose).tolist()
    except Exception:  # rows of different lengths, or whatever the class raises
        values = None
    if isinstance(values, list) and len(values) == 2:
        raise TaskError(
            f"{role} {show(pose)} has no yaw, but the robot has a heading: give x, y, yaw, "
            "the last in radians"
        )
    if not (isinstance(values, list) and len(values) == 3 and all(map(is_finite_number, values))):
        raise TaskError(
            f"{role} must be three finite numbers x, y, yaw, in world units and radians, got "
            f"{show(pose)}"
        )
    x, y, yaw = (float(value) for value in values)
    # OMPL's headings lie in [-pi, pi): it calls a state with another one invalid.
    wrapped = remainder(yaw, tau)
    return np.array([x, y, -pi if wrapped >= pi else wrapped])


def check_poses(checker: ShapeChecker, start: ArrayLike, goal: ArrayLike) -> Poses:
    """Return start and goal as arrays (3,), or raise if they cannot be planned for.

    Args:
        checker: of the map and the robot.
        start: (x, y, yaw), world, radians.
        goal: the same.

    Raises:
        TaskError: one of them is no pose, outside the map, or collides; the two are equal, or
            obstacles lie between them whatever the heading.
    """
    grid, robot = checker.grid, checker.robot
    poses = check_pose("start", start), check_pose("goal", goal)
    for role, pose in zip(("start", "goal"), poses, strict=True):
        check_position(grid, role, pose[:2])
        if not checker.pose_is_free(*pose.tolist()):
            raise TaskError(
                describe_collision(grid, robot, role, pose)
                + ", or let it be moved to the nearest one with snap (--snap D)"
            )
    if np.array_equal(*poses):
        raise TaskError(f"start and goal are the same pose {_format(poses[0])}")
    positions = position_map(grid, robot)
    (u0, v0), (u1, v1) = grid.to_pixel([pose[:2] for pose in poses]).astype(np.intp)
    labels = positions.components
    # A reference point outside of the shape may lie over an obstacle.
    if robot.contains_reference and labels[v0, u0] != labels[v1, u1]:
        raise TaskError(
            f"{grid.name}: no path connects start {_format(poses[0])} and goal "
            f"{_format(poses[1])}, obstacles separate them, or leave a gap that is too narrow for "
            f"the robot with any heading"
        )
    return poses


def snap_poses(
    checker: ShapeChecker, start: ArrayLike, goal: ArrayLike, distance: float
) -> tuple[Poses, Moves]:
    """Return start and goal, each moved to the nearest place where the robot fits as it is turned.

    Args:
        checker: of the map and the robot.
        start: (x, y, yaw), world, radians.
        goal: the same.
        distance: the farthest that each is moved, world units.

    Returns:
        The poses, and for those that were moved, by "start" and "goal", the pose that was ``given``
        and the ``distance``, world units.

    Raises:
        TaskError: one of them is no pose, outside the map, or nothing near it is free.
    """
    moves: Moves = {}
    found = []
    for role, given in (("start", start), ("goal", goal)):
        pose = check_pose(role, given)
        check_position(checker.grid, role, pose[:2])
        place = _nearest_free(checker, pose, distance)
        if place is None:
            raise TaskError(
                describe_collision(checker.grid, checker.robot, role, pose)
                + f": nothing within {distance:g} of it is free with this yaw"
            )
        moved = float(np.hypot(*(place - pose)[:2]))
        if moved > 0:
            moves[role] = {"given": pose.tolist(), "distance": moved}
        found.append(place)
    return (found[0], found[1]), moves


def _nearest_free(
    checker: ShapeChecker, pose: NDArray[np.float64], distance: float
) -> NDArray[np.float64] | None:
    """Return the nearest pose of the same yaw that is free, to within half a pixel."""
    x, y, yaw = pose.tolist()
    if checker.pose_is_free(x, y, yaw):
        return pose
    step = checker.grid.resolution / 2
    low, high = checker.grid.bounds
    ticks = [
        np.arange(max(-distance, a - c), min(distance, b - c) + step, step)
        for a, b, c in zip(low, high, (x, y), strict=True)
    ]
    offsets = np.stack(np.meshgrid(*ticks), axis=-1).reshape(-1, 2)
    lengths = np.hypot(*offsets.T)
    order = np.argsort(lengths, kind="stable")
    for dx, dy in offsets[order[lengths[order] <= distance]].tolist():
        if checker.pose_is_free(x + dx, y + dy, yaw):
            return np.array([x + dx, y + dy, yaw])
    return None


def describe_collision(grid: GridMap, robot: Robot, role: str, pose: NDArray[np.float64]) -> str:
    """Return which part of a robot touches what at a pose that collides.

    Args:
        grid: the map.
        robot: the robot.
        role: "start" or "goal".
        pose: (x, y, yaw), world.
    """
    place = f"{role} {_format(pose)} of {grid.name}: "
    outline = _outline(robot, pose)
    pixels = grid.to_pixel(outline)
    size = grid.width, grid.height
    if (pixels < 0).any() or (pixels > size).any():
        return place + "the robot reaches beyond the border of the map; choose another pose"
    # A pixel more on each side, since contact counts.
    low = np.maximum(np.floor(pixels.min(0)).astype(int) - 1, 0)
    high = np.minimum(np.ceil(pixels.max(0)).astype(int) + 1, size)
    rows, columns = np.nonzero(~grid.free[low[1] : high[1], low[0] : high[0]])
    centres = np.stack((columns + low[0], rows + low[1]), axis=-1) + 0.5
    contour = pixels.astype(np.float32)[:, None]
    inside = [cv2.pointPolygonTest(contour, (u, v), measureDist=True) for u, v in centres.tolist()]
    deepest = centres[int(np.argmax(inside))]
    x, y = _in_frame(grid.to_world(deepest), pose)
    length = robot.circumscribed_radius
    along = "front" if x > 0.2 * length else "rear" if x < -0.2 * length else "middle"
    column, row = np.floor(deepest).astype(int).tolist()
    kind = name_blocked(grid, row, column)
    return (
        f"{place}the robot's {along} touches {kind}, at ({x:.3g}, {y:.3g}) in its own "
        f"frame (pixel column {column}, row {row}); choose another pose"
    )


def _outline(robot: Robot, pose: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the outline of a robot at a pose, (N, 2), world; a disc as many corners."""
    if robot.vertices is not None:
        return robot.outline(pose)
    angles = np.linspace(0, 2 * np.pi, 32, endpoint=False)
    circle = np.stack((np.cos(angles), np.sin(angles)), axis=-1)
    return np.asarray(pose[:2] + robot.radius * circle)


def _in_frame(point: NDArray[np.float64], pose: NDArray[np.float64]) -> tuple[float, float]:
    """Return a world point in the frame of a pose."""
    x, y, yaw = pose.tolist()
    dx, dy = float(point[0]) - x, float(point[1]) - y
    return cos(yaw) * dx + sin(yaw) * dy, cos(yaw) * dy - sin(yaw) * dx


def _format(pose: NDArray[np.float64]) -> str:
    return "(" + ", ".join(f"{value:g}" for value in pose) + ")"
