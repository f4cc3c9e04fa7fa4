"""The informed set: where a path shorter than the best known one can pass.

Gammell, Srinivasa and Barfoot, "Informed RRT*: Optimal sampling-based path planning focused via
direct sampling of an admissible ellipsoidal heuristic", IROS 2014, https://arxiv.org/abs/1404.2334.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..maps.grid_map import GridMap


@dataclass(frozen=True)
class InformedSet:
    """The points that a path shorter than a given cost can pass: an ellipse for one start and goal.

    Attributes:
        starts: (x, y), shape (S, 2), world.
        goals: (x, y), shape (G, 2), world.
        tolerance: how far from a goal a path may end, world units.

    Example:
        >>> informed = InformedSet(np.array([[0.0, 0.0]]), np.array([[4.0, 0.0]]), tolerance=0.0)
        >>> informed.cost_bounds(np.array([[2.0, 0.0], [0.0, 3.0]])).tolist()
        [4.0, 8.0]
    """

    starts: NDArray[np.float64]
    goals: NDArray[np.float64]
    tolerance: float

    def cost_bounds(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return a lower bound on the length of a path through each point.

        Args:
            points: (N, 2), world.

        Returns:
            (N,), world units.
        """
        return (
            _nearest_distances(points, self.starts)
            + _nearest_distances(points, self.goals)
            - self.tolerance
        )

    def pixel_cost_bounds(self, grid: GridMap, pixels: NDArray[np.intp]) -> NDArray[np.float64]:
        """Return a lower bound on the length of a path through any point of some pixels.

        Args:
            grid: the map.
            pixels: flat row-major indices, (K,).

        Returns:
            (K,), world units.
        """
        rows, columns = np.divmod(pixels, grid.width)
        centres = np.stack((columns + 0.5, rows + 0.5), axis=-1)
        through_centres = grid.resolution * (
            _nearest_distances(centres, grid.to_pixel(self.starts))
            + _nearest_distances(centres, grid.to_pixel(self.goals))
        )
        # The bound changes at most twice as fast as the distance from the centre, half a diagonal.
        return np.asarray(through_centres - (self.tolerance + np.sqrt(2) * grid.resolution))


def _nearest_distances(
    points: NDArray[np.float64], endpoints: NDArray[np.float64]
) -> NDArray[np.float64]:
    distances = [np.hypot(points[:, 0] - x, points[:, 1] - y) for x, y in endpoints.tolist()]
    return np.asarray(np.minimum.reduce(distances))
