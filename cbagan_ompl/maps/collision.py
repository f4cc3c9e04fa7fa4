"""Exact checks of straight segments against a grid of square pixels.

The pixels that a segment passes through are visited one by one: Amanatides and Woo, "A fast voxel
traversal algorithm for ray tracing", Eurographics 1987, https://doi.org/10.2312/egtp.19871000.
"""

from __future__ import annotations

from math import floor

import numpy as np
from numpy.typing import NDArray

# Two crossings closer than this (as a fraction of the segment) count as one through the corner.
_TIE = 1e-12


def segment_is_free(  # noqa: C901 - the inner loop of every planner, so nothing is factored out
    cells: bytes, width: int, height: int, u0: float, v0: float, u1: float, v1: float
) -> bool:
    """Return whether every pixel that a segment passes through is free.

    A point belongs to the pixel (floor(u), floor(v)). Where the segment passes exactly through a
    corner that four pixels share, all four must be free: there is no gap between two obstacles
    that touch diagonally, and no path scrapes past a corner.

    Args:
        cells: row-major pixels, ``cells[row * width + column]``, non-zero where free.
        width: columns of the grid.
        height: rows of the grid.
        u0: column coordinate of one end, in pixels from the left border.
        v0: row coordinate of that end, in pixels from the upper border.
        u1: column coordinate of the other end.
        v1: row coordinate of the other end.

    Returns:
        False when any pixel on the way is blocked or outside the grid, or a coordinate is NaN.
    """
    # Comparisons that NaN fails; afterwards every pixel on the way lies inside the grid.
    if not (0 <= u0 < width and 0 <= v0 < height and 0 <= u1 < width and 0 <= v1 < height):
        return False
    column, row = floor(u0), floor(v0)
    columns_left, rows_left = floor(u1) - column, floor(v1) - row
    cell = row * width + column
    if not cells[cell]:
        return False

    # step: index offset to the next pixel; t: where on the segment (0..1) its border is crossed.
    step_u, step_v, t_u, t_v, every_u, every_v = 1, width, 2.0, 2.0, 0.0, 0.0
    if columns_left > 0:
        every_u = 1 / (u1 - u0)
        t_u = (column + 1 - u0) * every_u
    elif columns_left < 0:
        step_u, every_u = -1, 1 / (u0 - u1)
        t_u, columns_left = (u0 - column) * every_u, -columns_left
    if rows_left > 0:
        every_v = 1 / (v1 - v0)
        t_v = (row + 1 - v0) * every_v
    elif rows_left < 0:
        step_v, every_v = -width, 1 / (v0 - v1)
        t_v, rows_left = (v0 - row) * every_v, -rows_left

    while columns_left and rows_left:
        ahead = t_v - t_u
        if ahead > _TIE:
            cell += step_u
            t_u += every_u
            columns_left -= 1
        elif ahead < -_TIE:
            cell += step_v
            t_v += every_v
            rows_left -= 1
        else:
            if not (cells[cell + step_u] and cells[cell + step_v]):
                return False
            cell += step_u + step_v
            t_u += every_u
            t_v += every_v
            columns_left -= 1
            rows_left -= 1
        if not cells[cell]:
            return False
    for _ in range(columns_left):
        cell += step_u
        if not cells[cell]:
            return False
    for _ in range(rows_left):
        cell += step_v
        if not cells[cell]:
            return False
    return True


def pixels_are_free(free: NDArray[np.bool_], pixels: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return whether points lie in free pixels; outside the map nothing is free.

    Args:
        free: (H, W), true where free.
        pixels: pixel coordinates (u, v), shape (..., 2).

    Returns:
        (...).
    """
    within = (pixels >= 0) & (pixels < free.shape[::-1])
    inside = np.asarray(within.all(axis=-1))
    indices = np.where(inside[..., None], pixels, 0).astype(np.intp)
    return np.asarray(inside & free[indices[..., 1], indices[..., 0]])
