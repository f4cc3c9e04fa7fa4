"""The part of a map that a planner's tree covers."""

from __future__ import annotations

from math import floor

import numpy as np

from ..maps.grid_map import GridMap


class TreeCoverage:
    """The pixels around the nodes of a planner's tree.

    A node covers a square, half a side as wide as it is far from the next obstacle, since the tree
    may be on one side of a wall alone.

    Attributes:
        node_count: how many nodes there are.
        mask: row-major bytes of the pixels, 1 where the tree is.

    Args:
        grid: the map.
        reach: half the side of a square at most, world units.
    """

    def __init__(self, grid: GridMap, reach: float) -> None:
        self.node_count = 0
        self._affine = tuple(grid.pixel_from_world)
        self._width, self._height = grid.width, grid.height
        self.mask = bytearray(grid.width * grid.height)
        self._pixels = np.frombuffer(self.mask, np.uint8).reshape(grid.shape)
        self._clearance, self._farthest = grid.clearance, reach / grid.resolution

    def add(self, x: float, y: float, covers: bool = True) -> int | None:
        """Count a node, and cover the square around it.

        Args:
            x: of the node, world.
            y: of the node, world.
            covers: whether it covers anything.

        Returns:
            The row-major number of its pixel; None if it does not cover it, because it was covered
            already, or lies outside.
        """
        self.node_count += 1
        if not covers:
            return None
        u, v = self._pixel_of(x, y)
        if not (0 <= u < self._width and 0 <= v < self._height):
            return None
        pixel = v * self._width + u
        if self.mask[pixel]:
            return None
        half = max(1, int(min(self._clearance.at(u, v), self._farthest)))
        self._pixels[max(0, v - half) : v + half + 1, max(0, u - half) : u + half + 1] = 1
        return pixel

    def clear(self) -> None:
        """Forget all nodes."""
        if self.node_count:
            self.node_count = 0
            self._pixels[:] = 0

    def _pixel_of(self, x: float, y: float) -> tuple[int, int]:
        a, b, c, d, e, f = self._affine
        return floor(a * x + b * y + c), floor(d * x + e * y + f)
