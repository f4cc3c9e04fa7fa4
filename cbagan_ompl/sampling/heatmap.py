"""The heat map: where on a map a good path probably runs, as a distribution over free pixels."""

from __future__ import annotations

from os import PathLike
from typing import SupportsIndex

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..common.files import as_path
from ..common.validation import random_generator, whole_number
from ..errors import HeatmapError, show
from ..maps.checks import check_grid
from ..maps.connectivity import in_one_component
from ..maps.endpoints import check_point
from ..maps.grid_map import GridMap
from ..maps.grid_search import pull_taut, shortest_path
from ..robots.robot import Robot
from .bands import half_width, paint_band
from .bridges import connect
from .guarantee import Guarantee
from .headings import check_headings, descend, look_up, sample_headings
from .heatmap_files import read_heatmap_values
from .heatmap_values import to_unit_range
from .options import HeadingSpread
from .pixels import PixelPair, WeightedPixels, pixel_pair, sample_in_pixels
from .robot_heatmaps import robot_heatmap

#: A pixel whose value is at least this belongs to the promising region.
REGION_THRESHOLD = 0.5

# Half width of the corridor, where a planner should look, as a fraction of the map's longer side.
_CORRIDOR_FRACTION = 0.03

# Most points that one call of Heatmap.sample gives: about a gigabyte on the way.
_MOST_SAMPLES = 10**7


