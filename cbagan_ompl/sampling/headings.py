"""Headings: in which direction a good path passes each pixel, and headings sampled from that."""

from __future__ import annotations

from functools import cached_property
from math import floor, inf, isnan, nan, pi
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import HeatmapError, show
from ..maps.cost_to_go import descent_directions
from ..maps.endpoints import check_position
from ..maps.grid_map import GridMap
from .options import HeadingSpread

if TYPE_CHECKING:
    from .heatmap import Heatmap

# The cost of a pixel length where the value of the heat map is v is 1 / (v + _LEAST_VALUE).
_LEAST_VALUE = 0.02

# Headings that are sampled at a time.
_BATCH = 512

#: How far a heading may deviate from that of the heat map and still follow it, radians.
FOLLOWING = 0.6


def check_headings(heading: ArrayLike, grid: GridMap) -> NDArray[np.float32]:
    """Return an array of headings of a map as float32, (H, W), read-only.

    Args:
        heading: world radians, NaN where unknown; any real array of the grid's shape.
        grid: the map.

    Raises:
        HeatmapError: not such an array, or with infinite values.
    """
    try:
        raw = np.asarray(heading)
    except Exception as error:  # rows of different lengths, or whatever the class raises
        raise HeatmapError(
            f"headings are an array (H, W) of numbers, got {show(heading)}"
        ) from error
    if raw.dtype.kind not in "iuf":
        raise HeatmapError(f"headings are real numbers, radians, not {show(str(raw.dtype))}")
    if raw.shape != grid.shape:
        raise HeatmapError(
            f"the headings of {grid.name} have shape {grid.shape} (rows, columns), these have "
            f"{raw.shape}"
        )
    if np.isinf(raw).any():
        raise HeatmapError(
            f"the headings hold {int(np.isinf(raw).sum())} infinite values; where a heading is "
            "unknown it is NaN"
        )
    # Wrapped before the rounding to float32, which large angles do not survive.
    wrapped = ((raw.astype(np.float64) + np.pi) % (2 * np.pi) - np.pi).astype(np.float32)
    wrapped.setflags(write=False)
    return wrapped


def descend(values: NDArray[np.float32], grid: GridMap, goal: ArrayLike) -> NDArray[np.float32]:
    """Return the headings of the cheapest paths over a heat map to the nearest goal.

    Args:
        values: of the heat map, (H, W), 0 on obstacles.
        grid: the map.
        goal: (x, y), world; or several, (G, 2).

    Returns:
        World radians, (H, W); NaN on obstacles and where no path leads.

    Raises:
        TaskError: a goal that is no point on the map.
    """
    is_several = isinstance(goal, list | tuple | np.ndarray) and np.ndim(goal) > 1
    points: Any = goal if is_several else [goal]
    goals = np.array([check_position(grid, "goal", point) for point in points])
    cost = np.reciprocal(values + np.float32(_LEAST_VALUE))
    angles = descent_directions(grid.free, cost, grid.to_pixel(goals))
    # A ROS map is turned by the yaw of its origin, and its y points up.
    return angles if grid.origin is None else np.float32(grid.origin[2]) - angles


