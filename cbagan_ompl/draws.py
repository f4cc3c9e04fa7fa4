"""One stream of draws for a planner: heat map mixed with uniform, counted, from one generator."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import inf

import numpy as np
from numpy.typing import NDArray

from .errors import ConfigError
from .heatmap import Heatmap, draw_points

#: Share of draws that stays uniform over free space unless the user asks otherwise.
DEFAULT_UNIFORM_FRACTION = 0.1

# The first batch is small, because small tasks need few draws; each is twice the one before.
_FIRST_BATCH, _LARGEST_BATCH = 64, 1024
# Candidates of which a local draw picks one, with probability proportional to the heat map.
_LOCAL_CANDIDATES = 32
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


class DrawStream:
    """Endless draws for one planner, made in batches and handed out one by one.

    Each draw comes from the heat map, or with probability ``uniform_fraction`` from the uniform
    distribution over free space, so that every free pixel keeps a positive probability and the
    planner stays probabilistically complete.

    Attributes:
        rng: the generator of the draws, and of whatever else belongs to the same run.

    Args:
        heatmap: where to draw.
        uniform_fraction: in (0, 1].
        seed: seed or generator of the draws; the same seed gives the same draws.

    Raises:
        ConfigError: ``uniform_fraction`` outside (0, 1].
    """

    def __init__(
        self,
        heatmap: Heatmap,
        uniform_fraction: float = DEFAULT_UNIFORM_FRACTION,
        seed: int | np.random.Generator | None = None,
    ) -> None:
        if not 0 < uniform_fraction <= 1:
            raise ConfigError(
                f"uniform_fraction is a share above 0 and up to 1, got {uniform_fraction}; it "
                "cannot be 0, because the planner would lose probabilistic completeness"
            )
        self.heatmap = heatmap
        self.uniform_fraction = float(uniform_fraction)
        self.learned = 0
        self.uniform = 0
        self.rng = np.random.default_rng(seed)
        self._parts = (_Part(heatmap), _Part(Heatmap.uniform(heatmap.grid)))
        self._batch = _FIRST_BATCH
        self._pending: list[tuple[float, float, float, bool]] = []
        self._best_cost: Callable[[], float] = _no_cost
        self._informed_set: Callable[[], InformedSet] = _no_set
        self._informed: InformedSet | None = None

    @property
    def draws(self) -> dict[str, int]:
        """Draws handed out so far: ``{"learned": n, "uniform": m}``."""
        return {"learned": self.learned, "uniform": self.uniform}

    def reset_counts(self) -> None:
        """Start counting at 0 again."""
        self.learned = self.uniform = 0

    def follow(
        self, best_cost: Callable[[], float], informed_set: Callable[[], InformedSet]
    ) -> None:
        """Draw only where a path cheaper than the best known one can pass.

        Args:
            best_cost: called at every draw; the cost of the best known path, infinite before it.
            informed_set: called once a solution is known; the set, by start and goal.
        """
        self._best_cost = best_cost
        self._informed_set = informed_set

    def next(self) -> tuple[float, float]:
        """The next draw, (x, y) in world coordinates."""
        best = self._best_cost()
        if (best < inf) != (self._informed is not None):
            self._inform(self._informed_set() if best < inf else None)
        for _ in range(_MAX_EMPTY_BATCHES):
            while self._pending:
                x, y, bound, uniform = self._pending.pop()
                if bound <= best:
                    return self._count(x, y, uniform)
            self._refill(best)
        x, y, _, uniform = self._pending.pop()
        return self._count(x, y, uniform)

    def near(self, x: float, y: float, distance: float) -> tuple[float, float]:
        """A draw within ``distance`` of (x, y) along each axis (OMPL's box neighbourhood)."""
        offsets = self.rng.uniform(-distance, distance, (_LOCAL_CANDIDATES, 2))
        return self._pick(np.array((x, y)) + offsets)

    def gaussian(self, x: float, y: float, deviation: float) -> tuple[float, float]:
        """A draw around (x, y) with the given standard deviation along each axis."""
        return self._pick(self.rng.normal((x, y), deviation, (_LOCAL_CANDIDATES, 2)))

    def _inform(self, informed: InformedSet | None) -> None:
        self._informed = informed
        self._pending.clear()
        for part in self._parts:
            part.inform(informed)

    def _pick(self, candidates: NDArray[np.float64]) -> tuple[float, float]:
        """Resample one of the candidates by its heat, or the first one as the uniform draw."""
        grid = self.heatmap.grid
        chosen, uniform = 0, True
        if self.rng.random() >= self.uniform_fraction:
            free = grid.is_free(candidates)
            columns, rows = grid.to_pixel(candidates[free]).astype(np.intp).T
            heat = np.zeros(len(candidates))
            heat[free] = self.heatmap.values[rows, columns]
            cumulative = heat.cumsum()
            if cumulative[-1] > 0:
                threshold = self.rng.random() * cumulative[-1]
                chosen = int(np.searchsorted(cumulative, threshold, side="right"))
                uniform = False
        x, y = candidates[chosen].tolist()
        return self._count(x, y, uniform)

    def _count(self, x: float, y: float, uniform: bool) -> tuple[float, float]:
        if uniform:
            self.uniform += 1
        else:
            self.learned += 1
        return x, y

    def _refill(self, best: float) -> None:
        size, self._batch = self._batch, min(2 * self._batch, _LARGEST_BATCH)
        uniform = self.rng.random(size) < self.uniform_fraction
        points = np.empty((size, 2))
        for part, mask in zip(self._parts, (~uniform, uniform), strict=True):
            points[mask] = part.draw(int(mask.sum()), best, self.rng)
        if self._informed is None:
            bounds = np.full(size, -inf)
        else:
            bounds = self._informed.shortest_through(points)
        columns = points[:, 0], points[:, 1], bounds, uniform
        self._pending = list(zip(*(column.tolist() for column in columns), strict=True))


class _Part:
    """A heat map whose weights follow the informed set."""

    def __init__(self, heatmap: Heatmap) -> None:
        self._grid = heatmap.grid
        self._support = self._active = heatmap.support
        self._weights = heatmap.values.ravel()[self._support].astype(np.float64)
        self._cumulative = self._weights.cumsum()
        self._bounds: NDArray[np.float64] | None = None
        self._best = inf

    def inform(self, informed: InformedSet | None) -> None:
        self._active, self._cumulative = self._support, self._weights.cumsum()
        self._bounds, self._best = None, inf
        if informed is None:
            return
        pixels = np.stack((self._support % self._grid.width, self._support // self._grid.width), -1)
        centres = self._grid.to_world(pixels + 0.5)
        # Twice the distance from a pixel's centre to its corner: the bound of no point inside
        # the pixel is lower by more.
        self._bounds = informed.shortest_through(centres) - np.sqrt(2) * self._grid.resolution

    def draw(self, n: int, best: float, rng: np.random.Generator) -> NDArray[np.float64]:
        if self._bounds is not None and best != self._best:
            self._restrict(self._bounds <= best)
            self._best = best
        return draw_points(self._grid, self._active, self._cumulative, n, rng)

    def _restrict(self, inside: NDArray[np.bool_]) -> None:
        """Keep only these pixels of the support; where that leaves none, keep the last ones."""
        if inside.any():
            self._active = self._support[inside]
            self._cumulative = self._weights[inside].cumsum()


def _nearest(points: NDArray[np.float64], ends: NDArray[np.float64]) -> NDArray[np.float64]:
    distances: NDArray[np.float64] = np.linalg.norm(points[:, None] - ends, axis=-1).min(axis=1)
    return distances


def _no_cost() -> float:
    return inf


def _no_set() -> InformedSet:
    raise AssertionError("asked for only after a finite best cost")
