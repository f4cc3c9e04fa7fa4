"""Heat maps of robots with heading: the way where the robot fits, samples wherever it may be."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from numpy.typing import ArrayLike

from ..maps.grid_map import GridMap
from ..robots.poses import passable_map, position_map, position_of
from ..robots.robot import Robot

if TYPE_CHECKING:
    from .heatmap import Heatmap


def robot_heatmap(
    source: Callable[[GridMap, ArrayLike, ArrayLike], Heatmap],
    grid: GridMap,
    robot: Robot,
    start: ArrayLike,
    goal: ArrayLike,
) -> Heatmap:
    """Return the heat map of a robot, on the map of its positions.

    Args:
        source: makes the heat map of a point.
        grid: the map.
        robot: what moves. The source looks for a way on its :func:`.poses.passable_map`.
        start: (x, y), world, or a pose for a robot with heading.
        goal: the same.

    Raises:
        RobotError: no robot.
        TaskError: an endpoint that is none, or see :meth:`.GridMap.check_task`.

    Example:
        >>> from cbagan_ompl import Heatmap
        >>> grid, robot = GridMap.load("bundled:rooms"), Robot.rectangle(12, 6)
        >>> heatmap = robot_heatmap(Heatmap.corridor, grid, robot, (20, 20), (230, 230))
        >>> heatmap.grid.name
        'rooms (inflated by 1.58579)'
    """
    start, goal = position_of(robot, "start", start), position_of(robot, "goal", goal)
    passable = passable_map(grid, robot, start, goal)
    heatmap = source(passable, start, goal)
    if heatmap.grid is not passable:  # of a map of the caller's own
        return heatmap
    return on_positions(heatmap, position_map(grid, robot))


def on_positions(heatmap: Heatmap, positions: GridMap) -> Heatmap:
    """Return a heat map on the map of positions, which has more free pixels than its own.

    Args:
        heatmap: of a robot.
        positions: see :func:`.poses.position_map`.
    """
    if heatmap.grid is positions:
        return heatmap
    moved = type(heatmap)(heatmap.values, positions, heatmap.heading)
    moved.guarantee = heatmap.guarantee
    return moved
