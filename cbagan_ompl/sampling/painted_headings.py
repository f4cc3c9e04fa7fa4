"""Headings from the directions of travel that a network paints in the patches of a map."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .heatmap import Heatmap


def set_painted_headings(
    heatmap: Heatmap, directions: NDArray[np.float32], patches: tuple[float, float]
) -> None:
    """Set the headings of a heat map that no one else has yet.

    Args:
        heatmap: its headings are set where it is not 0.
        directions: (2, h, w), unit vectors (u, v) of each patch, u right and v down; 0 where
            unknown.
        patches: rows and columns of patches that cover the map, at most (h, w); the last ones may
            be cut off by its edge.

    Example:
        >>> from cbagan_ompl import GridMap
        >>> heatmap = Heatmap([[1.0, 0.0, 1.0, 1.0]], GridMap([[1, 1, 1, 1]]))
        >>> set_painted_headings(heatmap, np.array([[[1, 0]], [[0, 0]]], np.float32), (1, 2))
        >>> heatmap.heading.tolist()
        [[0.0, nan, nan, nan]]
    """
    grid = heatmap.grid
    angles = np.arctan2(directions[1], directions[0])
    angles[(directions == 0).all(axis=0)] = np.nan
    if grid.origin is not None:  # a ROS map is turned by the yaw of its origin, and y points up
        angles = (np.float32(grid.origin[2]) - angles + np.pi) % (2 * np.pi) - np.pi
    rows, columns = (
        ((np.arange(size) + 0.5) * count / size).astype(np.intp)
        for size, count in zip(grid.shape, patches, strict=True)
    )
    row, column = np.divmod(heatmap._support, grid.width)
    heading = np.full(grid.shape, np.nan, np.float32)
    heading.ravel()[heatmap._support] = angles[rows[row], columns[column]]
    heading.setflags(write=False)
    heatmap.heading = heading