class Heatmap:
    """Values over the pixels of a :class:`GridMap`, read as an unnormalised density.

    Attributes:
        values: float32, shape (H, W), in [0, 1]; 0 on obstacles. From
            :data:`REGION_THRESHOLD` on, a pixel counts as part of the promising region.
        grid: the map that the values lie on.
        heading: float32, shape (H, W): the direction of travel in each pixel, world radians in
            [-pi, pi], NaN where unknown; or None where nothing is known.
        guarantee: what is known of the pixels from a threshold on; None where nothing is.
        support: flat row-major indices of the pixels with a value above 0, ascending, shape (K,).
        support_values: float32, the values of these pixels, shape (K,).

    Args:
        values: any real array of the grid's shape. Unsigned integers are scaled from their full
            range to [0, 1], but for masks of 0 and 1; other values must lie in it already.
        grid: the map.
        heading: any real array of the grid's shape, world radians, NaN where unknown. In the image
            frame, where y points down, a heading of pi / 2 points down as well.

    Raises:
        HeatmapError: no :class:`GridMap`, wrong shape or type, NaN, infinite or negative values,
            values above 1, or nothing above 0 on free space; headings of the wrong shape or type,
            or infinite ones.

    Example:
        >>> heatmap = Heatmap([[0.2, 0.8], [1.0, 0.0]], GridMap([[1, 1], [1, 0]]))
        >>> heatmap.region.tolist()
        [[False, True], [True, False]]
        >>> heatmap.sample(3, rng=0).shape
        (3, 2)
    """

    _last_connected: tuple[PixelPair | None, bool] = None, False  # a pair of pixels, and the answer

    def __init__(self, values: ArrayLike, grid: GridMap, heading: ArrayLike | None = None) -> None:
        check_grid(grid, HeatmapError)
        try:
            raw = np.asarray(values)
        except Exception as error:  # rows of different lengths, or whatever the class raises
            raise HeatmapError(
                f"a heat map is an array (H, W) of numbers, got {show(values)}"
            ) from error
        if raw.shape != grid.shape:
            raise HeatmapError(
                f"a heat map of {grid.name} has shape {grid.shape} (rows, columns), "
                f"this one has {raw.shape}"
            )
        scaled = to_unit_range(raw)
        scaled *= grid.free
        support = np.flatnonzero(scaled > 0)
        if not len(support):
            raise HeatmapError(
                f"the heat map is 0 on all free space of {grid.name}: there is nothing to sample; "
                "use Heatmap.uniform where nothing is known"
            )
        scaled.setflags(write=False)
        self.values: NDArray[np.float32] = scaled
        self.grid = grid
        self.heading = None if heading is None else check_headings(heading, grid)
        self.guarantee: Guarantee | None = None
        self.support: NDArray[np.intp] = support
        self.support_values: NDArray[np.float32] = scaled.ravel()[support]

    @classmethod
    def load(cls, path: str | PathLike[str], grid: GridMap) -> Heatmap:
        """Read a heat map of a grid: a gray image (black 0, white 1) or a NumPy ``.npy`` array.

        Pictures of a region as in the published data sets, green on white with black obstacles, are
        read as well: 1 in the region, 0 elsewhere. Other colours are an error.

        Args:
            path: the file; images are PNG, JPEG, BMP, PGM or PPM, recognised by their first bytes.
            grid: the map. Pixels correspond one by one, row 0 on top, whatever its world frame.

        Raises:
            HeatmapError: the file cannot be read, or holds no heat map of this grid.

        Example:
            >>> from pathlib import Path
            >>> from tempfile import TemporaryDirectory
            >>> with TemporaryDirectory() as folder:
            ...     path = Path(folder) / "heat.npy"
            ...     np.save(path, np.array([[0.2, 1.0]]))
            ...     Heatmap.load(path, GridMap([[1, 1]])).region.tolist()
            [[False, True]]
        """
        check_grid(grid, HeatmapError)
        return cls(read_heatmap_values(as_path(path, HeatmapError), grid.shape), grid)

    @classmethod
    def uniform(cls, grid: GridMap) -> Heatmap:
        """Return the trivial control: 1 on all free space.

        Args:
            grid: the map.

        Example:
            >>> Heatmap.uniform(GridMap([[1, 0], [1, 1]])).values.tolist()
            [[1.0, 0.0], [1.0, 1.0]]
        """
        check_grid(grid, HeatmapError)
        return cls(grid.free, grid)

    @classmethod
    def straight_line(cls, grid: GridMap, start: ArrayLike, goal: ArrayLike) -> Heatmap:
        """Return a band around the segment from start to goal, obstacles ignored.

        Args:
            grid: the map.
            start: (x, y), world.
            goal: (x, y), world.

        Raises:
            TaskError: see :meth:`GridMap.check_task`.

        Example:
            >>> Heatmap.straight_line(GridMap.load("bundled:rooms"), (20, 20), (230, 20))
            Heatmap('rooms', region 6% of free space)
        """
        check_grid(grid, HeatmapError)
        endpoints = grid.check_task(start, goal)
        return cls(
            paint_band(grid.shape, grid.to_pixel(endpoints), half_width(grid, _CORRIDOR_FRACTION)),
            grid,
        )

    @classmethod
    def corridor(
        cls, grid: GridMap, start: ArrayLike, goal: ArrayLike, robot: Robot | None = None
    ) -> Heatmap:
        """Return a band around the shortest path that a grid search finds: the oracle control.

        The search is 8-connected without cutting corners, its path pulled taut. It shows what a
        perfect heat map is worth; it solves the task of a point robot by itself.

        Args:
            grid: the map.
            start: (x, y), world, or a pose for a robot with heading.
            goal: the same.
            robot: what moves; the heat map lies on the map of its positions. None for a point.

        Raises:
            TaskError: see :meth:`GridMap.check_task`.

        Example:
            >>> heatmap = Heatmap.corridor(GridMap.load("bundled:rooms"), (20, 20), (230, 230))
            >>> heatmap.connects((20, 20), (230, 230))
            True
        """
        check_grid(grid, HeatmapError)
        if robot is not None:
            return robot_heatmap(cls.corridor, grid, robot, start, goal)
        endpoints = grid.to_pixel(grid.check_task(start, goal))
        pixels = shortest_path(grid.free, *pixel_pair(endpoints))
        assert pixels is not None, "check_task has made sure that a path exists"
        path = np.vstack((endpoints[:1], pull_taut(grid.free, pixels), endpoints[1:]))
        return cls(paint_band(grid.shape, path, half_width(grid, _CORRIDOR_FRACTION)), grid)

    @property
    def region(self) -> NDArray[np.bool_]:
        """The promising region: values from :data:`REGION_THRESHOLD` on, shape (H, W)."""
        return self.values >= REGION_THRESHOLD

    def connects(self, start: ArrayLike, goal: ArrayLike) -> bool:
        """Return whether the region holds both points and a 4-connected path between them.

        Args:
            start: (x, y), world.
            goal: (x, y), world.

        Raises:
            TaskError: one of them is no point.

        Example:
            >>> heatmap = Heatmap([[1.0, 0.2, 1.0]], GridMap([[1, 1, 1]]))
            >>> heatmap.connects((0.5, 0.5), (2.5, 0.5))
            False
        """
        endpoints = np.array((check_point("start", start), check_point("goal", goal)))
        if not self.grid.is_free(endpoints).all():
            return False
        return self._connects_pixels(pixel_pair(self.grid.to_pixel(endpoints)))

    def _connects_pixels(self, pixels: PixelPair) -> bool:
        """Return whether the region connects two pixels; the last answer is kept."""
        if self._last_connected[0] != pixels:
            self._last_connected = pixels, in_one_component(self.region, *pixels, connectivity=4)
        return self._last_connected[1]

    def connected(self, start: ArrayLike, goal: ArrayLike) -> Heatmap:
        """Return this heat map with a region that connects start and goal.

        Where the region falls apart, its parts are connected by the cheapest path through the heat
        map: inside the region a pixel costs next to nothing, outside the more the lower its value.

        Args:
            start: (x, y), world.
            goal: (x, y), world.

        Returns:
            The heat map itself when its region connects them already.

        Raises:
            TaskError: see :meth:`GridMap.check_task`.

        Example:
            >>> heatmap = Heatmap([[1.0, 0.2, 1.0]], GridMap([[1, 1, 1]]))
            >>> heatmap.connected((0.5, 0.5), (2.5, 0.5)).region.tolist()
            [[True, True, True]]
        """
        return connect(self, self.grid.to_pixel(self.grid.check_task(start, goal)))

    def with_heading(self, heading: ArrayLike | None) -> Heatmap:
        """Return this heat map with other headings.

        Args:
            heading: as for :class:`Heatmap`; None for none.

        Raises:
            HeatmapError: headings of the wrong shape or type, or infinite ones.

        Example:
            >>> heatmap = Heatmap([[1.0, 1.0]], GridMap([[1, 1]])).with_heading([[0.5, np.nan]])
            >>> heatmap.heading.tolist()
            [[0.5, nan]]
        """
        return Heatmap(self.values, self.grid, heading)

    def directed(self, goal: ArrayLike) -> Heatmap:
        """Return this heat map with the headings of the cheapest paths over it to a goal.

        A pixel length costs 1 / (value + 0.02), so that paths follow the heat map. The heading is
        the direction of descent of the cost-to-go, computed by Dijkstra's algorithm on a grid of
        blocks of four pixels: 2 ms on a map of 256 x 256 pixels.

        Args:
            goal: (x, y), world; or several, (G, 2), of which the nearest one counts.

        Raises:
            TaskError: a goal that is no point, or that lies outside of the map.

        Example:
            >>> grid = GridMap(np.ones((1, 64), bool))
            >>> heatmap = Heatmap.uniform(grid).directed((60.5, 0.5))
            >>> bool(abs(heatmap.heading[0, 5]) < 0.2)
            True
        """
        return self.with_heading(descend(self.values, self.grid, goal))

    def sample(
        self, n: SupportsIndex, rng: np.random.Generator | SupportsIndex | None = None
    ) -> NDArray[np.float64]:
        """Sample points with a density proportional to the values.

        Pixels are sampled exactly, by the inverse of the cumulative sum; inside its pixel a point
        is uniform.

        Args:
            n: how many points, at most ten million.
            rng: a generator, or the seed of a new one.

        Returns:
            World points, shape (n, 2).

        Raises:
            ConfigError: ``n`` is no such number, or ``rng`` neither a generator nor a seed.
        """
        count = whole_number("n", n, 0, _MOST_SAMPLES)
        generator = random_generator(rng)
        weighted = WeightedPixels(self.support, self.support_values)
        pixels = weighted.sample(count, generator)
        return sample_in_pixels(self.grid, pixels, generator)

    def sample_poses(
        self,
        n: SupportsIndex,
        rng: np.random.Generator | SupportsIndex | None = None,
        spread: HeadingSpread | None = None,
        reverses: bool = False,
    ) -> NDArray[np.float64]:
        """Sample poses: positions as :meth:`sample` does, headings around those of the heat map.

        Args:
            n: how many poses, at most ten million.
            rng: a generator, or the seed of a new one.
            spread: of the headings around those of the heat map; the default for None. Where the
                heat map knows none they are uniform.
            reverses: whether the robot drives backwards as well.

        Returns:
            (x, y, yaw), shape (n, 3), world, yaw in [-pi, pi).

        Raises:
            ConfigError: as for :meth:`sample`, or ``spread`` is no :class:`HeadingSpread`.

        Example:
            >>> heatmap = Heatmap([[1.0]], GridMap([[1]]), heading=[[0.5]])
            >>> heatmap.sample_poses(3, rng=0).shape
            (3, 3)
        """
        generator = random_generator(rng)
        points = self.sample(n, generator)
        headings = sample_headings(
            look_up(self.heading, self.grid, points), spread, generator, reverses
        )
        return np.column_stack((points, headings))

    def __repr__(self) -> str:
        fraction = self.region.sum() / self.grid.free.sum()
        return f"Heatmap({self.grid.name!r}, region {fraction:.0%} of free space)"
