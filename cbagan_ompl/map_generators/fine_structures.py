"""Map generators of fine structures: passages of a pixel or two, thin walls, maps of old scanners.

Walls and passages here do not grow with the map. What opens or closes a passage may be one pixel.
"""

from __future__ import annotations

from math import cos, pi, sin

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from .buildings import rooms
from .floor_plans import cell_maze, generate_cells, halls, offices, room_grid
from .shapes import Mask, add_frame, check_size, empty_map, fill_pockets
from .terrain import caves, city, curved_walls

# What is scanned for scanned_map, and what is reduced for reduced_map.
_PLANS = offices, room_grid, rooms, halls
_REDUCED = room_grid, halls, cell_maze, caves, city, curved_walls


def fine_maze(rng: np.random.Generator, width: int, height: int) -> Mask:
    """Generate a maze of passages of 1 to 3 pixels between walls of 1 or 2.

    Arguments and result as for every generator, see :mod:`cbagan_ompl.map_generators`.
    """
    wall, passage = int(rng.integers(1, 3)), int(rng.integers(1, 4))
    loops = 0.0 if rng.random() < 0.6 else rng.uniform(0.01, 0.15)
    pitch = wall + passage
    return generate_cells(
        rng, width, height, pitch, wall, passage, loops, winding=rng.random() < 0.5
    )


def random_pixels(rng: np.random.Generator, width: int, height: int) -> Mask:
    """Generate squares of 1 to 4 pixels, blocked at random until hardly a way through is left.

    No 4-connected way across a large map is left when 40.7 % of the squares are blocked: the
    threshold of site percolation on the square grid. Here it is 25 to 39 %.

    Arguments and result as for every generator, see :mod:`cbagan_ompl.map_generators`.
    """
    check_size(width, height)
    side = int(rng.integers(1, 5))
    shape = -(-height // side), -(-width // side)
    free = rng.random(shape) >= rng.uniform(0.25, 0.39)
    return fill_pockets(free.repeat(side, axis=0).repeat(side, axis=1)[:height, :width])


def slanted_walls(rng: np.random.Generator, width: int, height: int) -> Mask:
    """Generate straight walls of 1 to 3 pixels at every angle, with gaps where they cross others.

    Arguments and result as for every generator, see :mod:`cbagan_ompl.map_generators`.
    """
    free = empty_map(width, height)
    side = min(width, height)
    first = rng.uniform(0, pi)
    is_ordered = rng.random() < 0.4  # walls in two directions only
    for _ in range(int(rng.integers(8, 40))):
        angle = first + pi / 2 * int(rng.integers(2)) if is_ordered else rng.uniform(0, pi)
        half = rng.uniform(0.1, 0.6) * side
        middle = rng.uniform(0, width), rng.uniform(0, height)
        _draw_wall(free, middle, angle, half, int(rng.integers(1, 4)), True)
        for _ in range(int(rng.integers(1, 3))):
            along = rng.uniform(-0.9, 0.9) * half
            gap = middle[0] + along * cos(angle), middle[1] + along * sin(angle)
            _draw_wall(free, gap, angle, rng.uniform(1, 5), int(rng.integers(3, 6)), False)
    return fill_pockets(free)


def scanned_map(rng: np.random.Generator, width: int, height: int) -> Mask:
    """Generate a floor plan as an old laser scanner maps it.

    Walls are thin and bent by drift, thicker or missing in places; specks lie on the floor.

    Arguments and result as for every generator, see :mod:`cbagan_ompl.map_generators`.
    """
    plan = _PLANS[int(rng.integers(len(_PLANS)))](rng, width, height)
    add_frame(plan, 1)
    drift = [
        rng.uniform(0.5, 2.5) * _unit_noise(rng, width, height, rng.uniform(4, 20))
        for _ in range(2)
    ]
    rows, columns = np.mgrid[:height, :width].astype(np.float32)
    turned = cv2.getRotationMatrix2D((width / 2, height / 2), rng.uniform(0, 360), 0.9)
    bent = cv2.remap(
        plan.astype(np.float32),
        (columns + drift[0]).astype(np.float32),
        (rows + drift[1]).astype(np.float32),
        cv2.INTER_LINEAR,
    )
    if rng.random() < 0.6:
        bent = cv2.warpAffine(bent, turned, (width, height), flags=cv2.INTER_LINEAR)
    noise = gaussian_filter(rng.standard_normal((height, width)), rng.uniform(0.4, 1.0))
    free: Mask = bent + rng.uniform(0.1, 0.5) * noise > rng.uniform(0.4, 0.7)
    specks = rng.random(free.shape) < rng.uniform(0.0, 0.01)
    np.logical_and(free, ~specks, out=free)
    return fill_pockets(free)


def reduced_map(rng: np.random.Generator, width: int, height: int) -> Mask:
    """Generate a map with 2 or 3 times as many pixels a side, and reduce it.

    A pixel is free when any of its block is, as where maps are scaled down for a network: narrow
    passages survive, thin walls have holes.

    Arguments and result as for every generator, see :mod:`cbagan_ompl.map_generators`.
    """
    check_size(width, height)
    while True:
        factor = 2 if rng.random() < 0.7 else 3
        large = _REDUCED[int(rng.integers(len(_REDUCED)))](rng, factor * width, factor * height)
        blocks = large.reshape(height, factor, width, factor)
        free = fill_pockets(np.asarray(blocks.any(axis=(1, 3))))
        if free.mean() < 0.9:  # not all walls are lost
            return free


def _draw_wall(
    free: Mask, middle: tuple[float, float], angle: float, half: float, thick: int, blocked: bool
) -> None:
    """Block a straight wall of a length of twice ``half``, or free it."""
    reach = half * cos(angle), half * sin(angle)
    ends = [
        tuple(round(m + sign * r) for m, r in zip(middle, reach, strict=True)) for sign in (-1, 1)
    ]
    pixels = np.zeros(free.shape, np.uint8)
    cv2.line(pixels, ends[0], ends[1], 1, thick)
    free[pixels > 0] = not blocked


def _unit_noise(
    rng: np.random.Generator, width: int, height: int, scale: float
) -> NDArray[np.float64]:
    """Return smooth noise of unit variance."""
    noise = gaussian_filter(rng.standard_normal((height, width)), scale)
    unit: NDArray[np.float64] = noise / noise.std()
    return unit
