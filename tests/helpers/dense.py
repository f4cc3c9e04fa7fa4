"""An independent check of poses: polygons against the squares of blocked pixels, by shapely."""

from __future__ import annotations

import numpy as np
import shapely
from numpy.typing import NDArray

from cbagan_ompl import GridMap, Robot

#: Step at which motions are looked at, in pixels.
STEP = 0.1


class DenseCheck:
    """Which poses of a robot collide on a map, contact counted."""

    def __init__(self, grid: GridMap, robot: Robot) -> None:
        self.grid, self.robot = grid, robot
        rows, columns = np.nonzero(~grid.free)
        self.squares = shapely.box(columns, rows, columns + 1, rows + 1)
        self.tree = shapely.STRtree(self.squares)

    def shapes(self, poses: NDArray[np.float64]) -> NDArray[np.object_]:
        """The shapes at poses (N, 3) in pixel coordinates; points for discs and points."""
        if self.robot.vertices is None:
            return shapely.points(self.grid.to_pixel(poses[:, :2]))
        c, s = np.cos(poses[:, 2:]), np.sin(poses[:, 2:])
        x, y = self.robot.vertices.T
        outline = np.stack((poses[:, :1] + c * x - s * y, poses[:, 1:2] + s * x + c * y), axis=-1)
        return shapely.polygons(self.grid.to_pixel(outline))

    def collides(self, poses: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Whether each pose (N, 3) touches a blocked pixel or is not all on the map."""
        radius = self.robot.radius / self.grid.resolution
        shapes = self.shapes(poses)
        left, top, right, bottom = (shapely.bounds(shapes) + np.array((-1, -1, 1, 1)) * radius).T
        result = (left < 0) | (top < 0) | (right > self.grid.width) | (bottom > self.grid.height)
        if self.robot.vertices is None:
            hits, _ = self.tree.query(shapes, predicate="dwithin", distance=radius)
        else:
            hits, _ = self.tree.query(shapes, predicate="intersects")
        result[hits] = True
        return result

    def distance(self, pose: NDArray[np.float64]) -> float:
        """The distance from the robot at a pose to the nearest blocked pixel, world units."""
        shape = self.shapes(np.asarray(pose)[None])[0]
        pixels = shapely.distance(shape, self.squares).min()
        return float(pixels * self.grid.resolution - self.robot.radius)


def steps_of(grid: GridMap, robot: Robot, length: float, turn: float) -> int:
    """How many steps move no point of the robot farther than STEP; length in world units."""
    movement = (length + turn * robot.circumscribed_radius) / grid.resolution
    return max(int(np.ceil(movement / STEP)), 1)


def straight_poses(
    start: NDArray[np.float64], end: NDArray[np.float64], steps: int
) -> NDArray[np.float64]:
    """Poses along a straight motion with the heading turning the short way, (steps + 1, 3)."""
    turn = (end[2] - start[2] + np.pi) % (2 * np.pi) - np.pi
    change = np.array((end[0] - start[0], end[1] - start[1], turn))
    return start + np.linspace(0, 1, steps + 1)[:, None] * change
