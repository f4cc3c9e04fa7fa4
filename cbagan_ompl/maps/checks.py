"""The check that an argument is a map."""

from __future__ import annotations

from ..errors import CbaganOmplError, MapError, show
from .grid_map import GridMap


def check_grid(grid: object, error_class: type[CbaganOmplError] = MapError) -> None:
    """Raise if a value is no map.

    Args:
        grid: the value.
        error_class: what to raise.

    Raises:
        CbaganOmplError: of that class; the message says how to make a map.

    Example:
        >>> check_grid(GridMap([[1, 0]]))
    """
    if not isinstance(grid, GridMap):
        raise error_class(
            f"expected a GridMap, got {show(grid)}; an array of free pixels becomes one with "
            "GridMap(free), a map file with GridMap.load(path)"
        )
