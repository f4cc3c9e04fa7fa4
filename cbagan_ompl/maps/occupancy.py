"""Grids as ROS messages have them: rows from the bottom, values that are no truth values.

* nav_msgs/OccupancyGrid (https://docs.ros.org/en/api/nav_msgs/html/msg/OccupancyGrid.html): -1 for
  unknown, else the probability of an obstacle in percent.
* costmap_2d (https://docs.nav2.org/configuration/packages/configuring-costmaps.html): 0 to 252 for
  ever dearer free space, 253 within the robot's inscribed radius of an obstacle, 254 for an
  obstacle, 255 for unknown.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..common.validation import check_fraction, whole_number
from ..errors import MapError, show
from .raw_map import RawMap, check_map_size

_UNKNOWN_OCCUPANCY, _UNKNOWN_COST = -1, 255


def read_occupancy_grid(
    data: ArrayLike,
    width: int,
    height: int,
    resolution: float,
    origin: tuple[float, float, float],
    free_thresh: float,
    unknown_is_free: bool,
    name: str,
) -> RawMap:
    """Read the fields of a nav_msgs/OccupancyGrid.

    Args:
        data: -1 or 0 to 100 for each cell, row by row from the bottom, (width * height,) or
            (height, width). What is masked is unknown.
        width: columns.
        height: rows.
        resolution: metres per cell.
        origin: pose (x, y, yaw) of the lower left corner.
        free_thresh: cells up to this probability of an obstacle are free, 0 to 1.
        unknown_is_free: whether cells of -1 are free.
        name: of the map.

    Raises:
        MapError: the values are not width * height, or one lies outside -1 to 100.
        ConfigError: a size or threshold that makes no sense.
    """
    columns, rows = whole_number("width", width, 1), whole_number("height", height, 1)
    check_map_size(columns, rows, name)
    check_fraction("free_thresh", free_thresh)
    cells = _whole_values(data, name, -1, 100, _UNKNOWN_OCCUPANCY)
    if cells.ndim > 1 and cells.shape != (rows, columns):
        raise MapError(
            f"{name}: the values of an occupancy grid of {columns} x {rows} cells are a list or "
            f"an array of shape {(rows, columns)}, these have shape {cells.shape}"
        )
    if cells.size != columns * rows:
        raise MapError(
            f"{name}: an occupancy grid of {columns} x {rows} cells has {columns * rows} values, "
            f"this one has {cells.size}"
        )
    cells = cells.reshape(rows, columns)[::-1]
    unknown = cells == _UNKNOWN_OCCUPANCY
    # In a table, of which unknown is the last: 0.29 is 29 / 100, but 100 * 0.29 is below 29.
    is_free = np.append(np.arange(101) / 100 <= free_thresh, False)
    free = is_free[cells]
    return _raw_map(free, unknown, unknown_is_free, resolution, origin, name)


def read_costmap(
    array: ArrayLike,
    resolution: float,
    origin: tuple[float, float, float],
    lethal: int,
    unknown_is_free: bool,
    name: str,
) -> RawMap:
    """Read the costs of a costmap_2d; see :meth:`cbagan_ompl.GridMap.from_costmap`.

    Args:
        array: (H, W), costs from 0 to 255, row 0 at the bottom. What is masked is unknown.
        resolution: metres per cell.
        origin: pose (x, y, yaw) of the lower left corner.
        lethal: cells of this cost and more are blocked.
        unknown_is_free: whether cells of 255 are free.
        name: of the map.

    Raises:
        MapError: the array is not 2-D, or a cost lies outside 0 to 255.
        ConfigError: ``lethal`` is no cost.
    """
    least = whole_number("lethal", lethal, 1, 255)
    costs = _whole_values(array, name, 0, 255, _UNKNOWN_COST)
    if costs.ndim != 2:
        raise MapError(f"{name}: a costmap is a 2-D array (H, W), this one has shape {costs.shape}")
    check_map_size(costs.shape[1], costs.shape[0], name)
    costs = costs[::-1]
    unknown = costs == _UNKNOWN_COST
    return _raw_map((costs < least) & ~unknown, unknown, unknown_is_free, resolution, origin, name)


def _whole_values(
    values: ArrayLike, name: str, low: int, high: int, unknown: int
) -> NDArray[np.int16]:
    try:
        filled: Any = np.ma.filled(values, unknown)
        array = np.asarray(filled)
    except (ValueError, TypeError) as error:  # rows of different lengths; a mask on unsigned values
        raise MapError(f"{name}: the values are no array: {error}") from error
    if array.dtype.kind not in "iu" or array.size == 0:
        raise MapError(f"{name}: the values are whole numbers, got an array of {array.dtype}")
    least, most = int(array.min()), int(array.max())
    if least < low or most > high:
        raise MapError(
            f"{name}: the values lie from {low} to {high}, these from {show(least)} to {show(most)}"
        )
    return array.astype(np.int16)


def _raw_map(
    free: NDArray[np.bool_],
    unknown: NDArray[np.bool_],
    unknown_is_free: bool,
    resolution: float,
    origin: tuple[float, float, float],
    name: str,
) -> RawMap:
    if unknown_is_free:
        free = free | unknown
    return RawMap(free, name, resolution, origin, unknown if unknown.any() else None)
