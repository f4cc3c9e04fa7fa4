"""Paths in the forms that other programs read."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def path_csv(path: NDArray[np.float64]) -> str:
    """Return a path as a table: a line of names, then a line for each way point.

    Args:
        path: positions (N, 2) or poses (N, 3), world.

    Returns:
        Columns ``x``, ``y``, for poses ``yaw``, and ``index``, the place in the order from 0.
        Numbers are written so that they are read back as they were.

    Example:
        >>> print(path_csv(np.array([[0.0, 0.5], [1.0, 2.0]])), end="")
        x,y,index
        0.0,0.5,0
        1.0,2.0,1
    """
    names = ("x", "y", "yaw")[: path.shape[1]]
    rows = [[*map(repr, point), str(index)] for index, point in enumerate(path.tolist())]
    return "".join(",".join(row) + "\n" for row in [[*names, "index"], *rows])
