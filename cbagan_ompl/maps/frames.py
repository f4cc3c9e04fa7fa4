"""The two frames of a map: pixels and world; see :class:`cbagan_ompl.GridMap`."""

from __future__ import annotations

from math import cos, sin
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import MapError, show

# How far the way to the world frame and back may shift a corner of a map, in pixels.
_MOST_ROUNDING = 1e-3

#: Pose (x, y, yaw) of the lower left corner of a map in the ROS frame.
Origin = tuple[float, float, float]


class Affine(NamedTuple):
    """The affine function (x, y) -> (a x + b y + c, d x + e y + f)."""

    a: float
    b: float
    c: float
    d: float
    e: float
    f: float

    def __call__(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Apply to points, shape (..., 2)."""
        x, y = points[..., 0], points[..., 1]
        result = np.empty(points.shape)
        result[..., 0] = self.a * x + self.b * y + self.c
        result[..., 1] = self.d * x + self.e * y + self.f
        return result

    def at(self, x: float, y: float) -> tuple[float, float]:
        """Return the same for one point, in a tenth of the time."""
        return self.a * x + self.b * y + self.c, self.d * x + self.e * y + self.f


def pixel_from_world(resolution: float, origin: Origin | None, height: int) -> Affine:
    """Return the function from world (x, y) to pixel (u, v).

    Args:
        resolution: world units per pixel.
        origin: None for the image frame.
        height: of the map, in pixels.
    """
    scale = 1 / resolution
    if origin is None:
        return Affine(scale, 0.0, 0.0, 0.0, scale, 0.0)
    x, y, yaw = origin
    c, s = cos(yaw) * scale, sin(yaw) * scale
    return Affine(c, s, -(c * x + s * y), s, -c, height - s * x + c * y)


def world_from_pixel(resolution: float, origin: Origin | None, height: int) -> Affine:
    """Return the function from pixel (u, v) to world (x, y); arguments as above."""
    if origin is None:
        return Affine(resolution, 0.0, 0.0, 0.0, resolution, 0.0)
    x, y, yaw = origin
    c, s = cos(yaw) * resolution, sin(yaw) * resolution
    return Affine(c, s, x - s * height, s, -c, y + c * height)


def check_frame(
    resolution: float, origin: Origin | None, shape: tuple[int, int], name: str
) -> None:
    """Raise if floating-point numbers are too coarse for the pixels of a map.

    Args:
        resolution: world units per pixel.
        origin: None for the image frame.
        shape: (rows, columns).
        name: what to call the map in the message.

    Raises:
        MapError: the way to the world frame and back moves a corner.
    """
    corners = np.array([(0.0, 0.0), (shape[1], shape[0])])
    with np.errstate(all="ignore"):
        try:
            back = pixel_from_world(resolution, origin, shape[0])
            there = world_from_pixel(resolution, origin, shape[0])
            shift = np.abs(back(there(corners)) - corners).max()
        except ArithmeticError:  # Python's own floats
            shift = np.inf
    if not shift < _MOST_ROUNDING:
        raise MapError(
            f"{name}: with a resolution of {resolution:g} and the origin {origin} numbers are too "
            "coarse for the pixels; move the origin near the map"
        )


def as_points(points: ArrayLike) -> NDArray[np.float64]:
    """Return points as an array of floats, shape (..., 2).

    Raises:
        MapError: not an array of that shape.
    """
    try:
        array = np.asarray(points, dtype=np.float64)
    except Exception as error:  # rows of different lengths, texts, or whatever the class raises
        raise MapError(f"points are numbers of shape (..., 2), got {show(points)}") from error
    if array.shape[-1:] != (2,):
        raise MapError(f"points have shape (..., 2), these {array.shape}")
    return array
