"""Poses that a node of a planner's tree reaches along two arcs, where the tree is not yet."""

from __future__ import annotations

from math import floor, pi

import numpy as np
from numpy.typing import NDArray

from ..common.compilation import compiled
from ..robots.arcs import follow_arc
from .headings import FOLLOWING
from .heatmap import Heatmap

# Pairs of arcs that are tried for one pose.
_TRIES = 512
# The shortest way that is tried, as a fraction of the longest.
_SHORTEST = 0.1
# Nodes for which there is room at first.
_FIRST_ROOM = 256

_follow_arc = compiled(follow_arc)


class TreeExtension:
    """Propose poses near a planner's tree, for robots that drive forwards alone, along arcs.

    A pose of the heat map is reached only by chance from a node that is near: most of the steps
    towards one collide, or end in another heading. So these poses are found from the nodes: two
    arcs of circle are driven from one of them, at random, and the end is proposed where the heat
    map is positive, the tree is not yet, and the heading is about that of the heat map.

    Args:
        heatmap: with the headings that are to be followed.
        radius: the turning radius, world units.
        longest: how long both arcs are together at most, world units.
        rng: the generator.

    Example:
        >>> from cbagan_ompl import GridMap
        >>> heatmap = Heatmap(np.ones((50, 50)), GridMap(np.ones((50, 50), bool)))
        >>> extension = TreeExtension(heatmap, 5.0, 20.0, np.random.default_rng(0))
        >>> extension.add(25.0, 25.0, 0.0, 1)
        >>> node, (x, y, yaw) = extension.propose(bytearray(50 * 50))
        >>> node, bool(np.hypot(x - 25, y - 25) <= 20)
        ((25.0, 25.0, 0.0), True)
    """

    def __init__(
        self,
        heatmap: Heatmap,
        radius: float,
        longest: float,
        rng: np.random.Generator,
    ) -> None:
        grid = heatmap.grid
        known = heatmap.heading
        heading = np.full(grid.shape, np.nan, np.float32) if known is None else known
        self._offers = np.where(heatmap.values > 0, heading, np.float32(np.inf))
        self._affine = np.array(grid.pixel_from_world)
        self._radius, self._longest = radius, float(longest)
        self._rng = rng
        self._nodes, self._count = np.empty((_FIRST_ROOM, 3)), 0
        self.propose(bytearray(grid.width * grid.height))  # compiled before it is needed

    def add(self, x: float, y: float, yaw: float, count: int) -> None:
        """Note a new node of the tree.

        Args:
            x: of the node, world.
            y: of the node, world.
            yaw: of the node, radians.
            count: how many nodes the tree has with it: 1 where it has begun anew.
        """
        if count == 1:
            self._count = 0
        if self._count == len(self._nodes):
            self._nodes = np.resize(self._nodes, (2 * self._count, 3))
        self._nodes[self._count] = x, y, yaw
        self._count += 1

    def propose(
        self, covered: bytearray
    ) -> tuple[tuple[float, float, float], tuple[float, float, float]] | None:
        """Return a node, and a pose (x, y, yaw) that is reached from it unless it collides.

        Args:
            covered: row-major bytes of the pixels, 1 where the tree is.

        Returns:
            None where no such pose was found.
        """
        nodes = self._nodes[: self._count]
        mask = np.frombuffer(covered, np.uint8).reshape(self._offers.shape)
        number, *pose = _find(
            nodes, _TRIES, self._rng, self._affine, self._offers, mask, self._radius, self._longest
        )
        if number < 0:
            return None
        x, y, yaw = nodes[number].tolist()
        return (x, y, yaw), (pose[0], pose[1], pose[2])


@compiled
def _find(
    nodes: NDArray[np.float64],
    tries: int,
    rng: np.random.Generator,
    affine: NDArray[np.float64],
    offers: NDArray[np.float32],
    covered: NDArray[np.uint8],
    radius: float,
    longest: float,
) -> tuple[int, float, float, float]:  # pragma: no cover
    """Return the number of a node and a pose that is reached from it; -1 for none.

    Args:
        nodes: poses, (N, 3).
        tries: pairs of arcs at most.
        rng: the generator.
        affine: pixels from world.
        offers: of the pixels the heading, NaN for any, infinite for none.
        covered: of the pixels, 1 where the tree is.
        radius: the turning radius.
        longest: the greatest length of both arcs.
    """
    height, width = offers.shape
    if len(nodes) == 0:
        return -1, 0.0, 0.0, 0.0
    for _ in range(tries):
        number = int(rng.random() * len(nodes))
        x, y, yaw = nodes[number]
        length = longest * (_SHORTEST + (1 - _SHORTEST) * rng.random())
        first = rng.random()
        for part in (first, 1 - first):
            x, y, yaw = _follow_arc(x, y, yaw, part * length, (2 * rng.random() - 1) / radius)
        u = floor(affine[0] * x + affine[1] * y + affine[2])
        v = floor(affine[3] * x + affine[4] * y + affine[5])
        if not (0 <= u < width and 0 <= v < height) or covered[v, u]:
            continue
        offer = offers[v, u]
        if np.isinf(offer):
            continue
        deviation = abs((yaw - offer + pi) % (2 * pi) - pi)
        # NaN fails the comparison.
        if not deviation > FOLLOWING:
            return number, x, y, yaw
    return -1, 0.0, 0.0, 0.0
