"""How far a planner's draws follow the heat map: as far as that brings the planner on.

1. Where the region joins start and goal, all draws of the planner are ours. Where it does not, six
   of seven are left to OMPL's own sampler.
2. Before the first path no draw of the heat map goes where the tree already is. Once the tree has
   filled the region without a path, our draws are uniform.
3. Before the first path our share halves with every 128 draws of the heat map that bring the tree
   into no new part of the region, down to a quarter. Whatever brings it there restores it.
4. After the first path draws follow the heat map again; with informed planners, where a shorter
   path can pass.

Of our draws the share that was asked for stays uniform throughout, so that a planner stays
probabilistically complete.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, fields
from math import floor

import numpy as np

from ..errors import ConfigError
from ..maps.grid_map import GridMap
from .heatmap import Heatmap

# Our share with a region that does not join start and goal, and the least one.
_DOUBTED, _LEAST = 0.15, 0.25
# Draws of the heat map in vain that halve our share.
_HALF_LIFE = 128


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
    """What is known of the tree that draws feed, and what follows from it.

    Attributes:
        spent: row-major bytes of the pixels, 1 where no draw of the heat map need go before the
            first path; None while that is everywhere.

    Args:
        heatmap: that is drawn from.
        adaptation: the parts that are on.
        reach: how far around a node its tree is taken to be, at most, world units.
        count_nodes: number of nodes of the tree.
        set_share: told the share of draws that is to be left to the heat map and its uniform
            share; the others are the planner's own.
    """

    def __init__(
        self,
        heatmap: Heatmap,
        adaptation: Adaptation,
        reach: float,
        count_nodes: Callable[[], int],
        set_share: Callable[[float], None],
    ) -> None:
        # Also the numbers of the parts are made here, before the planner plans.
        self._region = heatmap.parts.astype(np.bool_).tobytes()
        self._adaptation = adaptation
        self._tree = Tree(heatmap.grid, reach)
        self.spent = self._tree.cells if adaptation.coverage else None
        self._count_nodes = count_nodes
        self._set_share = set_share
        self._share = self._most = 1.0
        self._vain = self._blocked = 0
        self._arrived = False
        # Whether the tree is followed before the first path, and whether it is at the moment.
        self._follows = self._is_followed = adaptation.coverage or adaptation.patience

    def begin(self, joined: bool) -> None:
        """The planner has begun to plan.

        Args:
            joined: whether the region joins start and goal.
        """
        if self._adaptation.doubt and not joined:
            self._most = _DOUBTED
            self._follow(_DOUBTED)
            # For so few draws it does not pay to follow the tree.
            self._follows = self._is_followed = False
            self.spent = None

    def grown(self, x: float, y: float, arrived: bool) -> None:
        """The tree has a new node at (x, y), world; ``arrived`` when it is in the goal."""
        if not self._is_followed:
            return
        if self._arrived and not arrived:
            self.restart()  # a planner that ends with its first path has begun anew
        pixel = self._tree.add(x, y)
        if pixel is not None and self._region[pixel]:
            self._vain = 0
            self._follow(self._most)
        self._arrived = arrived

    def improved(self) -> None:
        """There is a first path, or a better one."""
        self._is_followed = False
        self._follow(self._most)

    def drawn(self) -> None:
        """A draw of the heat map is made before the first path."""
        if not (self._is_followed and self._adaptation.patience):
            return
        self._vain += 1
        if self._vain >= _HALF_LIFE:
            self._vain = 0
            self._follow(max(self._share / 2, _LEAST))

    def blocked(self) -> None:
        """No draw of the heat map was worth handing out.

        That is how a tree looks that was cleared meanwhile, so its nodes are counted now and then.
        """
        self._blocked += 1
        if self._blocked > self._tree.nodes:
            self._blocked = 0
            if self._count_nodes() < self._tree.nodes / 2:
                self.restart()

    def restart(self) -> None:
        """The tree is empty again."""
        self._vain = self._blocked = 0
        self._arrived = False
        self._is_followed = self._follows
        self._tree.clear()
        self._follow(self._most)

    def _follow(self, share: float) -> None:
        if share != self._share:
            self._share = share
            self._set_share(share)


class Tree:
    """The pixels around the nodes of a planner's tree.

    A node covers a square, half a side as wide as it is far from the next obstacle, since the tree
    may be on one side of a wall alone.

    Attributes:
        nodes: how many there are.
        cells: row-major bytes of the pixels, 1 where the tree is.

    Args:
        grid: the map.
        reach: half the side of a square at most, world units.
    """

    def __init__(self, grid: GridMap, reach: float) -> None:
        self.nodes = 0
        self._affine = tuple(grid.pixel_from_world)
        self._width, self._height = grid.width, grid.height
        self.cells = bytearray(grid.width * grid.height)
        self._covered = np.frombuffer(self.cells, np.uint8).reshape(grid.shape)
        farthest = min(reach / grid.resolution, 2.0**16 - 1)
        self._half = np.minimum(grid.clearance, farthest).astype(np.uint16)

    def add(self, x: float, y: float) -> int | None:
        """Note a node at (x, y), world; the row-major number of its pixel if it is new ground."""
        self.nodes += 1
        u, v = self._pixel(x, y)
        if not (0 <= u < self._width and 0 <= v < self._height):
            return None
        pixel = v * self._width + u
        if self.cells[pixel]:
            return None
        half = max(1, int(self._half[v, u]))
        self._covered[max(0, v - half) : v + half + 1, max(0, u - half) : u + half + 1] = 1
        return pixel

    def clear(self) -> None:
        """Forget all nodes."""
        self.nodes = 0
        self._covered[:] = 0

    def _pixel(self, x: float, y: float) -> tuple[int, int]:
        a, b, c, d, e, f = self._affine
        return floor(a * x + b * y + c), floor(d * x + e * y + f)
