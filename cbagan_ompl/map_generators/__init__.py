"""Random maps of many kinds that planners find hard in different ways.

Every family is a function that draws one map: free pixels are true, row 0 is on top, lengths are in
pixels. The free pixels of a map are all connected (4-connected): pockets that no path reaches are
filled. All chance is NumPy's: the same seed gives the same map with the same versions of NumPy,
SciPy and OpenCV.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from ..errors import ConfigError
from .buildings import maze, rooms, warehouse
from .floor_plans import cell_maze, halls, offices, room_grid, shelves
from .obstacles import (
    blocks,
    bug_trap,
    clutter,
    ellipses,
    narrow_passage,
    tl_shapes,
    triangles,
    walls_with_gaps,
)
from .shapes import MIN_SIDE, Mask, without_pockets
from .terrain import blocked_cells, caves, city, curved_walls, race_track

__all__ = [
    "MAP_GENERATORS",
    "MIN_SIDE",
    "Mask",
    "bug_trap",
    "check_generators",
    "narrow_passage",
    "without_pockets",
]

#: Every family by its name.
MAP_GENERATORS: dict[str, Callable[[np.random.Generator, int, int], Mask]] = {
    "blocked_cells": blocked_cells,
    "blocks": blocks,
    "bug_trap": bug_trap,
    "caves": caves,
    "cell_maze": cell_maze,
    "city": city,
    "clutter": clutter,
    "curved_walls": curved_walls,
    "ellipses": ellipses,
    "halls": halls,
    "maze": maze,
    "narrow_passage": narrow_passage,
    "offices": offices,
    "race_track": race_track,
    "room_grid": room_grid,
    "rooms": rooms,
    "shelves": shelves,
    "tl_shapes": tl_shapes,
    "triangles": triangles,
    "walls_with_gaps": walls_with_gaps,
    "warehouse": warehouse,
}


def check_generators(names: Sequence[str]) -> None:
    """Refuse a list of families that is empty or names one that is not there.

    Raises:
        ConfigError: it is; the message lists those that are.
    """
    unknown = [name for name in names if name not in MAP_GENERATORS]
    if not names:
        raise ConfigError(f"no map family is named; there are {', '.join(MAP_GENERATORS)}")
    if unknown:
        raise ConfigError(
            f"unknown map family {', '.join(unknown)!r}; there are {', '.join(MAP_GENERATORS)}"
        )
