"""Growing obstacles by the radius of a robot."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray


def erode(free: NDArray[np.bool_], radius: float) -> NDArray[np.bool_]:
    """Return the pixels that are a distance away from every blocked pixel, square to square.

    Args:
        free: (H, W), true where free, with a blocked pixel somewhere.
        radius: the distance, in pixels.

    Returns:
        (H, W); the border of the map is no obstacle.
    """
    # The gap between two pixels is the distance of their centres with one of them grown by a
    # pixel all around, so growing the obstacles first makes the distance transform, which
    # measures between centres, give gaps.
    grown = cv2.dilate((~free).astype(np.uint8), np.ones((3, 3), np.uint8))
    gap = cv2.distanceTransform(1 - grown, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    # The factor covers the rounding of float32 and of the division: 1.1 / 0.1 is 11 pixels.
    # The limit keeps absurd radii within the range of float32.
    return np.asarray(gap >= min(radius * (1 - 1e-6), 1e30))
