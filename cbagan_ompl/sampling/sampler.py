"""One stream of draws for a planner: heat map mixed with uniform, counted, from one generator."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import inf, isfinite, nan
from random import Random
from typing import SupportsFloat

import numpy as np
from numpy.typing import NDArray

from ..errors import ConfigError, HeatmapError
from ..maps.grid_map import GridMap
from .adaptation import Trust
from .heatmap import Heatmap, draw_pixels, points_in

#: Share of draws that stays uniform over free space unless the user asks otherwise.
DEFAULT_UNIFORM_FRACTION = 0.1

#: Power of the heat map that planners draw from which go on to the shortest path: those that stop
#: at their first path are served best by the heat map as it is.
OPTIMIZING_SHARPNESS = 3.0

# The first batch is small, because small tasks need few draws; each is twice the one before.
_FIRST_BATCH, _LARGEST_BATCH = 128, 1024
# Candidates of which a local draw picks one, with probability proportional to the heat map.
_LOCAL_CANDIDATES = 32
# Share of a batch inside the informed set under which the weights are made to follow the set: while
# most draws fall inside, dropping the others is cheaper than weighing all pixels again.
_MIN_ACCEPTED = 0.5

# Draws of the heat map that may fall where the tree is already, before a uniform one takes their
# place.
_MAX_DROPPED = 20

# Batches without a single point inside the informed set before a draw from outside is let through.
_MAX_EMPTY_BATCHES = 8


@dataclass(frozen=True)
class InformedSet:
    """The points that a path shorter than a given cost can pass: an ellipse for one start and goal.

    Attributes:
        starts: (x, y), shape (S, 2), world.
        goals: (x, y), shape (G, 2), world.
        tolerance: how far from a goal a path may end, world units.
    """

    starts: NDArray[np.float64]
    goals: NDArray[np.float64]
    tolerance: float

    def shortest_through(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Lower bound on the length of a path through each point; (N, 2) -> (N,)."""
        return _nearest(points, self.starts) + _nearest(points, self.goals) - self.tolerance

    def shortest_through_pixels(self, grid: GridMap) -> NDArray[np.float64]:
        """The same for the points of each pixel: no lower one is in it; (H, W)."""
        to_ends = _nearest_to_centres(grid, self.starts) + _nearest_to_centres(grid, self.goals)
        # The bound changes at most twice as fast as the distance from the centre, half a diagonal.
        return np.asarray(to_ends - (self.tolerance + np.sqrt(2) * grid.resolution))


