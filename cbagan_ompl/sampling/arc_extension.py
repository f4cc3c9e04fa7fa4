"""Poses that a node of a planner's tree reaches along two arcs, where the tree is not yet."""

from __future__ import annotations

from math import inf, pi

import numpy as np
from numpy.typing import NDArray

from ..common.compilation import compiled
from ..robots.arcs import follow_arc
from .headings import FOLLOWING
from .heatmap import Heatmap
from .tree_extension import SHORTEST, TRIES, TreeExtension, offer_at

_follow_arc = compiled(follow_arc)


class ArcExtension(TreeExtension):
    """Propose the ends of two arcs of circle, for robots that drive forwards alone.

    Args:
        heatmap: see :class:`.tree_extension.TreeExtension`.
        radius: the turning radius, world units.
        longest: how long both arcs are together at most, world units.
        rng: the generator.

    Example:
        >>> from cbagan_ompl import GridMap
        >>> heatmap = Heatmap(np.ones((50, 50)), GridMap(np.ones((50, 50), bool)))
        >>> extension = ArcExtension(heatmap, 5.0, 20.0, np.random.default_rng(0))
        >>> extension.add(25.0, 25.0, 0.0, 1)
        >>> node, (x, y, yaw) = extension.propose(bytearray(50 * 50))
        >>> node, bool(np.hypot(x - 25, y - 25) <= 20)
        ((25.0, 25.0, 0.0), True)
    """

    def __init__(
        self, heatmap: Heatmap, radius: float, longest: float, rng: np.random.Generator
    ) -> None:
        self._radius = radius
        super().__init__(heatmap, longest, rng)

    def _find(
        self, nodes: NDArray[np.float64], covered: NDArray[np.uint8]
    ) -> tuple[int, float, float, float]:
        return _find(
            nodes, self._rng, self._affine, self._offers, covered, self._radius, self._longest
        )


@compiled
def _find(
    nodes: NDArray[np.float64],
    rng: np.random.Generator,
    affine: NDArray[np.float64],
    offers: NDArray[np.float32],
    covered: NDArray[np.uint8],
    radius: float,
    longest: float,
) -> tuple[int, float, float, float]:  # pragma: no cover
    """Return the number of a node and a pose that is reached from it; -1 for none."""
    if len(nodes) == 0:
        return -1, 0.0, 0.0, 0.0
    for _ in range(TRIES):
        number = int(rng.random() * len(nodes))
        x, y, yaw = nodes[number]
        length = longest * (SHORTEST + (1 - SHORTEST) * rng.random())
        first = rng.random()
        for part in (first, 1 - first):
            x, y, yaw = _follow_arc(x, y, yaw, part * length, (2 * rng.random() - 1) / radius)
        offer = offer_at(x, y, affine, offers, covered)
        if offer == inf:
            continue
        deviation = abs((yaw - offer + pi) % (2 * pi) - pi)
        # NaN fails the comparison.
        if not deviation > FOLLOWING:
            return number, x, y, yaw
    return -1, 0.0, 0.0, 0.0
