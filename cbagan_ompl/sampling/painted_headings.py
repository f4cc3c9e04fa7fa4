"""Headings from the directions of travel that a network paints in the patches of a map."""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..common.compilation import compiled
from .heatmap import Heatmap


class PaintedHeatmap(Heatmap):
    """A heat map whose headings are computed when they are first asked for.

    Made by :func:`.painting.paint_heatmap` alone.

    Attributes:
        directions: (2, h, w), unit vectors (u, v) of each patch, u right and v down; 0 where
            unknown.
        patches: rows and columns of patches that cover the map, at most (h, w); the last ones may
            be cut off by its edge.
        painted: flat indices of the pixels that the network has painted, (K,).
    """

    directions: NDArray[np.float32]
    patches: tuple[float, float]
    painted: NDArray[np.intp]

    @cached_property
    def heading(self) -> NDArray[np.float32]:  # type: ignore[override]
        """The direction of travel where the network has painted, see :class:`.heatmap.Heatmap`."""
        angles = np.arctan2(self.directions[1], self.directions[0])
        angles[(self.directions == 0).all(axis=0)] = np.nan
        if self.grid.origin is not None:  # turned by the yaw of its origin, and y points up
            angles = (np.float32(self.grid.origin[2]) - angles + np.pi) % (2 * np.pi) - np.pi
        rows, columns = (
            ((np.arange(size) + 0.5) * count / size).astype(np.intp)
            for size, count in zip(self.grid.shape, self.patches, strict=True)
        )
        heading = np.full(self.grid.shape, np.nan, np.float32)
        _spread(angles.astype(np.float32), rows, columns, self.painted, heading)
        heading.setflags(write=False)
        return heading


@compiled
def _spread(
    angles: NDArray[np.float32],
    rows: NDArray[np.intp],
    columns: NDArray[np.intp],
    support: NDArray[np.intp],
    heading: NDArray[np.float32],
) -> None:  # pragma: no cover
    """Write the angle of its patch into each pixel of the support, in place.

    Args:
        angles: of the patches.
        rows: of the patches, for each row of pixels.
        columns: the same for columns.
        support: flat indices of pixels.
        heading: of the pixels.
    """
    width = heading.shape[1]
    for index in support:
        row = index // width
        heading[row, index - row * width] = angles[rows[row], columns[index - row * width]]
