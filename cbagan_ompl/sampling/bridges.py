"""Bridges: what connects a region that falls apart."""

from __future__ import annotations

from copy import copy
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..maps.grid_search import shortest_path
from .bands import half_width, paint_window
from .pixels import pixel_pair

if TYPE_CHECKING:
    from .heatmap import Heatmap

# Half width of a bridge, which is kept narrow, as a fraction of the map's longer side.
_BRIDGE_FRACTION = 0.015

# Longest side of the coarse grid in which bridges are looked for.
_REPAIR_SIZE = 128

# Cost of a pixel length inside the region, relative to one where the heat map is 0.
_REGION_COST = 0.02


class _RegionCosts:
    """Costs of which those inside a region are next to nothing, see :class:`.grid_search.Costs`.

    Computed where they are asked for: a path leaves most of a large map alone.
    """

    def __init__(self, values: NDArray[np.float32], region: NDArray[np.bool_]) -> None:
        self._values, self._region = values, region

    def __getitem__(self, window: tuple[slice, slice]) -> NDArray[np.float32]:
        outside = 1 + _REGION_COST - self._values[window]
        return np.where(self._region[window], np.float32(_REGION_COST), outside)


def connect(heatmap: Heatmap, endpoints: NDArray[np.float64]) -> Heatmap:
    """Return a heat map whose region connects two points; itself where it does already.

    Elsewhere it has a bridge along the cheapest path through it.

    Args:
        heatmap: any heat map.
        endpoints: start and goal, connected by free pixels, (2, 2), pixels.
    """
    grid, pixels = heatmap.grid, pixel_pair(endpoints)
    if heatmap._connects_pixels(pixels):
        return heatmap
    costs = _RegionCosts(heatmap.values, heatmap.region)
    path = shortest_path(grid.free, *pixels, costs, _REPAIR_SIZE)
    assert path is not None, "the endpoints are connected"
    width = half_width(grid, _BRIDGE_FRACTION)
    return _raise(heatmap, *paint_window(grid.shape, path + np.float64(0.5), width))


def _raise(heatmap: Heatmap, window: tuple[slice, slice], least: NDArray[np.float32]) -> Heatmap:
    """Return a heat map with larger values in a window.

    Args:
        heatmap: the heat map, which stays as it is.
        window: rows and columns.
        least: what the values of free pixels in the window are at least, in [0, 1].
    """
    support, width = heatmap.support, heatmap.grid.width
    values = np.zeros(heatmap.values.shape, np.float32)
    values.ravel()[support] = heatmap.support_values
    inside = values[window]
    np.maximum(inside, least * heatmap.grid.free[window], out=inside)
    rows = window[0]
    above, below = np.searchsorted(support, (rows.start * width, rows.stop * width))
    middle = np.flatnonzero(values[rows] > 0) + rows.start * width
    support = np.concatenate((support[:above], middle, support[below:]))
    values.setflags(write=False)
    # All that Heatmap() would check is known. The headings are the same.
    raised = copy(heatmap)
    raised.values, raised.support = values, support
    raised.support_values = values.ravel()[support]
    raised.guarantee, raised._last_connected = None, (None, False)
    return raised
