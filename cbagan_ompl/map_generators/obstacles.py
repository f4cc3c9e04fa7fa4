"""Map generators of open ground: scattered obstacles, and barriers across the map."""

from __future__ import annotations

from math import cos, pi, sin

import numpy as np

from .shapes import (
    Mask,
    Point,
    box,
    canvas,
    ellipse,
    fill_pockets,
    scatter,
    scatter_clutter,
    triangle,
)


def walls_with_gaps(rng: np.random.Generator, width: int, height: int) -> Mask:
    """Generate walls from border to border, one or two gaps in each, and boxes between them.

    Arguments and result as for every generator, see :mod:`cbagan_ompl.map_generators`.
    """
    free, unit = canvas(width, height)
    count = max(2, round(width / (14 * unit)))
    lane = width / (count + 1)
    for i in range(count):
        thick = round(rng.uniform(1.2, 2.6) * unit)
        left = round((i + 1) * lane + rng.uniform(-0.08, 0.08) * lane - thick / 2)
        free[:, left : left + thick] = False
        for _ in range(rng.integers(1, 3)):
            gap = round(rng.uniform(3.0, 5.0) * unit)
            top = rng.integers(round(unit), height - gap - round(unit))
            free[top : top + gap, left : left + thick] = True
    for i in range(count + 1):
        for _ in range(rng.integers(2, 5)):
            # Too narrow to reach a wall and close its gap.
            centre = (i + rng.uniform(0.4, 0.6)) * lane, rng.uniform(0.05, 0.95) * height
            half = rng.uniform(0.06, 0.2) * lane, rng.uniform(0.06, 0.3) * lane
            free &= ~box(free, centre, half)
    return fill_pockets(free)


def clutter(rng: np.random.Generator, width: int, height: int) -> Mask:
    """Generate boxes and ellipses of many sizes and angles on a quarter to a third of the map.

    Arguments and result as for every generator, see :mod:`cbagan_ompl.map_generators`.
    """
    free, unit = canvas(width, height)
    scatter_clutter(free, rng, unit, rng.uniform(0.25, 0.34))
    return fill_pockets(free)


def narrow_passage(rng: np.random.Generator, width: int, height: int) -> Mask:
    """Generate a thick wall with one straight passage of 4 to 6 pixels, and clutter beside it.

    Arguments and result as for every generator, see :mod:`cbagan_ompl.map_generators`.
    """
    free, unit = canvas(width, height)
    gap, thick = int(rng.integers(4, 7)), round(rng.uniform(0.12, 0.2) * width)
    left = round(rng.uniform(0.42, 0.58) * width - thick / 2)
    top = int(rng.integers(height // 5, 4 * height // 5))
    # Both ends of the passage stay clear.
    clear = box(free, (left + thick / 2, top + gap / 2), (thick / 2 + 4 * unit, 2 * unit))
    scatter_clutter(free, rng, unit, rng.uniform(0.14, 0.2), clear)
    free[:, left : left + thick] = False
    free[top : top + gap, left : left + thick] = True
    return fill_pockets(free)


def bug_trap(rng: np.random.Generator, width: int, height: int) -> Mask:
    """Generate the classic bug trap: a hollow body that is open on the left only.

    The opening leads through a channel that reaches far into the body, so that a tree from inside
    must grow away from a goal on the right before it gets out.

    Arguments and result as for every generator, see :mod:`cbagan_ompl.map_generators`.
    """
    free, unit = canvas(width, height)
    x, y = (rng.uniform(0.48, 0.52) * side for side in (width, height))
    a, b = rng.uniform(0.26, 0.29) * width, rng.uniform(0.26, 0.3) * height
    thick, mouth = round(1.6 * unit), round(rng.uniform(2.2, 3.0) * unit)
    lip = rng.uniform(0.75, 0.9) * a
    hollow = ellipse(free, (x, y), (a - thick, b - thick), exponent=3.0)
    free &= hollow | ~ellipse(free, (x, y), (a, b), exponent=3.0)
    # The channel of the mouth: a block across the wall on the left, with a passage cut out of it.
    channel = x - a + lip / 2
    free &= ~box(free, (channel, y), (lip / 2, mouth / 2 + thick))
    free |= box(free, (channel - unit, y), (lip / 2 + 1.5 * unit, mouth / 2))
    # A passage around the body and in front of its mouth stays clear.
    clear = ellipse(free, (x, y), (a + 2.5 * unit, b + 2.5 * unit), exponent=3.0)
    clear |= box(free, (x - a, y), (5 * unit, 3 * unit))
    scatter_clutter(free, rng, 0.8 * unit, (~free).mean() + rng.uniform(0.07, 0.11), clear)
    return fill_pockets(free)


def blocks(rng: np.random.Generator, width: int, height: int) -> Mask:
    """Generate axis-aligned boxes, which may overlap.

    Arguments and result as for every generator, see :mod:`cbagan_ompl.map_generators`.
    """
    free, unit = canvas(width, height)

    def shape(centre: Point) -> Mask:
        return box(free, centre, (rng.uniform(2, 9) * unit, rng.uniform(2, 9) * unit))

    scatter(free, rng, rng.uniform(0.1, 0.3), shape)
    return fill_pockets(free)


def ellipses(rng: np.random.Generator, width: int, height: int) -> Mask:
    """Generate ellipses at any angle.

    Arguments and result as for every generator, see :mod:`cbagan_ompl.map_generators`.
    """
    free, unit = canvas(width, height)

    def shape(centre: Point) -> Mask:
        half = rng.uniform(2, 9) * unit, rng.uniform(2, 9) * unit
        return ellipse(free, centre, half, rng.uniform(0, pi))

    scatter(free, rng, rng.uniform(0.1, 0.3), shape)
    return fill_pockets(free)


def triangles(rng: np.random.Generator, width: int, height: int) -> Mask:
    """Generate triangles at any angle.

    Arguments and result as for every generator, see :mod:`cbagan_ompl.map_generators`.
    """
    free, unit = canvas(width, height)

    def shape(centre: Point) -> Mask:
        return triangle(free, centre, rng.uniform(5, 14) * unit, rng.uniform(0, 2 * pi))

    scatter(free, rng, rng.uniform(0.08, 0.22), shape)
    return fill_pockets(free)


def tl_shapes(rng: np.random.Generator, width: int, height: int) -> Mask:
    """Generate shapes of the letters T and L, rotated by multiples of about 90 degrees.

    Arguments and result as for every generator, see :mod:`cbagan_ompl.map_generators`.
    """
    free, unit = canvas(width, height)

    def shape(centre: Point) -> Mask:
        angle = rng.integers(4) * pi / 2 + rng.normal(0, 0.1)
        bar, stem, thick = (rng.uniform(*span) * unit for span in ((4, 9), (4, 10), (1.2, 2.5)))
        # The stem hangs from the middle of the bar, or from one end of it.
        along = (bar - thick) * int(rng.integers(-1, 2))
        x = centre[0] + cos(angle) * along - sin(angle) * stem
        y = centre[1] + sin(angle) * along + cos(angle) * stem
        upper = box(free, centre, (bar, thick), angle)
        return upper | box(free, (x, y), (thick, stem), angle)

    scatter(free, rng, rng.uniform(0.1, 0.24), shape)
    return fill_pockets(free)
