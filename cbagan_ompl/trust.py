"""How far a planner's draws follow the heat map: as far as that brings the planner on.

1. Draws follow the heat map with all but the uniform share, where its region joins start and goal;
   where it does not, with a quarter of that.
2. Before the first path no draw of the heat map goes where the tree already is. Once the tree has
   filled the region without a path, draws are uniform.
3. Before the first path the share of the heat map halves with every 128 of its draws that bring
   the tree into no new part of the region, down to a quarter. Whatever brings it there restores it.
4. After the first path draws follow the heat map again; with informed planners, where a shorter
   path can pass.

The uniform share never falls below the one that was asked for, so that a planner stays
probabilistically complete.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, fields
from math import floor

import cv2
import numpy as np

from .errors import ConfigError
from .gridmap import GridMap
from .heatmap import Heatmap

# Share of a heat map that does not join start and goal, and the least one.
_DOUBTED = _LEAST = 0.25
# Draws of the heat map in vain that halve its share, and what one of them leaves of it.
_HALF_LIFE = 128
_FADING = 0.5 ** (1 / _HALF_LIFE)


@dataclass(frozen=True)
class Adaptation:
    """The parts of the adaptation, each of which can be switched off to see what it is worth.

    Attributes:
        doubt: begin with less where the region does not join start and goal.
        coverage: before the first path, draw from the heat map only where the tree is not yet.
        patience: before the first path, follow the heat map less while that brings nothing.
    """

    doubt: bool = True
    coverage: bool = True
    patience: bool = True

    @classmethod
    def of(cls, parts: Iterable[str]) -> Adaptation:
        """The adaptation with some of its parts on.

        Args:
            parts: their names, see :data:`ADAPTATION_PARTS`.

        Raises:
            ConfigError: an unknown name.
        """
        chosen = set(parts)
        unknown = sorted(chosen - set(ADAPTATION_PARTS))
        if unknown:
            raise ConfigError(
                f"unknown part of the adaptation {', '.join(unknown)!r}; there are "
                f"{', '.join(ADAPTATION_PARTS)}"
            )
        return cls(**{name: name in chosen for name in ADAPTATION_PARTS})


#: The names of the parts.
ADAPTATION_PARTS = tuple(field.name for field in fields(Adaptation))
#: Everything on, what :func:`cbagan_ompl.attach` does by default.
FULL_ADAPTATION = Adaptation()
#: Everything off: the uniform share stays what was asked for.
NO_ADAPTATION = Adaptation.of(())


class Trust:
    """What a stream of draws knows of the tree that it feeds.

    Attributes:
        share: of the draws that are not uniform anyway, those that follow the heat map, in (0, 1].

    Args:
        heatmap: that is drawn from.
        adaptation: the parts that are on.
        reach: how far around a node its tree is taken to be, at most, world units.
        count_nodes: number of nodes of the tree.
    """

    def __init__(
        self,
        heatmap: Heatmap,
        adaptation: Adaptation,
        reach: float,
        count_nodes: Callable[[], int],
    ) -> None:
        self.share = 1.0
        self._region = heatmap.region.tobytes()
        self._adaptation = adaptation
        self._most = 1.0
        self._tree = Tree(heatmap.grid, reach)
        self._count_nodes = count_nodes
        self._arrived = False
        self._blocked = 0

    def begin(self, joined: bool) -> None:
        """The planner has begun to plan.

        Args:
            joined: whether the region joins start and goal.
        """
        if self._adaptation.doubt and not joined:
            self._most = self.share = _DOUBTED

    def grown(self, x: float, y: float, arrived: bool) -> None:
        """The tree has a new node at (x, y), world; ``arrived`` when it is in the goal."""
        if self._arrived and not arrived:
            self.restart()  # a planner that ends with its first path has begun anew
        pixel = self._tree.add(x, y)
        if pixel is not None and self._region[pixel]:
            self.share = self._most
        self._arrived = arrived

    def improved(self) -> None:
        """There is a first path, or a better one."""
        self.share = self._most

    def drawn(self) -> None:
        """A draw of the heat map is made before the first path."""
        if self._adaptation.patience:
            self.share = max(self.share * _FADING, _LEAST)

    def is_spent(self, x: float, y: float) -> bool:
        """Whether the tree is at (x, y) already, so that no draw of the heat map need go there."""
        return self._adaptation.coverage and self._tree.covers(x, y)

    def blocked(self) -> None:
        """No draw of the heat map was worth handing out.

        That is how a tree looks that was cleared meanwhile, so its nodes are counted now and then.
        """
        self._blocked += 1
        is_power_of_two = self._blocked & (self._blocked - 1) == 0
        if is_power_of_two and self._count_nodes() < self._tree.nodes / 2:
            self.restart()

    def restart(self) -> None:
        """The tree is empty again."""
        self.share = self._most
        self._arrived = False
        self._blocked = 0
        self._tree.clear()


class Tree:
    """The pixels around the nodes of a planner's tree.

    A node covers a square, half a side as wide as it is far from the next obstacle, since the tree
    may be on one side of a wall alone.

    Attributes:
        nodes: how many there are.

    Args:
        grid: the map.
        reach: half the side of a square at most, world units.
    """

    def __init__(self, grid: GridMap, reach: float) -> None:
        self.nodes = 0
        self._affine = tuple(grid.pixel_from_world)
        self._width, self._height = grid.width, grid.height
        self._cells = bytearray(grid.width * grid.height)
        self._covered = np.frombuffer(self._cells, np.uint8).reshape(grid.shape)
        clearance = cv2.distanceTransform(
            grid.free.astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_PRECISE
        )
        self._half = np.clip(clearance, 1, max(1.0, reach / grid.resolution)).astype(np.int32)

    def add(self, x: float, y: float) -> int | None:
        """Note a node at (x, y), world; the row-major number of its pixel if it is new ground."""
        self.nodes += 1
        u, v = self._pixel(x, y)
        if not (0 <= u < self._width and 0 <= v < self._height):
            return None
        pixel = v * self._width + u
        if self._cells[pixel]:
            return None
        half = int(self._half[v, u])
        self._covered[max(0, v - half) : v + half + 1, max(0, u - half) : u + half + 1] = 1
        return pixel

    def covers(self, x: float, y: float) -> bool:
        """Whether (x, y), world, is near a node."""
        u, v = self._pixel(x, y)
        inside = 0 <= u < self._width and 0 <= v < self._height
        return inside and self._cells[v * self._width + u] == 1

    def clear(self) -> None:
        """Forget all nodes."""
        self.nodes = 0
        self._covered[:] = 0

    def _pixel(self, x: float, y: float) -> tuple[int, int]:
        a, b, c, d, e, f = self._affine
        return floor(a * x + b * y + c), floor(d * x + e * y + f)
