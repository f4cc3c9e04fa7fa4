"""The occupancy map: which pixels are free, and where they lie in the world."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from math import cos, sin
from os import PathLike
from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..common.validation import is_finite_number
from ..errors import MapError, TaskError, show
from .collision import segment_is_free
from .connectivity import label_components
from .loading import read_map
from .raw_map import check_map_size


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
        return np.stack(
            (self.a * x + self.b * y + self.c, self.d * x + self.e * y + self.f), axis=-1
        )


# How far the way to the world frame and back may shift a corner of a map, in pixels.
_MOST_ROUNDING = 1e-3


class GridMap:
    """A 2-D occupancy map with its world frame.

    Pixel coordinates (u, v) are continuous, u to the right and v down from the upper left corner
    of the map; the point (u, v) lies in the pixel of column floor(u) and row floor(v).

    World coordinates (x, y) are what every other part of the package takes and returns:

    * without ``origin`` (images, arrays, MovingAI maps): x right, y down, (0, 0) at the upper left
      corner, one pixel is ``resolution`` long;
    * with ``origin=(x, y, yaw)`` (ROS): y up, ``origin`` is the pose of the lower left corner of
      the map in the world, lengths in metres, yaw in radians, counter-clockwise.

    Args:
        free: shape (H, W), row 0 on top; true or non-zero where the robot may be.
        resolution: world units per pixel.
        origin: pose of the lower left corner for maps in the ROS frame.
        name: what the map is called in messages and results.
        unknown: shape (H, W), true where nothing is known of a pixel, whether it counts as free or
            not; None where no pixel is so. It serves figures alone.

    Raises:
        MapError: not a 2-D array of at least 1 x 1 pixel, too large (see
            :func:`cbagan_ompl.maps.raw_map.check_map_size`), no free pixel, a resolution or
            origin that is not finite (resolution also positive), an origin so far away that pixels
            cannot be told apart, a name that is no text, or ``unknown`` of another shape or type.

    Example:
        >>> grid = GridMap([[1, 1, 0], [1, 0, 0]], resolution=0.5)
        >>> grid.shape, bool(grid.is_free((0.2, 0.8)))
        ((2, 3), True)
    """

    def __init__(
        self,
        free: ArrayLike,
        resolution: float = 1.0,
        origin: tuple[float, float, float] | None = None,
        *,
        name: str = "map",
        unknown: NDArray[np.bool_] | None = None,
    ) -> None:
        if not isinstance(name, str):
            raise MapError(f"the name of a map is a text, got {show(name)}")
        cells = _check_cells(free, name)
        if not (is_finite_number(resolution) and resolution > 0):
            raise MapError(
                f"{name}: resolution is the length of a pixel in world units and must be "
                f"positive, got {show(resolution)}"
            )
        self.free: NDArray[np.bool_] = np.ascontiguousarray(cells != 0)
        if not self.free.any():
            raise MapError(f"{name}: every pixel is blocked, there is nowhere to plan")
        self.free.setflags(write=False)
        self.resolution = float(resolution)
        self.origin = None if origin is None else _check_origin(origin, name)
        self.name = name
        self.unknown = unknown
        if unknown is not None and not (
            isinstance(unknown, np.ndarray)
            and unknown.shape == self.shape
            and unknown.dtype == np.bool_
        ):
            raise MapError(
                f"{name}: unknown is an array of booleans of shape {self.shape}, got "
                f"{show(unknown)}"
            )
        self._check_frame()

    @classmethod
    def load(cls, path: str | PathLike[str], **options: Any) -> GridMap:
        """Read a map file: PNG, JPG, BMP or PGM image, ROS map_server YAML, or MovingAI ``.map``.

        Args:
            path: the file; its kind is told by its suffix. ``bundled:NAME`` reads one of the maps
                that come with the package (see :func:`cbagan_ompl.bundled_maps`).
            **options: the fields of :class:`cbagan_ompl.maps.loading.MapOptions`, such as
                ``threshold`` and ``unknown_is_free``.

        Raises:
            MapError: the file is missing, unreadable, truncated, empty or of an unknown kind.
            ConfigError: an unknown option, or one with a value that makes no sense.
        """
        if not isinstance(path, str | PathLike):
            raise MapError(f"a map file is given by its path, got {show(path)}")
        raw = read_map(path, **options)
        return cls(raw.free, raw.resolution, raw.origin, name=raw.name, unknown=raw.unknown)

    def _check_frame(self) -> None:
        corners = np.array([(0.0, 0.0), (self.width, self.height)])
        with np.errstate(all="ignore"):
            try:
                shift = np.abs(self.to_pixel(self.to_world(corners)) - corners).max()
            except ArithmeticError:  # Python's own floats
                shift = np.inf
        if not shift < _MOST_ROUNDING:
            raise MapError(
                f"{self.name}: with a resolution of {self.resolution:g} and the origin "
                f"{self.origin} numbers are too coarse for the pixels; move the origin near the map"
            )

    @property
    def width(self) -> int:
        """Columns."""
        return int(self.free.shape[1])

    @property
    def height(self) -> int:
        """Rows."""
        return int(self.free.shape[0])

    @property
    def shape(self) -> tuple[int, int]:
        """(rows, columns)."""
        return self.height, self.width

    @cached_property
    def cells(self) -> bytes:
        """The free mask as row-major bytes, 1 where free: the form that scalar checks read."""
        return self.free.tobytes()

    @cached_property
    def free_pixels(self) -> NDArray[np.intp]:
        """Flat row-major indices of the free pixels, ascending, shape (K,)."""
        return np.flatnonzero(self.free)

    @cached_property
    def pixel_from_world(self) -> Affine:
        """World (x, y) -> pixel (u, v)."""
        scale = 1 / self.resolution
        if self.origin is None:
            return Affine(scale, 0.0, 0.0, 0.0, scale, 0.0)
        x, y, yaw = self.origin
        c, s = cos(yaw) * scale, sin(yaw) * scale
        return Affine(c, s, -(c * x + s * y), s, -c, self.height - s * x + c * y)

    @cached_property
    def world_from_pixel(self) -> Affine:
        """Pixel (u, v) -> world (x, y)."""
        if self.origin is None:
            return Affine(self.resolution, 0.0, 0.0, 0.0, self.resolution, 0.0)
        x, y, yaw = self.origin
        c, s = cos(yaw) * self.resolution, sin(yaw) * self.resolution
        return Affine(c, s, x - s * self.height, s, -c, y + c * self.height)

    def to_pixel(self, points: ArrayLike) -> NDArray[np.float64]:
        """Return world points, shape (..., 2), as continuous pixel coordinates (u, v).

        Raises:
            MapError: not an array of that shape.
        """
        return self.pixel_from_world(_as_points(points))

    def to_world(self, pixels: ArrayLike) -> NDArray[np.float64]:
        """Return continuous pixel coordinates (u, v), shape (..., 2), as world points.

        Raises:
            MapError: not an array of that shape.
        """
        return self.world_from_pixel(_as_points(pixels))

    @property
    def bounds(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Lower and upper corner of the world box around the map, each (x, y)."""
        corners = self.to_world(
            [(0, 0), (self.width, 0), (0, self.height), (self.width, self.height)]
        )
        return corners.min(axis=0), corners.max(axis=0)

    def is_free(self, points: ArrayLike) -> NDArray[np.bool_]:
        """Return whether world points, shape (..., 2), lie in free pixels.

        Outside the map nothing is free.

        Raises:
            MapError: not an array of that shape.
        """
        pixels = self.to_pixel(points)
        within = (pixels >= 0) & (pixels < (self.width, self.height))
        inside: NDArray[np.bool_] = np.asarray(within.all(axis=-1))
        indices = np.where(inside[..., None], pixels, 0).astype(np.intp)
        result: NDArray[np.bool_] = inside & self.free[indices[..., 1], indices[..., 0]]
        return result

    def path_is_free(self, path: ArrayLike) -> bool:
        """Return whether a polyline of world points, shape (N, 2), stays in free pixels.

        The check is exact (see :func:`cbagan_ompl.maps.collision.segment_is_free`).

        Raises:
            MapError: not an array of that shape.
        """
        pixels = self.to_pixel(path)
        if pixels.ndim != 2:
            raise MapError(f"a path has shape (N, 2), this one {pixels.shape}")
        if len(pixels) == 1:
            return bool(self.is_free(path).all())
        return all(
            segment_is_free(self.cells, self.width, self.height, *start, *end)
            for start, end in zip(pixels[:-1].tolist(), pixels[1:].tolist(), strict=True)
        )

    def inflated(self, radius: float) -> GridMap:
        """Return the map for the centre of a disc-shaped robot: obstacles grown by its radius.

        Every point of a pixel that stays free is at least ``radius`` away from every point of
        every blocked pixel (square to square), and every pixel for which that holds stays free.
        So the robot cannot touch an obstacle wherever in the pixel its centre is. The cost is that
        up to a pixel's diagonal of room is given away. The border of the map is no obstacle.

        Args:
            radius: in world units; 0 returns the map itself, any more blocks the pixels that
                touch an obstacle.

        Raises:
            MapError: radius negative or not finite, or nothing stays free.
        """
        if not is_finite_number(radius) or radius < 0:
            raise MapError(f"the robot radius must be a length of at least 0, got {show(radius)}")
        radius = float(radius)
        if radius == 0 or self.free.all():
            return self
        # The gap between two pixels is the distance of their centres with one of them grown by a
        # pixel all around, so growing the obstacles first makes the distance transform, which
        # measures between centres, give gaps.
        grown = cv2.dilate((~self.free).astype(np.uint8), np.ones((3, 3), np.uint8))
        gap = cv2.distanceTransform(1 - grown, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
        # The factor covers the rounding of float32 and of the division: 1.1 / 0.1 is 11 pixels.
        free = gap >= radius / self.resolution * (1 - 1e-6)
        if not free.any():
            raise MapError(
                f"{self.name}: a robot of radius {radius} fits nowhere on this map "
                f"({self.width} x {self.height} pixels of {self.resolution})"
            )
        name = f"{self.name} (inflated by {radius:g})"
        return GridMap(free, self.resolution, self.origin, name=name, unknown=self.unknown)

    @cached_property
    def clearance(self) -> NDArray[np.float32]:
        """Distance from each pixel to the nearest blocked one, pixels, (H, W); 0 where blocked.

        From centre to centre, within two hundredths; what lies outside of the map does not count.
        """
        # The quick mask is near enough for what asks, and a third of the cost of the exact one.
        distance = cv2.distanceTransform(self.free.view(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_5)
        return np.asarray(distance, np.float32)

    @cached_property
    def components(self) -> NDArray[np.int32]:
        """Label of the connected free part that each pixel belongs to, (H, W); 0 where blocked.

        4-connected, because no motion passes between two obstacles that touch diagonally.
        """
        return label_components(self.free, connectivity=4)

    def check_task(
        self, start: ArrayLike, goal: ArrayLike
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return start and goal as (2,) arrays, or raise if they cannot be planned for.

        Raises:
            TaskError: one of them is no point, outside the map or in an obstacle, the two are
                equal, or no path connects them.
        """
        endpoints = self._check_endpoint("start", start), self._check_endpoint("goal", goal)
        if np.array_equal(*endpoints):
            raise TaskError(f"start and goal are the same point {_show(endpoints[0])}")
        (u0, v0), (u1, v1) = self.to_pixel(endpoints).astype(np.intp)
        if self.components[v0, u0] != self.components[v1, u1]:
            raise TaskError(
                f"{self.name}: no path connects start {_show(endpoints[0])} and goal "
                f"{_show(endpoints[1])}, obstacles separate them; choose both in one "
                "connected free part"
            )
        return endpoints

    def _check_endpoint(self, role: str, point: ArrayLike) -> NDArray[np.float64]:
        position = check_point(role, point)
        column, row = np.floor(self.to_pixel(position)).tolist()
        if not (0 <= column < self.width and 0 <= row < self.height):
            low, high = self.bounds
            raise TaskError(
                f"{role} {_show(position)} is outside {self.name}, which spans "
                f"x {low[0]:g} to {high[0]:g} and y {low[1]:g} to {high[1]:g}"
            )
        column, row = int(column), int(row)
        if not self.free[row, column]:
            raise TaskError(
                f"{role} {_show(position)} is in an obstacle of {self.name} "
                f"(pixel column {column}, row {row}); choose a free point"
            )
        return position

    def __repr__(self) -> str:
        frame = "image frame" if self.origin is None else f"origin {self.origin}"
        return (
            f"GridMap({self.name!r}, {self.width} x {self.height} pixels of {self.resolution:g}, "
            f"{frame}, {self.free.mean():.0%} free)"
        )


def check_point(role: str, point: ArrayLike) -> NDArray[np.float64]:
    """Return a point as a (2,) array.

    Args:
        role: of the point, for the message.
        point: (x, y), any real numbers.

    Raises:
        TaskError: not two finite numbers; texts and truth values are none.
    """
    try:
        values = np.asarray(point).tolist()
    except Exception:  # rows of different lengths, or whatever the class raises
        values = None
    if not (isinstance(values, list) and len(values) == 2 and all(map(is_finite_number, values))):
        raise TaskError(f"{role} must be two finite numbers x, y in world units, got {show(point)}")
    return np.array([float(value) for value in values])


def _check_cells(free: ArrayLike, name: str) -> NDArray[Any]:
    try:
        cells = np.asarray(free)
    except Exception as error:  # rows of different lengths, or whatever the class raises
        raise MapError(f"{name}: a map is a 2-D array (H, W), got {show(free)}") from error
    if cells.ndim != 2 or cells.size == 0:
        raise MapError(
            f"{name}: a map is a 2-D array (H, W) of at least one pixel, "
            f"this one has shape {show(cells.shape)}"
        )
    check_map_size(cells.shape[1], cells.shape[0], name)
    if cells.dtype.kind not in "buif":
        raise MapError(f"{name}: a map holds booleans or numbers, not {show(str(cells.dtype))}")
    if cells.dtype.kind == "f" and not np.isfinite(cells).all():
        raise MapError(f"{name}: the map holds NaN or infinite values")
    return cells


def _check_origin(origin: object, name: str) -> tuple[float, float, float]:
    pose = origin.tolist() if isinstance(origin, np.ndarray) else origin
    if not (isinstance(pose, Sequence) and len(pose) == 3 and all(map(is_finite_number, pose))):
        raise MapError(f"{name}: origin is (x, y, yaw) with finite numbers, got {show(origin)}")
    return float(pose[0]), float(pose[1]), float(pose[2])


def _as_points(points: ArrayLike) -> NDArray[np.float64]:
    try:
        array = np.asarray(points, dtype=np.float64)
    except Exception as error:  # rows of different lengths, texts, or whatever the class raises
        raise MapError(f"points are numbers of shape (..., 2), got {show(points)}") from error
    if array.shape[-1:] != (2,):
        raise MapError(f"points have shape (..., 2), these {array.shape}")
    return array


def _show(point: NDArray[np.float64]) -> str:
    return f"({point[0]:g}, {point[1]:g})"
