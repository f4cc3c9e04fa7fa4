"""Generators of random maps, of many kinds that are hard for planners in different ways.

A generator is a function ``(rng, width, height)`` of a random generator and a size in pixels, both
at least :data:`MIN_SIZE` (ConfigError otherwise). It returns one map as a bool array (height,
width), true where free, row 0 on top. All other lengths are in pixels as well. The free pixels of a
map are 4-connected: pockets that no path reaches are filled. All random numbers come from ``rng``:
the same seed gives the same map with the same versions of NumPy, SciPy and OpenCV.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from ..errors import ConfigError
from .buildings import maze, rooms, warehouse
from .fine_structures import (
    fine_maze,
    random_pixels,
    reduced_map,
    scanned_map,
    slanted_walls,
)
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
from .shapes import MIN_SIZE, Mask, fill_pockets
from .terrain import blocked_cells, caves, city, curved_walls, race_track

__all__ = [
    "MAP_GENERATORS",
    "MIN_SIZE",
    "Mask",
    "bug_trap",
    "check_generators",
    "fill_pockets",
    "narrow_passage",
]

#: Every generator by its name.
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
    "fine_maze": fine_maze,
    "halls": halls,
    "maze": maze,
    "narrow_passage": narrow_passage,
    "offices": offices,
    "race_track": race_track,
    "random_pixels": random_pixels,
    "reduced_map": reduced_map,
    "room_grid": room_grid,
    "rooms": rooms,
    "scanned_map": scanned_map,
    "shelves": shelves,
    "slanted_walls": slanted_walls,
    "tl_shapes": tl_shapes,
    "triangles": triangles,
    "walls_with_gaps": walls_with_gaps,
    "warehouse": warehouse,
}


def check_generators(names: Sequence[str]) -> None:
    """Raise if a list of generators is empty or holds an unknown name.

    Args:
        names: keys of :data:`MAP_GENERATORS`.

    Raises:
        ConfigError: it does; the message lists the known names.
    """
    unknown = [name for name in names if name not in MAP_GENERATORS]
    if not names:
        raise ConfigError(f"no map generator is given; there are {', '.join(MAP_GENERATORS)}")
    if unknown:
        raise ConfigError(
            f"unknown map generator {', '.join(unknown)!r}; there are {', '.join(MAP_GENERATORS)}"
        )
