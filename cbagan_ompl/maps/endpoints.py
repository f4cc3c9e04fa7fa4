"""Start and goal on a map: whether they can be planned for, and the nearest places that can."""

from __future__ import annotations

from math import floor
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..common.validation import is_finite_number
from ..errors import TaskError, show

if TYPE_CHECKING:
    from .grid_map import GridMap

#: Start and goal as positions (x, y) in world coordinates, (2,) each.
Endpoints = tuple[NDArray[np.float64], NDArray[np.float64]]

#: Endpoints that were moved, by their role: the point that was ``given``, and the ``distance``.
Moves = dict[str, dict[str, Any]]


def check_endpoints(grid: GridMap, start: ArrayLike, goal: ArrayLike) -> Endpoints:
    """Return start and goal as arrays; see :meth:`cbagan_ompl.GridMap.check_task`."""
    (first, pixel), (last, other) = (
        _check_free(grid, "start", start),
        _check_free(grid, "goal", goal),
    )
    endpoints = first, last
    if np.array_equal(*endpoints):
        raise TaskError(f"start and goal are the same point {_format(endpoints[0])}")
    if grid.components[pixel] != grid.components[other]:
        raise TaskError(
            f"{grid.name}: no path connects start {_format(endpoints[0])} and goal "
            f"{_format(endpoints[1])}, obstacles separate them; choose both in one "
            "connected free part"
        )
    return endpoints


def snap_to_free(
    grid: GridMap, role: str, point: ArrayLike, distance: float
) -> NDArray[np.float64]:
    """Return a point itself where it is free, else the nearest free position within a distance.

    Args:
        grid: the map.
        role: "start" or "goal", for messages.
        point: (x, y), world.
        distance: the farthest that it is moved, world units.

    Raises:
        TaskError: it is no point, outside the map, or nothing within the distance is free.
    """
    places = _find_places(grid, role, point, distance)
    return min(places.values(), key=lambda place: place.distance).position


def snap_endpoints(
    grid: GridMap, start: ArrayLike, goal: ArrayLike, distance: float
) -> tuple[Endpoints, Moves]:
    """Return start and goal, each moved to the nearest free position where it is blocked.

    Where several parts of free space are near, the endpoints go to the part that connects them, and
    of several such parts to that with the shortest moves. Whether one does is not checked here.

    Args:
        grid: the map.
        start: (x, y), world.
        goal: (x, y), world.
        distance: the farthest that each is moved, world units.

    Returns:
        The endpoints, and for those that were moved, by "start" and "goal", the point that was
        ``given`` and the ``distance``, world units.

    Raises:
        TaskError: one of them is no point, outside the map, or nothing near it is free.
    """
    points = {"start": start, "goal": goal}
    places = [_find_places(grid, role, point, distance) for role, point in points.items()]
    common = places[0].keys() & places[1].keys()
    if common:
        part = min(common, key=lambda label: sum(of[label].distance for of in places))
        chosen = [of[part] for of in places]
    else:
        chosen = [min(of.values(), key=lambda place: place.distance) for of in places]
    moves: Moves = {
        role: {"given": check_point(role, point).tolist(), "distance": place.distance}
        for (role, point), place in zip(points.items(), chosen, strict=True)
        if place.distance > 0
    }
    return (chosen[0].position, chosen[1].position), moves


class _Place(NamedTuple):
    """A free position, and how far from a point it is, world units."""

    position: NDArray[np.float64]
    distance: float


