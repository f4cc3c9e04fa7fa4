"""Poses near the nodes of a planner's tree: those that one of them reaches in one step."""

from __future__ import annotations

from abc import ABC, abstractmethod
from math import floor, inf, nan

import numpy as np
from numpy.typing import NDArray

from ..common.compilation import compiled
from ..robots.arcs import Pose
from .heatmap import Heatmap

# Nodes for which there is room at first.
_FIRST_ROOM = 256

#: Motions that are tried for one pose.
TRIES = 512
#: The shortest motion that is tried, as a fraction of the longest.
SHORTEST = 0.1


class TreeExtension(ABC):
    """Propose poses near a planner's tree.

    A pose of the heat map is reached only by chance from a node that is near: most of the steps
    towards one collide, or end in another heading. So these poses are found from the nodes: a
    motion is tried from one of them, at random, and its end is proposed where the heat map is
    positive, the tree is not yet, and the heading is about that of the heat map.

    Args:
        heatmap: with the headings that are to be followed.
        longest: how long a motion is at most, world units.
        rng: the generator.
    """

    def __init__(self, heatmap: Heatmap, longest: float, rng: np.random.Generator) -> None:
        grid = heatmap.grid
        known = heatmap.heading
        heading = np.full(grid.shape, nan, np.float32) if known is None else known
        self._offers = np.where(heatmap.values > 0, heading, np.float32(inf))
        self._affine = np.array(grid.pixel_from_world)
        self._longest, self._rng = float(longest), rng
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

    def propose(self, covered: bytearray) -> tuple[Pose, Pose] | None:
        """Return a node, and a pose (x, y, yaw) that is reached from it unless it collides.

        Args:
            covered: row-major bytes of the pixels, 1 where the tree is.

        Returns:
            None where no such pose was found.
        """
        nodes = self._nodes[: self._count]
        mask = np.frombuffer(covered, np.uint8).reshape(self._offers.shape)
        number, *pose = self._find(nodes, mask)
        if number < 0:
            return None
        x, y, yaw = nodes[number].tolist()
        return (x, y, yaw), (pose[0], pose[1], pose[2])

    @abstractmethod
    def _find(
        self, nodes: NDArray[np.float64], covered: NDArray[np.uint8]
    ) -> tuple[int, float, float, float]:
        """Return the number of a node and a pose that is reached from it; -1 for none.

        Args:
            nodes: poses, (N, 3).
            covered: of the pixels, 1 where the tree is, (H, W).
        """


@compiled
def offer_at(
    x: float,
    y: float,
    affine: NDArray[np.float64],
    offers: NDArray[np.float32],
    covered: NDArray[np.uint8],
) -> float:  # pragma: no cover
    """Return the heading that the heat map has at a position, NaN for any, infinite for none.

    Args:
        x: of the position, world.
        y: of the position, world.
        affine: pixels from world.
        offers: of the pixels the heading, NaN for any, infinite where the heat map is 0.
        covered: of the pixels, 1 where the tree is.
    """
    height, width = offers.shape
    u = floor(affine[0] * x + affine[1] * y + affine[2])
    v = floor(affine[3] * x + affine[4] * y + affine[5])
    if not (0 <= u < width and 0 <= v < height) or covered[v, u]:
        return inf
    return float(offers[v, u])
