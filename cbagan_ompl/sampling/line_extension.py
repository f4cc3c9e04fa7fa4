"""Poses that a node of a planner's tree reaches along a line, where the tree is not yet."""

from __future__ import annotations

from math import cos, hypot, inf, isnan, pi, sin

import numpy as np
from numpy.typing import NDArray

from ..common.compilation import compiled
from .headings import FOLLOWING
from .heatmap import Heatmap
from .tree_extension import SHORTEST, TRIES, TreeExtension, offer_at

# Standard deviation of the heading of a pose from that of the heat map: nearly all follow it, and
# so keep the next pose from the same place.
_SPREAD = FOLLOWING / 2


class LineExtension(TreeExtension):
    """Propose the ends of lines that lead about where a node heads, for robots that turn anywhere.

    The node of a pose is that from which a planner would go there: the nearest one in the metric of
    the space, which adds the distance of the positions and the turn, each times a weight.

    Args:
        heatmap: see :class:`.tree_extension.TreeExtension`.
        weights: of a world unit and of a radian.
        spread: standard deviation of a line's direction from the heading of its node, radians.
        longest: the greatest distance of a pose from its node, in that metric.
        rng: the generator.

    Example:
        >>> from cbagan_ompl import GridMap
        >>> heatmap = Heatmap(np.ones((50, 50)), GridMap(np.ones((50, 50), bool)))
        >>> rng = np.random.default_rng(0)
        >>> extension = LineExtension(heatmap, (1.0, 0.5), 0.4, 20.0, rng)
        >>> extension.add(25.0, 25.0, 0.0, 1)
        >>> node, (x, y, yaw) = extension.propose(bytearray(50 * 50))
        >>> node, bool(np.hypot(x - 25, y - 25) <= 20)
        ((25.0, 25.0, 0.0), True)
    """

    def __init__(
        self,
        heatmap: Heatmap,
        weights: tuple[float, float],
        spread: float,
        longest: float,
        rng: np.random.Generator,
    ) -> None:
        self._weights, self._spread = weights, spread
        super().__init__(heatmap, longest, rng)

    def _find(
        self, nodes: NDArray[np.float64], covered: NDArray[np.uint8]
    ) -> tuple[int, float, float, float]:
        return _find(
            nodes,
            self._rng,
            self._affine,
            self._offers,
            covered,
            self._weights,
            self._spread,
            self._longest,
        )


@compiled
def _find(
    nodes: NDArray[np.float64],
    rng: np.random.Generator,
    affine: NDArray[np.float64],
    offers: NDArray[np.float32],
    covered: NDArray[np.uint8],
    weights: tuple[float, float],
    spread: float,
    longest: float,
) -> tuple[int, float, float, float]:  # pragma: no cover
    """Return the number of a node and a pose that is reached from it; -1 for none."""
    if len(nodes) == 0:
        return -1, 0.0, 0.0, 0.0
    for _ in range(TRIES):
        x, y, yaw = nodes[int(rng.random() * len(nodes))]
        length = longest / weights[0] * (SHORTEST + (1 - SHORTEST) * rng.random())
        direction = yaw + spread * rng.normal()
        x += length * cos(direction)
        y += length * sin(direction)
        offer = offer_at(x, y, affine, offers, covered)
        if offer == inf:
            continue
        yaw = 2 * pi * rng.random() if isnan(offer) else offer + _SPREAD * rng.normal()
        yaw = (yaw + pi) % (2 * pi) - pi
        number = _nearest(x, y, yaw, nodes, weights, longest)
        if number >= 0:
            return number, x, y, yaw
    return -1, 0.0, 0.0, 0.0


@compiled
def _nearest(
    x: float,
    y: float,
    yaw: float,
    nodes: NDArray[np.float64],
    weights: tuple[float, float],
    longest: float,
) -> int:  # pragma: no cover
    """Return the number of the node that is nearest to a pose; -1 if none is near enough."""
    nearest, least = -1, longest
    for number in range(len(nodes)):
        along = weights[0] * (nodes[number, 0] - x)
        if abs(along) > least:  # most nodes of a large tree
            continue
        distance = hypot(along, weights[0] * (nodes[number, 1] - y))
        distance += weights[1] * abs((nodes[number, 2] - yaw + pi) % (2 * pi) - pi)
        if distance <= least:
            nearest, least = number, distance
    return nearest