class HeatmapSampler:
    """Endless draws for one planner, made in batches and handed out one by one.

    Each draw comes from the heat map, or with probability ``uniform_fraction`` from the uniform
    distribution over free space, so that every free pixel keeps a positive probability and the
    planner stays probabilistically complete.

    Attributes:
        rng: the generator of the draws, and of whatever else belongs to the same run.
        chance: a number in [0, 1) at each call, drawn from it.

    Args:
        heatmap: where to draw.
        uniform_fraction: in (0, 1].
        seed: seed or generator of the draws; the same seed gives the same draws.
        sharpness: power of the heat map that the density of its draws is proportional to; above 0.

    Raises:
        ConfigError: ``uniform_fraction`` outside (0, 1], or a ``sharpness`` that is no finite
            number above 0.
    """

    def __init__(
        self,
        heatmap: Heatmap,
        uniform_fraction: float = DEFAULT_UNIFORM_FRACTION,
        seed: int | np.random.Generator | None = None,
        sharpness: float = 1.0,
    ) -> None:
        _check_uniform_fraction(uniform_fraction)
        _check_sharpness(sharpness)
        self.heatmap = heatmap
        self.uniform_fraction = float(uniform_fraction)
        self._sharpness = np.float32(sharpness)
        self.learned = 0
        self.uniform = 0
        self.rng = np.random.default_rng(seed)
        # A generator of single numbers, which NumPy's is slow at.
        self.chance = Random(int(self.rng.integers(2**63))).random
        grid, support = heatmap.grid, heatmap.support
        hottest = heatmap.values.max()
        weights = (heatmap.values.ravel()[support] / hottest) ** self._sharpness
        self._hot = _Source(grid, support, weights, self.rng)
        self._even = _Source(grid, grid.free_pixels, None, self.rng)
        self._best_cost: Callable[[], float] = _no_cost
        self._informed_set: Callable[[], InformedSet | None] = _no_set
        self._best = inf
        self._trust: Trust | None = None
        self._box = np.full(2, -inf), np.full(2, inf)

    @property
    def sample_counts(self) -> dict[str, int]:
        """Draws handed out so far: ``{"learned": n, "uniform": m}``."""
        return {"learned": self.learned, "uniform": self.uniform}

    def keep_inside(self, low: NDArray[np.float64], high: NDArray[np.float64]) -> None:
        """Draw only inside a box, such as the bounds of a state space.

        Args:
            low: lower bounds, (2,), world.
            high: upper bounds, (2,), world.

        Raises:
            HeatmapError: the heat map is 0 everywhere inside.
        """
        if np.array_equal(self._box, (low, high)):
            return
        self._box = low, high
        map_low, map_high = self.heatmap.grid.bounds
        if (low > map_low).any() or (high < map_high).any():
            self._hot.keep_inside(low, high)
            self._even.keep_inside(low, high)

    def follow(
        self,
        best_cost: Callable[[], float],
        informed_set: Callable[[], InformedSet | None] | None = None,
    ) -> None:
        """Draw only where a path cheaper than the best known one can pass.

        Args:
            best_cost: called at every draw; the cost of the best known path, infinite before it.
            informed_set: called once a solution is known; the set, by start and goal, or None to
                draw everywhere, as without this function.
        """
        self._best_cost = best_cost
        self._informed_set = informed_set or _no_set

    def prepare(self) -> None:
        """Make the first draws now, rather than when the first one is asked for."""
        self._hot.prepare()
        self._even.prepare()

    def adapt(self, trust: Trust) -> None:
        """Follow the heat map as far as the tree needs it.

        Args:
            trust: told of the draws of :meth:`next`, and asked where none need go.
        """
        self._trust = trust

    def next(self) -> tuple[float, float]:
        """The next draw, (x, y) in world coordinates."""
        best = self._best_cost()
        if best != self._best:
            self._change_best(best)
        if self.chance() >= self.uniform_fraction:
            trust = self._trust
            if trust is None or best < inf:
                point = self._hot.next(best, None)
            else:
                trust.drawn()
                point = self._hot.next(best, trust.spent)
                if point is None:
                    trust.blocked()
            if point is not None:
                self.learned += 1
                return point
        self.uniform += 1
        point = self._even.next(best, None)
        assert point is not None, "nothing was to be avoided"
        return point

    def _change_best(self, best: float) -> None:
        if (best < inf) != (self._best < inf):
            informed = self._informed_set() if best < inf else None
            self._hot.inform(informed)
            self._even.inform(informed)
        if self._trust is not None:
            if best < self._best:
                self._trust.improved()
            else:
                self._trust.restart()
        self._best = best

    def near(self, x: float, y: float, distance: float) -> tuple[float, float]:
        """A draw within ``distance`` of (x, y) along each axis (OMPL's box neighbourhood)."""
        low = np.maximum((x - distance, y - distance), self._box[0])
        high = np.minimum((x + distance, y + distance), self._box[1])
        return self._pick(self.rng.uniform(low, np.maximum(low, high), (_LOCAL_CANDIDATES, 2)))

    def gaussian(self, x: float, y: float, deviation: float) -> tuple[float, float]:
        """A draw around (x, y) with the given standard deviation along each axis."""
        candidates = self.rng.normal((x, y), deviation, (_LOCAL_CANDIDATES, 2))
        return self._pick(np.clip(candidates, *self._box))

    def _pick(self, candidates: NDArray[np.float64]) -> tuple[float, float]:
        """Resample one of the candidates by its heat, or the first one as the uniform draw."""
        grid = self.heatmap.grid
        chosen, uniform = 0, True
        if self.chance() >= self.uniform_fraction:
            free = grid.is_free(candidates)
            columns, rows = grid.to_pixel(candidates[free]).astype(np.intp).T
            heat = np.zeros(len(candidates))
            heat[free] = self.heatmap.values[rows, columns] ** self._sharpness
            cumulative = heat.cumsum()
            if cumulative[-1] > 0:
                threshold = self.chance() * cumulative[-1]
                chosen = int(np.searchsorted(cumulative, threshold, side="right"))
                uniform = False
        self.uniform += uniform
        self.learned += not uniform
        x, y = candidates[chosen].tolist()
        return x, y


