"""How the functions of an exported model make a region: in one call, or in parts."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .graphs import Graphs


class KeptMaps(NamedTuple):
    """Maps as a network has read them, for any number of tasks on them.

    Attributes:
        shape: (H, W).
        arrays: what the network has made of them.
    """

    shape: tuple[int, int]
    arrays: Sequence[NDArray[Any]]


class Painting(NamedTuple):
    """What a network paints, at the size of the maps that it has read.

    Attributes:
        region: the probability of the region, (B, H, W).
        directions: of travel, (B, 2, h, w): unit vectors (u, v), u right and v down, in equal
            patches of the map (beyond whose edges they may reach); 0 where unknown. None of
            networks that paint none.
    """

    region: NDArray[np.float32]
    directions: NDArray[np.float32] | None = None


class WholePipeline:
    """A model that is one function: ``forward``.

    Args:
        graphs: of the model.
    """

    def __init__(self, graphs: Graphs) -> None:
        self.graphs = graphs

    def read_maps(self, free: NDArray[np.bool_], full: NDArray[np.bool_] | None = None) -> KeptMaps:
        """Return what depends on the maps alone.

        Args:
            free: (B, H, W), true where free; or (1, H, W) for several tasks on one map.
            full: the one map before it was scaled; without use here.
        """
        return KeptMaps((free.shape[1], free.shape[2]), [_as_cells(free)])

    def paint(
        self, maps: KeptMaps, start: NDArray[np.floating], goal: NDArray[np.floating]
    ) -> Painting:
        """Return what the network paints for tasks.

        Args:
            maps: from :meth:`read_maps`.
            start: (B, 2), pixel coordinates (u, v), u right and v down.
            goal: (B, 2), the same.
        """
        free = np.repeat(maps.arrays[0], len(start) // len(maps.arrays[0]), axis=0)
        return Painting(self.graphs.call("forward", free, start, goal)[0][:, 0])


class WavefrontPipeline:
    """A model in the parts of :class:`cbagan_ompl.networks.export_model.SplitModel`.

    Its distance fields are computed between the parts, by :mod:`.compiled_fields`.

    Args:
        graphs: of the model.
    """

    def __init__(self, graphs: Graphs) -> None:
        from .compiled_fields import distance_fields  # here, since numba takes long to import

        self.graphs = graphs
        self._distance_fields = distance_fields

    def read_maps(self, free: NDArray[np.bool_], full: NDArray[np.bool_] | None = None) -> KeptMaps:
        """Return what depends on the maps alone, see :meth:`WholePipeline.read_maps`."""
        shape = free.shape[1], free.shape[2]
        return KeptMaps(shape, self.graphs.call("read_map", _as_cells(free)))

    def paint(
        self, maps: KeptMaps, start: NDArray[np.floating], goal: NDArray[np.floating]
    ) -> Painting:
        """Return what the network paints for tasks, see :meth:`WholePipeline.paint`."""
        edges, cells, features = self.graphs.call("encode", maps.arrays, start, goal)
        distances = self._distance_fields(edges, cells)
        painted = self.graphs.call("paint", maps.arrays, features, distances)[0]
        height, width = maps.shape
        return Painting(painted[:, 0, :height, :width])


def _as_cells(free: NDArray[np.bool_]) -> NDArray[np.float32]:
    """Return maps as the input of a network, (B, 1, H, W)."""
    return free.astype(np.float32)[:, None]
