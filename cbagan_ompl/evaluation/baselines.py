"""Trivial baselines: predictions that use nothing but the map, the start and the goal."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from ..datasets.dataset import Tasks

# Thickness in pixels that OpenCV is asked for; its lines come out up to two pixels thicker.
_LINE_THICKNESS = 7


def trivial_baselines(tasks: Tasks) -> dict[str, NDArray[np.bool_]]:
    """Return the regions of two trivial baselines: all free space, and a straight line.

    Returns:
        By their names, (N, S, S) each, true in the region. The line runs from start to goal, is 7
        to 9 pixels wide, and is left out on obstacles.
    """
    lines = np.zeros_like(tasks.region)
    for line, start, goal in zip(lines, tasks.start, tasks.goal, strict=True):
        endpoints = np.floor((start, goal)).astype(int).tolist()
        cv2.line(line, endpoints[0], endpoints[1], 1, thickness=_LINE_THICKNESS)
    free = tasks.free
    return {"all free space": free, "straight line": lines.astype(np.bool_) & free}