class _Source:
    """Endless draws of weighted pixels, kept inside a box and made to follow the informed set.

    Args:
        grid: the map.
        support: flat row-major indices of the pixels, (K,).
        weights: of the pixels, (K,); None where all weigh the same.
        rng: the generator.
    """

    def __init__(
        self,
        grid: GridMap,
        support: NDArray[np.intp],
        weights: NDArray[np.float32] | None,
        rng: np.random.Generator,
    ) -> None:
        self._grid = grid
        self._rng = rng
        self._support = support
        self._weights = weights
        self._box: tuple[NDArray[np.float64], NDArray[np.float64]] | None = None
        self._batch = _FIRST_BATCH
        self._pending: list[tuple[float, float, float, int]] = []
        self.inform(None)

    def keep_inside(self, low: NDArray[np.float64], high: NDArray[np.float64]) -> None:
        """Draw only inside a box."""
        # Pixels that the box cuts keep their weight, the draws outside are dropped.
        reach = self._grid.resolution * np.sqrt(0.5)
        rows, columns = np.divmod(self._support, self._grid.width)
        centres = self._grid.to_world(np.stack((columns, rows), axis=-1) + 0.5)
        touching = _inside(centres, low - reach, high + reach)
        if not touching.any():
            raise HeatmapError(
                f"the heat map of {self._grid.name} is 0 everywhere in the space, which spans "
                f"x {low[0]:g} to {high[0]:g} and y {low[1]:g} to {high[1]:g}; the "
                "space must be in the coordinates of the map"
            )
        self._support = self._support[touching]
        if self._weights is not None:
            self._weights = self._weights[touching]
        self._box = low, high
        self.inform(None)

    def inform(self, informed: InformedSet | None) -> None:
        """Draw only in the informed set from now on, or everywhere."""
        self._informed = informed
        self._accepted = 1.0
        self._bounds: NDArray[np.float64] | None = None
        self._pending.clear()
        if informed is None:
            self._weigh(inf)

    def next(self, best: float, avoid: bytearray | None) -> tuple[float, float] | None:
        """The next draw, (x, y) in world coordinates, where a path cheaper than ``best`` passes.

        Args:
            best: cost of the best known path.
            avoid: row-major bytes of the pixels, 1 where draws are dropped; None drops none.

        Returns:
            None when too many draws in a row had to be dropped for ``avoid``.
        """
        dropped = 0
        for _ in range(_MAX_EMPTY_BATCHES):
            while self._pending:
                x, y, bound, pixel = self._pending.pop()
                if bound <= best:
                    if avoid is None or not avoid[pixel]:
                        return x, y
                    dropped += 1
                    if dropped == _MAX_DROPPED:
                        return None
            self._refill(best)
        # Nothing of the map is in the informed set: any draw is as good as another.
        x, y, _, _ = self._pending.pop()
        if self._box is not None:
            x, y = np.clip((x, y), *self._box).tolist()
        return x, y

    def prepare(self) -> None:
        """Make a batch of draws."""
        if not self._pending:
            self._refill(inf)

    def _refill(self, best: float) -> None:
        size, self._batch = self._batch, min(2 * self._batch, _LARGEST_BATCH)
        if self._accepted < _MIN_ACCEPTED:
            self._weigh(best)
        pixels = draw_pixels(self._active, self._cumulative, size, self._rng)
        points = points_in(self._grid, pixels, self._rng)
        bounds = np.full(size, -inf)
        if self._informed is not None:
            bounds = self._informed.shortest_through(points)
            self._accepted = float((bounds <= best).mean())
        if self._box is not None:
            bounds[~_inside(points, *self._box)] = nan  # no cost is above it: never handed out
        columns = points[:, 0], points[:, 1], bounds, pixels
        self._pending = list(zip(*(column.tolist() for column in columns), strict=True))

    def _weigh(self, best: float) -> None:
        """Weigh only pixels with points in the informed set; where there are none, all of them."""
        self._active, weights = self._support, self._weights
        if self._informed is not None:
            if self._bounds is None:
                bounds = self._informed.shortest_through_pixels(self._grid)
                self._bounds = bounds.ravel()[self._support]
            inside = np.asarray(self._bounds <= best)
            if inside.any():
                self._active = self._support[inside]
                weights = None if weights is None else weights[inside]
        self._cumulative = None if weights is None else weights.cumsum(dtype=np.float64)


def check_draw_options(uniform_fraction: float, sharpness: float | None) -> None:
    """Refuse options that no stream of draws can be made with.

    Args:
        uniform_fraction: see :class:`HeatmapSampler`.
        sharpness: the same, or None where the planner decides.

    Raises:
        ConfigError: see :class:`HeatmapSampler`.
    """
    _check_uniform_fraction(uniform_fraction)
    if sharpness is not None:
        _check_sharpness(sharpness)


def _check_uniform_fraction(uniform_fraction: float) -> None:
    if not (isinstance(uniform_fraction, SupportsFloat) and 0 < uniform_fraction <= 1):
        raise ConfigError(
            f"uniform_fraction is a share above 0 and up to 1, got {uniform_fraction!r}; it "
            "cannot be 0, because the planner would lose probabilistic completeness"
        )


def _check_sharpness(sharpness: float) -> None:
    if not (isinstance(sharpness, SupportsFloat) and isfinite(sharpness) and sharpness > 0):
        raise ConfigError(f"sharpness is a finite number above 0, got {sharpness!r}")


def _inside(
    points: NDArray[np.float64], low: NDArray[np.float64], high: NDArray[np.float64]
) -> NDArray[np.bool_]:
    return np.asarray(((points >= low) & (points <= high)).all(axis=1))


def _nearest(points: NDArray[np.float64], ends: NDArray[np.float64]) -> NDArray[np.float64]:
    distances = [np.hypot(points[:, 0] - x, points[:, 1] - y) for x, y in ends.tolist()]
    return np.asarray(np.minimum.reduce(distances))


def _nearest_to_centres(grid: GridMap, ends: NDArray[np.float64]) -> NDArray[np.float64]:
    """Distance of each pixel's centre from the nearest of some points, (H, W), world units."""
    columns, rows = np.arange(grid.width) + 0.5, np.arange(grid.height)[:, None] + 0.5
    squares = [(columns - u) ** 2 + (rows - v) ** 2 for u, v in grid.to_pixel(ends).tolist()]
    return np.asarray(grid.resolution * np.sqrt(np.minimum.reduce(squares)))


def _no_cost() -> float:
    return inf


def _no_set() -> None:
    return None
