"""The samples of one planner: a heat map mixed with uniform, counted, from one generator."""

from __future__ import annotations

from math import inf
from random import Random
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .adaptation import AdaptiveMixture
from .budget import LearnedBudget
from .checks import check_heatmap
from .headings import HeadingSampler
from .heatmap import Heatmap
from .monitor import Monitor, NoMonitor
from .options import SamplerOptions
from .pixel_sampler import PixelSampler
from .roadmap import RoadmapMixture

# Candidates of which a local sample is one, with probability proportional to the heat map.
_LOCAL_CANDIDATES = 32


class HeatmapSampler:
    """Sample points for one planner without end.

    Each sample is *learned*, from the heat map, or with probability ``uniform_fraction`` *uniform*,
    over free space. So every free pixel keeps a positive probability, and the planner stays
    probabilistically complete. Nothing here knows OMPL: a planner of one's own can use it too.

    Attributes:
        heatmap: what is sampled.
        rng: the generator of the samples, and of whatever else belongs to the same run.
        chance: returns a random number of ``rng`` in [0, 1) at each call.
        monitor: of the planner that is fed.
        is_learned: whether the last sample of :meth:`next` was learned.
        spread: how the headings of poses follow those of the heat map.

    Args:
        heatmap: what to sample.
        options: how samples follow it; ``sharpness`` None stands for 1.
        monitor: of the planner that is fed.
        mixture: adapts the learned samples to the planner's tree; None leaves them as they are.
        budget: bounds the learned samples before the first path; None leaves them unbounded.
        **changes: single fields of :class:`.options.SamplerOptions`, such as ``seed=1``.

    Raises:
        ConfigError: an option that makes no sense, see :class:`.options.SamplerOptions`.
        HeatmapError: not a :class:`.heatmap.Heatmap`.

    Example:
        >>> from cbagan_ompl import GridMap, Heatmap
        >>> sampler = HeatmapSampler(Heatmap([[0.0, 1.0]], GridMap([[1, 1]])), seed=0)
        >>> points = [sampler.next() for _ in range(100)]
        >>> sum(sampler.sample_counts.values())
        100
    """

    def __init__(
        self,
        heatmap: Heatmap,
        options: SamplerOptions | None = None,
        monitor: Monitor | None = None,
        mixture: AdaptiveMixture | RoadmapMixture | None = None,
        budget: LearnedBudget | None = None,
        **changes: Any,
    ) -> None:
        options = SamplerOptions.of(options, changes)
        check_heatmap(heatmap)
        self.heatmap = heatmap
        self.rng = options.generator()
        # A generator of single numbers, which NumPy's is slow at.
        self.chance = Random(int(self.rng.integers(2**63))).random
        self._uniform_fraction = float(options.uniform_fraction)
        self._exponent = np.float32(1.0 if options.sharpness is None else options.sharpness)
        self.spread = options.heading
        self.monitor = monitor or NoMonitor()
        self._mixture = mixture
        self._budget = budget
        self.is_learned = False
        self._learned_count = self._uniform_count = 0
        self._best = inf
        self._has_begun = False
        self._box = np.full(2, -inf), np.full(2, inf)
        grid, values = heatmap.grid, heatmap.support_values
        weights = _power(values / values.max(), self._exponent)
        self._learned = PixelSampler(grid, heatmap.support, weights, self.rng)
        self._uniform = PixelSampler(grid, grid.free_pixels, None, self.rng)

    @property
    def sample_counts(self) -> dict[str, int]:
        """Samples handed out so far: ``{"learned": n, "uniform": m}``."""
        return {"learned": self._learned_count, "uniform": self._uniform_count}

    @property
    def covered(self) -> bytearray | None:
        """Row-major bytes of the pixels where no learned sample goes before the first path."""
        return None if self._mixture is None else self._mixture.covered

    def heading_sampler(self, reverses: bool) -> HeadingSampler:
        """Return what samples the headings of poses, from the same generator.

        Args:
            reverses: whether the robot drives backwards as well.
        """
        return HeadingSampler(self.heatmap, self.spread, self.rng, reverses)

    def keep_inside(self, low: NDArray[np.float64], high: NDArray[np.float64]) -> None:
        """Sample only inside a box, such as the bounds of a state space.

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
            self._learned.keep_inside(low, high)
            self._uniform.keep_inside(low, high)

    def prepare(self) -> None:
        """Make the first samples now, rather than when the first one is asked for."""
        self._learned.prepare()
        self._uniform.prepare()

    def begin(self) -> None:
        """Note that the planner has begun to plan; only the first call counts."""
        if self._mixture is not None and not self._has_begun:
            self._has_begun = True
            self._mixture.on_start(self.monitor.connects(self.heatmap))

    def restart(self) -> None:
        """Note that the planner begins anew, without a tree."""
        if self._mixture is not None:
            self._mixture.restart()
        if self._budget is not None:
            self._budget.restart()

    def on_new_node(self, x: float, y: float, in_goal: bool, covers: bool = True) -> int:
        """Note that the planner's tree has a new node.

        Args:
            x: of the node, world.
            y: of the node, world.
            in_goal: whether the node is in the goal.
            covers: whether it does instead of a sample there, which its heading may not do.

        Returns:
            How many nodes the tree has as far as is known; 0 while it is not watched.
        """
        return 0 if self._mixture is None else self._mixture.on_new_node(x, y, in_goal, covers)

    def next(self) -> tuple[float, float]:
        """Return the next sample, (x, y), world."""
        best = self.monitor.best_cost()
        if best != self._best:
            self._update_best(best)
        if self.chance() >= self._uniform_fraction:
            point = self._next_learned(best)
            if point is not None:
                self._learned_count += 1
                self.is_learned = True
                return point
        self._count_uniform()
        self.is_learned = False
        point = self._uniform.next(best, None)
        assert point is not None, "nothing was rejected"
        return point

    def near(self, x: float, y: float, distance: float) -> tuple[float, float]:
        """Return a sample (x, y) near a point: in OMPL's neighbourhood of a RealVectorStateSpace.

        Args:
            x: of the point, world.
            y: of the point, world.
            distance: largest distance from the point along each axis, world units.
        """
        low = np.maximum((x - distance, y - distance), self._box[0])
        high = np.minimum((x + distance, y + distance), self._box[1])
        return self._pick(self.rng.uniform(low, np.maximum(low, high), (_LOCAL_CANDIDATES, 2)))

    def gaussian(self, x: float, y: float, deviation: float) -> tuple[float, float]:
        """Return a sample (x, y) that is normally distributed around a point.

        Args:
            x: of the point, world.
            y: of the point, world.
            deviation: standard deviation along each axis, world units.
        """
        candidates = self.rng.normal((x, y), deviation, (_LOCAL_CANDIDATES, 2))
        return self._pick(np.clip(candidates, *self._box))

    def _next_learned(self, best: float) -> tuple[float, float] | None:
        mixture, budget = self._mixture, self._budget
        if best < inf:
            return self._learned.next(best, None)
        if budget is not None and not budget.spend():
            return None
        if mixture is None:
            return self._learned.next(best, None)
        mixture.on_sample()
        point = self._learned.next(best, mixture.covered)
        if point is None:
            mixture.on_exhausted()
        return point

    def _update_best(self, best: float) -> None:
        if (best < inf) != (self._best < inf):
            informed = self.monitor.informed_set() if best < inf else None
            self._learned.set_informed(informed)
            self._uniform.set_informed(informed)
        if best > self._best:
            self.restart()
        elif self._mixture is not None:
            self._mixture.on_solution()
        self._best = best

    def _pick(self, candidates: NDArray[np.float64]) -> tuple[float, float]:
        """Choose one of the candidates by its heat, or the first one as the uniform sample."""
        grid = self.heatmap.grid
        chosen, uniform = 0, True
        if self.chance() >= self._uniform_fraction and (
            self._budget is None or self._best < inf or self._budget.spend()
        ):
            free = grid.is_free(candidates)
            columns, rows = grid.to_pixel(candidates[free]).astype(np.intp).T
            heat = np.zeros(len(candidates))
            heat[free] = self.heatmap.values[rows, columns] ** self._exponent
            cumulative = heat.cumsum()
            if cumulative[-1] > 0:
                threshold = self.chance() * cumulative[-1]
                chosen = int(np.searchsorted(cumulative, threshold, side="right"))
                uniform = False
        if uniform:
            self._count_uniform()
        else:
            self._learned_count += 1
        x, y = candidates[chosen].tolist()
        return x, y

    def _count_uniform(self) -> None:
        self._uniform_count += 1
        if self._budget is not None:
            self._budget.earn_by_uniform()


def _power(values: NDArray[np.float32], exponent: np.float32) -> NDArray[np.float32]:
    """Return a power of values in [0, 1]; of a small whole exponent as a product.

    NumPy's own power takes twenty times as long.
    """
    if exponent not in range(1, 9):
        return np.asarray(values**exponent)
    product = values if exponent == 1 else values * values
    for _ in range(int(exponent) - 2):
        product *= values
    return product
