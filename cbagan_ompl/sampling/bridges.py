"""Bridges: what connects a region that falls apart."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..maps.connectivity import in_one_component
from ..maps.grid_map import GridMap
from ..maps.grid_search import shortest_path
from .bands import half_width, paint_band
from .pixels import pixel_pair

if TYPE_CHECKING:
    from .heatmap import Heatmap

# Half width of a bridge, which is kept narrow, as a fraction of the map's longer side.
_BRIDGE_FRACTION = 0.015

# Longest side of the coarse grid in which bridges are looked for.
_REPAIR_SIZE = 128

# Cost of a pixel length inside the region, relative to one where the heat map is 0.
_REGION_COST = 0.02


def connect(heatmap: Heatmap, endpoints: NDArray[np.float64]) -> Heatmap:
    """Return a heat map whose region connects two points; itself where it does already.

    Args:
        heatmap: any heat map.
        endpoints: start and goal, connected by free pixels, (2, 2), pixels.
    """
    region, grid = heatmap.region, heatmap.grid
    if in_one_component(region, *pixel_pair(endpoints), connectivity=4):
        return heatmap
    values = bridge(heatmap.values, region, grid, endpoints)
    return type(heatmap)(values, grid, heatmap.heading)


def bridge(
    values: NDArray[np.float32],
    region: NDArray[np.bool_],
    grid: GridMap,
    endpoints: NDArray[np.float64],
) -> NDArray[np.float32]:
    """Return the values of a heat map with a bridge along the cheapest path through it.

    Args:
        values: of the heat map, (H, W).
        region: its promising region, (H, W), where a pixel costs next to nothing.
        grid: the map.
        endpoints: start and goal, connected by free pixels, (2, 2), pixels.

    Returns:
        (H, W).
    """
    cost = np.where(region, np.float32(_REGION_COST), 1 + _REGION_COST - values)
    pixels = shortest_path(grid.free, *pixel_pair(endpoints), cost, _REPAIR_SIZE)
    assert pixels is not None, "the endpoints are connected"
    band = paint_band(grid.shape, pixels + np.float64(0.5), half_width(grid, _BRIDGE_FRACTION))
    return np.maximum(values, band)
