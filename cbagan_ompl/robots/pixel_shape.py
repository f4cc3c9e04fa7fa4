"""A robot in the frame of the pixels of a map: lengths in pixels, headings as the map sees them."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, cos, pi

import numpy as np
from numpy.typing import NDArray

from ..errors import RobotError
from ..maps.grid_map import GridMap
from .convex_parts import convex_parts
from .robot import Robot

Points = NDArray[np.float64]

# A disc is checked as the regular polygon around it, whose corners stick out by this at most.
_DISC_ERROR = 0.02


@dataclass(frozen=True)
class PixelShape:
    """The shape of a robot in pixels.

    In the ROS frame y points up and v down, so a shape is mirrored and turns the other way: the
    heading in pixels is ``sign * yaw + phase``.

    Attributes:
        parts: convex parts, each (N, 2), in pixels; one vertex for a point.
        radius: of the circle around the reference point that holds the shape, pixels.
        inscribed: radius of the circle around the reference point that the shape holds, pixels;
            -1 where the reference point is not in the shape.
        diameter: largest distance between two points of a part, pixels.
        turns: whether the shape changes with the heading.
        sign: 1.0, or -1.0 in the ROS frame.
        phase: radians.
    """

    parts: tuple[Points, ...]
    radius: float
    inscribed: float
    diameter: float
    turns: bool
    sign: float
    phase: float


def pixel_shape(robot: Robot, grid: GridMap) -> PixelShape:
    """Return the shape of a robot in the pixels of a map.

    Raises:
        RobotError: the robot fits into the map nowhere, whatever its heading.
    """
    sign = 1.0 if grid.origin is None else -1.0
    phase = 0.0 if grid.origin is None else grid.origin[2]
    scale = 1 / grid.resolution
    if robot.vertices is not None:
        outline = robot.vertices
        # The mirror image of a counter-clockwise outline is clockwise.
        parts = [part[:: int(sign)] * (scale, sign * scale) for part in convex_parts(outline)]
    elif robot.radius > 0:
        parts = [_around_disc(robot.radius * scale)]
    else:
        parts = [np.zeros((1, 2))]
    _check_fits(robot, np.concatenate(parts), grid)
    return PixelShape(
        tuple(np.ascontiguousarray(part) for part in parts),
        max(float(np.hypot(*part.T).max()) for part in parts),
        robot.inscribed_radius * scale if robot.contains_reference else -1.0,
        max(_diameter(part) for part in parts),
        robot.vertices is not None,
        sign,
        phase,
    )


def rotate(points: Points, heading: float) -> Points:
    """Return points, (N, 2), turned by an angle from u to v."""
    c, s = np.cos(heading), np.sin(heading)
    return np.asarray(points @ np.array([(c, s), (-s, c)]))


def _around_disc(radius: float) -> Points:
    corners = 8
    while radius * (1 / cos(pi / corners) - 1) > _DISC_ERROR and corners < 512:
        corners *= 2
    angles = np.arange(corners) * (2 * pi / corners)
    return np.stack((np.cos(angles), np.sin(angles)), axis=1) * (radius / cos(pi / corners))


def _diameter(part: Points) -> float:
    return float(np.hypot(*(part[:, None] - part[None]).reshape(-1, 2).T).max())


def _check_fits(robot: Robot, points: Points, grid: GridMap) -> None:
    sizes = [
        np.ptp(rotate(points, heading), axis=0)
        for heading in (np.linspace(0, pi, 181) if robot.vertices is not None else (0.0,))
    ]
    # Half a pixel covers the headings between those looked at, for any shape that may fit.
    slack = 1 + max(grid.shape) * pi / 360
    if not any(w <= grid.width + slack and h <= grid.height + slack for w, h in sizes):
        width, height = (ceil(size) for size in sizes[0])
        raise RobotError(
            f"the robot is larger than {grid.name}: {width} x {height} pixels, the map has "
            f"{grid.width} x {grid.height} pixels of {grid.resolution:g}; are its lengths in the "
            "units of the map?"
        )