def look_up(
    heading: NDArray[np.float32] | None, grid: GridMap, points: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the headings at points on the map, (N,), NaN where unknown.

    Args:
        heading: world radians, (H, W); None where nothing is known.
        grid: the map.
        points: (N, 2), world.
    """
    if heading is None:
        return np.full(len(points), np.nan)
    columns, rows = grid.to_pixel(points).astype(np.intp).T
    return np.asarray(heading[rows, columns], np.float64)


def sample_headings(
    known: NDArray[np.float64],
    options: HeadingSpread | None,
    rng: np.random.Generator,
    reverses: bool = False,
) -> NDArray[np.float64]:
    """Sample headings around known ones.

    Args:
        known: radians, NaN where unknown, any shape.
        options: how far the samples spread; the defaults for None.
        rng: the generator.
        reverses: whether the robot drives backwards as well; otherwise no heading is reversed.

    Returns:
        Radians in [-pi, pi), the shape of ``known``; uniform where the heading is unknown.

    Example:
        >>> rng = np.random.default_rng(0)
        >>> headings = sample_headings(np.full(1000, 1.0), HeadingSpread(spread=0.1), rng)
        >>> bool(abs((np.abs(headings - 1.0) < 0.3).mean() - 0.8) < 0.05)
        True
    """
    options = options or HeadingSpread()
    headings = known + rng.normal(0.0, options.spread, known.shape)
    choice = rng.random(known.shape)
    uniform, reversals = options.uniform_fraction, options.reverse_fraction if reverses else 0.0
    headings += np.pi * (choice < uniform + (1 - uniform) * reversals)
    headings = np.where(
        (choice < uniform) | np.isnan(headings), rng.uniform(-np.pi, np.pi, known.shape), headings
    )
    return np.asarray((headings + np.pi) % (2 * np.pi) - np.pi)


class HeadingSampler:
    """Sample the heading of a pose whose position is given.

    Args:
        heatmap: whose headings are followed.
        options: how far the samples spread around them.
        rng: the generator of the samples.
        reverses: whether the robot drives backwards as well; otherwise no heading is reversed.

    Example:
        >>> from cbagan_ompl import GridMap, Heatmap
        >>> heatmap = Heatmap([[1.0]], GridMap([[1]]))
        >>> sampler = HeadingSampler(heatmap, HeadingSpread(), np.random.default_rng(0))
        >>> -pi <= sampler.sample(0.5, 0.5) < pi
        True
    """

    def __init__(
        self,
        heatmap: Heatmap,
        options: HeadingSpread,
        rng: np.random.Generator,
        reverses: bool = False,
    ) -> None:
        grid = heatmap.grid
        self._heatmap = heatmap
        self._affine = tuple(grid.pixel_from_world)
        self._width, self._height = grid.width, grid.height
        self._options, self._rng, self._reverses = options, rng, reverses
        self._pending: list[tuple[float, float]] = []

    def sample(self, x: float, y: float) -> float:
        """Return the heading of a sample, in [-pi, pi), since OMPL takes pi to be out of bounds.

        Args:
            x: of the sample, world.
            y: of the sample, world.
        """
        if not self._pending:
            self._refill()
        deviation, uniform = self._pending.pop()
        heading = self._known(x, y)
        return uniform if isnan(heading) else (heading + deviation + pi) % (2 * pi) - pi

    def are_followed(self, x: float, y: float, yaw: float) -> bool:
        """Return whether a pose has about the heading of the heat map, or none is known there.

        Args:
            x: of the pose, world.
            y: of the pose, world.
            yaw: of the pose, radians. A robot that drives backwards may be turned by pi.
        """
        # NaN fails the comparison.
        deviation = abs((yaw - self._known(x, y) + pi) % (2 * pi) - pi)
        return not (FOLLOWING < deviation < (pi - FOLLOWING if self._reverses else inf))

    @cached_property
    def _headings(self) -> memoryview | None:
        """The headings of the pixels in a row: computed where poses are sampled, not for points."""
        known = None if self._options.uniform_fraction == 1 else self._heatmap.heading
        return None if known is None else known.reshape(-1).data

    def _refill(self) -> None:
        # What is sampled around 0 may be added to any heading.
        known = np.array((0.0, np.nan)).repeat(_BATCH)
        samples = sample_headings(known, self._options, self._rng, self._reverses)
        deviations, uniform = samples.reshape(2, _BATCH).tolist()
        self._pending = list(zip(deviations, uniform, strict=True))

    def _known(self, x: float, y: float) -> float:
        """Return the heading of the heat map at a position, NaN where there is none."""
        if self._headings is None:
            return nan
        a, b, c, d, e, f = self._affine
        u, v = floor(a * x + b * y + c), floor(d * x + e * y + f)
        if not (0 <= u < self._width and 0 <= v < self._height):
            return nan
        heading: float = self._headings[v * self._width + u]
        return heading
