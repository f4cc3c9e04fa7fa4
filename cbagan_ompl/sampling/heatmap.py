"""The heat map: where on a map a good path probably runs, as a distribution over free pixels."""

from __future__ import annotations

from os import PathLike
from pathlib import Path
from typing import Any, SupportsIndex

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..common.validation import random_generator, whole_number
from ..errors import HeatmapError, show
from ..maps.connectivity import in_one_component
from ..maps.endpoints import check_point
from ..maps.grid_map import GridMap
from ..maps.grid_search import pull_taut, shortest_path
from .bands import half_width, paint_band
from .heatmap_files import read_heatmap_values
from .pixels import pixel_pair, sample_in_pixels, sample_pixels

#: A pixel whose value is at least this belongs to the promising region.
REGION_THRESHOLD = 0.5

# Half widths of painted paths, as a fraction of the map's longer side: the corridor is where a
# planner should look, the bridge only connects parts of a region and is kept narrow.
_CORRIDOR_FRACTION = 0.03
_BRIDGE_FRACTION = 0.015

# Most points that one call of Heatmap.sample gives: about a gigabyte on the way.
_MOST_SAMPLES = 10**7

# Longest side of the coarse grid in which bridges are looked for.
_REPAIR_SIZE = 64

# Cost of a pixel length inside the region, relative to one where the heat map is 0.
_REGION_COST = 0.02


class Heatmap:
    """Values over the pixels of a :class:`GridMap`, read as an unnormalised density.

    Attributes:
        values: float32, shape (H, W), in [0, 1]; 0 on obstacles. From
            :data:`REGION_THRESHOLD` on, a pixel counts as part of the promising region.
        grid: the map that the values lie on.

    Args:
        values: any real array of the grid's shape. Unsigned integers are scaled from their full
            range to [0, 1], but for masks of 0 and 1; other values must lie in it already.
        grid: the map.

    Raises:
        HeatmapError: no :class:`GridMap`, wrong shape or type, NaN, infinite or negative values,
            values above 1, or nothing above 0 on free space.

    Example:
        >>> heatmap = Heatmap([[0.2, 0.8], [1.0, 0.0]], GridMap([[1, 1], [1, 0]]))
        >>> heatmap.region.tolist()
        [[False, True], [True, False]]
        >>> heatmap.sample(3, rng=0).shape
        (3, 2)
    """

    def __init__(self, values: ArrayLike, grid: GridMap) -> None:
        _check_grid(grid)
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
        scaled = _to_unit_range(raw)
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
        self._support = support

    @classmethod
    def load(cls, path: str | PathLike[str], grid: GridMap) -> Heatmap:
        """Read a heat map of a grid: a grey image (black 0, white 1) or a NumPy ``.npy`` array.

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
        _check_grid(grid)
        if not isinstance(path, str | PathLike):
            raise HeatmapError(f"the file of a heat map is a path, got {show(path)}")
        return cls(read_heatmap_values(Path(path), grid.shape), grid)

    @classmethod
    def uniform(cls, grid: GridMap) -> Heatmap:
        """Return the trivial control: 1 on all free space.

        Args:
            grid: the map.

        Example:
            >>> Heatmap.uniform(GridMap([[1, 0], [1, 1]])).values.tolist()
            [[1.0, 0.0], [1.0, 1.0]]
        """
        _check_grid(grid)
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
        _check_grid(grid)
        endpoints = grid.check_task(start, goal)
        return cls(
            paint_band(grid.shape, grid.to_pixel(endpoints), half_width(grid, _CORRIDOR_FRACTION)),
            grid,
        )

    @classmethod
    def corridor(cls, grid: GridMap, start: ArrayLike, goal: ArrayLike) -> Heatmap:
        """Return a band around the shortest path that a grid search finds: the oracle control.

        The search is 8-connected without cutting corners, its path pulled taut. It shows what a
        perfect heat map is worth; it solves the task of a point robot by itself.

        Args:
            grid: the map.
            start: (x, y), world.
            goal: (x, y), world.

        Raises:
            TaskError: see :meth:`GridMap.check_task`.

        Example:
            >>> heatmap = Heatmap.corridor(GridMap.load("bundled:rooms"), (20, 20), (230, 230))
            >>> heatmap.connects((20, 20), (230, 230))
            True
        """
        _check_grid(grid)
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
        pixels = pixel_pair(self.grid.to_pixel(endpoints))
        return in_one_component(self.region, *pixels, connectivity=4)

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
        endpoints = self.grid.to_pixel(self.grid.check_task(start, goal))
        if self.connects(start, goal):
            return self
        cost = np.where(self.region, np.float32(_REGION_COST), 1 + _REGION_COST - self.values)
        pixels = shortest_path(self.grid.free, *pixel_pair(endpoints), cost, _REPAIR_SIZE)
        assert pixels is not None, "check_task has made sure that a path exists"
        bridge = paint_band(
            self.grid.shape, pixels + np.float64(0.5), half_width(self.grid, _BRIDGE_FRACTION)
        )
        return Heatmap(np.maximum(self.values, bridge), self.grid)

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
        cumulative = self.values.ravel()[self._support].cumsum(dtype=np.float64)
        pixels = sample_pixels(self._support, cumulative, count, generator)
        return sample_in_pixels(self.grid, pixels, generator)

    @property
    def support(self) -> NDArray[np.intp]:
        """Flat row-major indices of the pixels with a value above 0, ascending, shape (K,)."""
        return self._support

    def __repr__(self) -> str:
        fraction = self.region.sum() / self.grid.free.sum()
        return f"Heatmap({self.grid.name!r}, region {fraction:.0%} of free space)"


def check_heatmap(heatmap: object) -> None:
    """Raise if a value is no heat map.

    Raises:
        HeatmapError: it is none; the message says how to make one of an array.
    """
    if not isinstance(heatmap, Heatmap):
        raise HeatmapError(
            f"expected a Heatmap, got {show(heatmap)}; an array of values becomes one with "
            "Heatmap(values, grid)"
        )


def _check_grid(grid: object) -> None:
    if not isinstance(grid, GridMap):
        raise HeatmapError(
            f"a heat map lies on a GridMap, got {show(grid)}; an array of free pixels becomes one "
            "with GridMap(free), a map file with GridMap.load(path)"
        )


def _to_unit_range(raw: NDArray[Any]) -> NDArray[np.float32]:
    """Return a fresh array of the values in [0, 1]."""
    if raw.dtype.kind in "bu":
        is_mask = raw.dtype.kind == "b" or raw.max() <= 1
        full = 1 if is_mask else np.iinfo(raw.dtype).max
        return raw.astype(np.float32) / np.float32(full)
    if raw.dtype.kind not in "if":
        raise HeatmapError(f"a heat map holds real numbers, not {raw.dtype}")
    with np.errstate(over="ignore"):  # what is too large becomes infinite
        values = raw.astype(np.float32)
    if not np.isfinite(values).all():
        raise HeatmapError(
            f"the heat map holds {int((~np.isfinite(values)).sum())} NaN or infinite values"
        )
    low, high = float(values.min()), float(values.max())
    if low < 0 or high > 1:
        raise HeatmapError(
            f"heat map values lie in [0, 1], these span {low:g} to {high:g}; "
            "shift and scale them first"
        )
    return values