def _find_places(grid: GridMap, role: str, point: ArrayLike, distance: float) -> dict[int, _Place]:
    """Return the nearest place in each connected part of free space that is near a point.

    A point in free space has itself alone.
    """
    position = check_position(grid, role, point)
    if grid.is_free(position):
        column, row = grid.to_pixel(position).astype(int).tolist()
        return {int(grid.components[row, column]): _Place(position, 0.0)}
    centre = grid.to_pixel(position)
    reach = distance / grid.resolution
    left, top = np.maximum(np.floor(centre - reach), 0).astype(int)
    right, bottom = np.minimum(np.ceil(centre + reach), (grid.width, grid.height)).astype(int)
    rows, columns = np.nonzero(grid.free[top:bottom, left:right])
    # The point of each free pixel that is nearest, a little inside of it.
    corners = np.stack((columns + left, rows + top), axis=-1)
    nearest = np.clip(centre, corners + 1e-3, corners + 1 - 1e-3)
    distances = np.hypot(*(nearest - centre).T)
    order = np.argsort(distances, kind="stable")
    order = order[distances[order] <= reach]
    if not len(order):
        raise TaskError(
            f"{role} {_format(position)} is {_describe_blocked(grid, position)}, and nothing "
            f"within {distance:g} of it is free; choose another, or snap it from farther away"
        )
    labels = grid.components[tuple(corners[order].T[::-1])]
    parts, first = np.unique(labels, return_index=True)
    places = grid.to_world(nearest[order[first]])
    return {
        int(label): _Place(place, float(np.hypot(*(place - position))))
        for label, place in zip(parts, places, strict=True)
    }


def _check_free(
    grid: GridMap, role: str, point: ArrayLike
) -> tuple[NDArray[np.float64], tuple[int, int]]:
    """Return a point in free space, and the row and column of its pixel."""
    position, (row, column) = _locate(grid, role, point)
    if not grid.free[row, column]:
        raise TaskError(
            f"{role} {_format(position)} is {_describe_blocked(grid, position)} "
            f"(pixel column {column}, row {row}); choose a free point, or let it be moved to the "
            "nearest one with snap (--snap D)"
        )
    return position, (row, column)


def check_point(role: str, point: ArrayLike) -> NDArray[np.float64]:
    """Return a point as a (2,) array.

    Args:
        role: of the point, for the message.
        point: (x, y), any real numbers.

    Raises:
        TaskError: not two finite numbers; texts and truth values are none.
    """
    try:
        values = np.asarray(point).tolist()
    except Exception:  # rows of different lengths, or whatever the class raises
        values = None
    if not (isinstance(values, list) and len(values) == 2 and all(map(is_finite_number, values))):
        raise TaskError(f"{role} must be two finite numbers x, y in world units, got {show(point)}")
    return np.array([float(value) for value in values])


def check_position(grid: GridMap, role: str, point: ArrayLike) -> NDArray[np.float64]:
    """Return a position on a map as a (2,) array.

    Args:
        grid: the map.
        role: of the position, for the message.
        point: (x, y), world.

    Raises:
        TaskError: no point, or one outside of the map.
    """
    return _locate(grid, role, point)[0]


def _locate(
    grid: GridMap, role: str, point: ArrayLike
) -> tuple[NDArray[np.float64], tuple[int, int]]:
    """Return a position as :func:`check_position`, and the row and column of its pixel."""
    position = check_point(role, point)
    column, row = map(floor, grid.pixel_from_world.at(*position.tolist()))
    if not (0 <= column < grid.width and 0 <= row < grid.height):
        low, high = grid.bounds
        raise TaskError(
            f"{role} {_format(position)} is outside {grid.name}, which spans "
            f"x {low[0]:g} to {high[0]:g} and y {low[1]:g} to {high[1]:g}"
        )
    return position, (row, column)


def _describe_blocked(grid: GridMap, position: NDArray[np.float64]) -> str:
    """Return what is at a blocked position: a wall, the margin around one, or unknown space."""
    column, row = np.floor(grid.to_pixel(position)).astype(int).tolist()
    name, was_free = grid.bare
    if was_free[row, column]:
        kind = name_blocked(grid, *_find_nearest_blocked(was_free, row, column))
        return f"too close to {kind} of {name} for the robot's radius"
    return f"in {name_blocked(grid, row, column)} of {name}"


def _find_nearest_blocked(free: NDArray[np.bool_], row: int, column: int) -> tuple[int, int]:
    rows, columns = np.nonzero(~free)
    nearest = int(np.argmin(np.hypot(rows - row, columns - column)))
    return int(rows[nearest]), int(columns[nearest])


def name_blocked(grid: GridMap, row: int, column: int) -> str:
    """Return what is in a blocked pixel, for messages."""
    is_unknown = grid.unknown is not None and grid.unknown[row, column]
    return "unknown space" if is_unknown else "an obstacle"


def _format(point: NDArray[np.float64]) -> str:
    return f"({point[0]:g}, {point[1]:g})"
