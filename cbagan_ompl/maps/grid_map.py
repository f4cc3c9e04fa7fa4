"""The occupancy map: which pixels are free, and where they lie in the world."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from os import PathLike
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..common.validation import finite_number, is_finite_number, truth_value
from ..errors import MapError, show
from .clearance import Clearance, map_clearance
from .collision import pixels_are_free, segment_is_free
from .connectivity import label_components
from .endpoints import Endpoints, check_endpoints, snap_to_free
from .frames import Affine, as_points, check_frame, pixel_from_world, world_from_pixel
from .inflation import erode
from .loading import read_map
from .occupancy import read_costmap, read_occupancy_grid
from .raw_map import RawMap, check_cells, check_name, check_origin, check_resolution, check_unknown

# Inflated maps that a map keeps, so that a plan on it again need not make them again.
_KEPT_RADII = 4


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
        free: shape (H, W), row 0 on top; true or 1 where the robot may be, false or 0 elsewhere.
        resolution: world units per pixel.
        origin: pose of the lower left corner for maps in the ROS frame.
        name: what the map is called in messages and results.
        unknown: shape (H, W), true where nothing is known of a pixel, whether it counts as free or
            not; None where no pixel is so. It serves figures alone.

    Raises:
        MapError: an argument that makes no sense, a map too large (see
            :func:`cbagan_ompl.maps.raw_map.check_map_size`), or one without a free pixel.

    Example:
        >>> grid = GridMap([[1, 1, 0], [1, 0, 0]], resolution=0.5)
        >>> grid.shape, grid.is_free((0.2, 0.8))
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
        self.name = check_name(name)
        self.free: NDArray[np.bool_] = check_cells(free, name)
        self.free.setflags(write=False)
        self.resolution = check_resolution(resolution, name)
        self.origin = check_origin(origin, name)
        self.unknown = check_unknown(unknown, self.shape, name)
        check_frame(self.resolution, self.origin, self.shape, name)
        #: Name and free pixels before obstacles were inflated, for messages.
        self.bare = name, self.free
        self._inflated: dict[tuple[float, bool], GridMap] = {}

    @classmethod
    def load(cls, path: str | PathLike[str], *, name: str | None = None, **options: Any) -> GridMap:
        """Read a map file: PNG, JPG, BMP or PGM image, ROS map_server YAML, or MovingAI ``.map``.

        Args:
            path: the file; its kind is recognised by its suffix. ``bundled:NAME`` reads one of the
                maps that come with the package (see :func:`cbagan_ompl.bundled_maps`).
            name: what the map is called in messages and results; after its file by default.
            **options: the fields of :class:`cbagan_ompl.maps.loading.MapOptions`, such as
                ``threshold`` and ``unknown_is_free``.

        Raises:
            MapError: the file is missing, unreadable, truncated, empty or of an unknown kind.
            ConfigError: an unknown option, or one with a value that makes no sense.

        Example:
            >>> GridMap.load("bundled:maze")
            GridMap('maze', 256 x 256 pixels of 1, image frame, 82% free)
        """
        raw = read_map(path, **options)
        return cls._of(raw if name is None else replace(raw, name=name))

    @classmethod
    def from_occupancy_grid(
        cls,
        data: ArrayLike,
        width: int,
        height: int,
        resolution: float,
        origin: tuple[float, float, float],
        free_thresh: float = 0.25,
        unknown_is_free: bool = False,
        *,
        name: str = "map",
    ) -> GridMap:
        """Make the map of a nav_msgs/OccupancyGrid.

        Args:
            data: -1 (unknown) or 0 to 100 (percent) for each cell, row by row from the bottom, as
                in the message, (width * height,) or (height, width); masked is unknown.
            width: columns.
            height: rows.
            resolution: metres per cell.
            origin: pose (x, y, yaw) of the lower left corner, metres and radians.
            free_thresh: cells up to this probability of an obstacle are free; 0.25 is nav2's.
            unknown_is_free: whether unknown cells are free.
            name: what the map is called in messages and results.

        Raises:
            MapError: values of another kind or number, or no free cell.
            ConfigError: a size or threshold that makes no sense.

        Example:
            >>> grid = GridMap.from_occupancy_grid([0, 100, -1, 0], 2, 2, 0.05, (0.0, 0.0, 0.0))
            >>> grid.free.tolist()
            [[False, True], [True, False]]
        """
        return cls._of(
            read_occupancy_grid(
                data, width, height, resolution, origin, free_thresh, unknown_is_free, name
            )
        )

    @classmethod
    def from_costmap(
        cls,
        array: ArrayLike,
        resolution: float,
        origin: tuple[float, float, float],
        lethal: int = 253,
        unknown_is_free: bool = False,
        *,
        name: str = "map",
    ) -> GridMap:
        """Make the map of a costmap_2d.

        Args:
            array: (H, W), costs from 0 to 255, row 0 at the bottom, as the costmap has them;
                masked is unknown.
            resolution: metres per cell.
            origin: pose (x, y, yaw) of the lower left corner, metres and radians.
            lethal: cells of this cost and more are blocked: by default those within the robot's
                inscribed radius of an obstacle (253) and obstacles (254).
            unknown_is_free: whether unknown cells (255) are free.
            name: what the map is called in messages and results.

        Raises:
            MapError: values of another kind, or no free cell.
            ConfigError: ``lethal`` is no cost.

        Example:
            >>> GridMap.from_costmap([[0, 252], [254, 255]], 0.05, (0.0, 0.0, 0.0)).free.tolist()
            [[False, False], [True, True]]
        """
        return cls._of(read_costmap(array, resolution, origin, lethal, unknown_is_free, name))

    @classmethod
    def _of(cls, raw: RawMap) -> GridMap:
        return cls(raw.free, raw.resolution, raw.origin, name=raw.name, unknown=raw.unknown)

    def __getstate__(self) -> dict[str, Any]:
        """Leave out the inflated maps when the map is sent to another process, or copied."""
        return {**self.__dict__, "_inflated": {}}

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
        return pixel_from_world(self.resolution, self.origin, self.height)

    @cached_property
    def world_from_pixel(self) -> Affine:
        """Pixel (u, v) -> world (x, y)."""
        return world_from_pixel(self.resolution, self.origin, self.height)

    def to_pixel(self, points: ArrayLike) -> NDArray[np.float64]:
        """Return world points as continuous pixel coordinates (u, v), both of shape (..., 2)."""
        return self.pixel_from_world(as_points(points))

    def to_world(self, pixels: ArrayLike) -> NDArray[np.float64]:
        """Return continuous pixel coordinates (u, v) as world points, both of shape (..., 2)."""
        return self.world_from_pixel(as_points(pixels))

    @property
    def bounds(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Lower and upper corner of the world box around the map, each (x, y)."""
        corners = self.to_world(
            [(0, 0), (self.width, 0), (0, self.height), (self.width, self.height)]
        )
        return corners.min(axis=0), corners.max(axis=0)

    def is_free(self, points: ArrayLike) -> Any:
        """Return whether world points lie in free pixels; outside the map nothing is free.

        Args:
            points: (x, y), world, shape (2,) or (..., 2).

        Returns:
            A ``bool`` for one point, which OMPL's callbacks may hand on; else an array (...).
        """
        result = pixels_are_free(self.free, self.to_pixel(points))
        return bool(result) if result.ndim == 0 else result

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

    def inflated(self, radius: float, border: bool = False) -> GridMap:
        """Return the map for the centre of a disc-shaped robot: obstacles grown by its radius.

        Every point of a pixel that stays free is at least ``radius`` away from every point of
        every blocked pixel (square to square), and every pixel for which that holds stays free.
        So the robot cannot touch an obstacle wherever in the pixel its centre is. The cost is that
        up to a pixel's diagonal of room is given away.

        Args:
            radius: in world units; 0 returns the map itself, any more blocks the pixels that
                touch an obstacle.
            border: whether what is beyond the border of the map is an obstacle as well.

        Raises:
            MapError: radius negative or not finite, or nothing stays free.
            ConfigError: ``border`` is no truth value.
        """
        truth_value("border", border)
        if not is_finite_number(radius) or radius < 0:
            raise MapError(f"the robot radius must be a length of at least 0, got {show(radius)}")
        radius = float(radius)
        if radius == 0 or (self.free.all() and not border):
            return self
        key = radius, border
        if key not in self._inflated:
            free = erode(self.free, radius, self.resolution, self.name, border)
            name = f"{self.name} (inflated by {radius:g})"
            grown = GridMap(free, self.resolution, self.origin, name=name, unknown=self.unknown)
            grown.bare = self.bare
            if len(self._inflated) == _KEPT_RADII:
                del self._inflated[next(iter(self._inflated))]
            self._inflated[key] = grown
        return self._inflated[key]

    @cached_property
    def clearance(self) -> Clearance:
        """How far the pixels are from obstacles, see :func:`.clearance.map_clearance`."""
        return map_clearance(self.free)

    @cached_property
    def components(self) -> NDArray[np.int32]:
        """Label of the connected free part that each pixel belongs to, (H, W); 0 where blocked.

        4-connected, because no motion passes between two obstacles that touch diagonally.
        """
        return label_components(self.free, connectivity=4)

    def check_task(self, start: ArrayLike, goal: ArrayLike) -> Endpoints:
        """Return start and goal as (2,) arrays, or raise if they cannot be planned for.

        Args:
            start: (x, y), world.
            goal: (x, y), world.

        Raises:
            TaskError: one of them is no point, outside the map, in an obstacle, in the margin of
                one or in unknown space, the two are equal, or no path connects them.
        """
        return check_endpoints(self, start, goal)

    def snap(self, point: ArrayLike, distance: float) -> NDArray[np.float64]:
        """Return a point itself where it is free, else the nearest free position near it.

        Args:
            point: (x, y), world.
            distance: the farthest that it is moved, world units.

        Raises:
            TaskError: it is no point, outside the map, or nothing within the distance is free.
            ConfigError: the distance is no length.

        Example:
            >>> GridMap([[0, 0, 1]]).snap((1.5, 0.5), 2.0).round(2).tolist()
            [2.0, 0.5]
        """
        return snap_to_free(self, "the point", point, finite_number("distance", distance, 0.0))

    def __repr__(self) -> str:
        frame = "image frame" if self.origin is None else f"origin {self.origin}"
        return (
            f"GridMap({self.name!r}, {self.width} x {self.height} pixels of {self.resolution:g}, "
            f"{frame}, {self.free.mean():.0%} free)"
        )
