"""Endless samples of weighted pixels, kept inside a box and inside the informed set."""

from __future__ import annotations

from math import inf, nan

import numpy as np
from numpy.typing import NDArray

from ..errors import HeatmapError
from ..maps.grid_map import GridMap
from .informed_set import InformedSet
from .pixels import WeightedPixels, sample_in_pixels

# The first batch is small, because small tasks need few samples; each is twice the one before.
_FIRST_BATCH, _LARGEST_BATCH = 128, 1024

# Pixels that are weighted anew in the time that it takes to reject as many samples as a batch has.
# While enough samples fall inside the informed set, rejecting the others is cheaper than weighting
# only the pixels inside.
_PIXELS_PER_BATCH = 30_000

# Samples in a row that may be rejected because the tree covers them already.
_MAX_REJECTED = 20

# Batches without a point inside the informed set before a sample from outside is let through.
_MAX_EMPTY_BATCHES = 8


class PixelSampler:
    """Sample weighted pixels without end, in batches that are handed out point by point.

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
        # Those of the pixels that are sampled; made with the first batch.
        self._active: WeightedPixels | None = None
        self.set_informed(None)

    def keep_inside(self, low: NDArray[np.float64], high: NDArray[np.float64]) -> None:
        """Sample only inside a box from now on.

        Args:
            low: lower bounds, (2,), world.
            high: upper bounds, (2,), world.

        Raises:
            HeatmapError: no pixel lies in the box.
        """
        # Pixels that the box cuts keep their weight, the samples outside are rejected.
        reach = self._grid.resolution * np.sqrt(0.5)
        rows, columns = np.divmod(self._support, self._grid.width)
        centres = self._grid.to_world(np.stack((columns, rows), axis=-1) + 0.5)
        touching = _are_inside(centres, low - reach, high + reach)
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
        self.set_informed(None)

    def set_informed(self, informed: InformedSet | None) -> None:
        """Sample only in the informed set from now on, or everywhere for None."""
        self._informed = informed
        self._accepted = 1.0
        self._bounds: NDArray[np.float64] | None = None
        self._pending.clear()
        if informed is None:
            self._active = None

    def next(self, best: float, covered: bytearray | None) -> tuple[float, float] | None:
        """Return the next sample, (x, y), world, where a path cheaper than ``best`` can pass.

        Args:
            best: cost of the best known path.
            covered: row-major bytes of the pixels, 1 where samples are rejected; None rejects none.

        Returns:
            None when too many samples in a row had to be rejected for ``covered``.
        """
        rejected = 0
        for _ in range(_MAX_EMPTY_BATCHES):
            while self._pending:
                x, y, bound, pixel = self._pending.pop()
                if bound <= best:
                    if covered is None or not covered[pixel]:
                        return x, y
                    rejected += 1
                    if rejected == _MAX_REJECTED:
                        return None
            self._refill(best)
        # Nothing of the map is in the informed set: any sample is as good as another.
        x, y, _, _ = self._pending.pop()
        if self._box is not None:
            x, y = np.clip((x, y), *self._box).tolist()
        return x, y

    def prepare(self) -> None:
        """Make a batch now, rather than when the first sample is asked for."""
        if not self._pending:
            self._refill(inf)

    def _refill(self, best: float) -> None:
        size, self._batch = self._batch, min(2 * self._batch, _LARGEST_BATCH)
        if self._active is None:
            self._active = WeightedPixels(self._support, self._weights)
        elif self._accepted * (1 + len(self._support) / _PIXELS_PER_BATCH) < 1:
            self._active = self._informed_pixels(best)
        pixels = self._active.sample(size, self._rng)
        points = sample_in_pixels(self._grid, pixels, self._rng)
        bounds = np.full(size, -inf)
        if self._informed is not None:
            bounds = self._informed.cost_bounds(points)
            self._accepted = float((bounds <= best).mean())
        if self._box is not None:
            bounds[~_are_inside(points, *self._box)] = nan  # no cost is above it: always rejected
        columns = points[:, 0], points[:, 1], bounds, pixels
        self._pending = list(zip(*(column.tolist() for column in columns), strict=True))

    def _informed_pixels(self, best: float) -> WeightedPixels:
        """Return the pixels with points in the informed set; where there are none, all of them."""
        assert self._informed is not None, "without it all samples are accepted"
        if self._bounds is None:
            self._bounds = self._informed.pixel_cost_bounds(self._grid, self._support)
        inside = np.asarray(self._bounds <= best)
        if not inside.any():
            return WeightedPixels(self._support, self._weights)
        weights = None if self._weights is None else self._weights[inside]
        return WeightedPixels(self._support[inside], weights)


def _are_inside(
    points: NDArray[np.float64], low: NDArray[np.float64], high: NDArray[np.float64]
) -> NDArray[np.bool_]:
    return np.asarray(((points >= low) & (points <= high)).all(axis=1))
