"""Growing obstacles by the radius of a robot."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from ..errors import MapError


def erode(
    free: NDArray[np.bool_], radius: float, resolution: float, name: str, border: bool
) -> NDArray[np.bool_]:
    """Return the pixels that are a distance away from every blocked pixel, square to square.

    Args:
        free: (H, W), true where free, with a blocked pixel somewhere unless the border is one.
        radius: the distance, world units.
        resolution: world units per pixel.
        name: what to call the map in the message.
        border: whether what is beyond the border of the map is blocked.

    Returns:
        (H, W).

    Raises:
        MapError: nothing stays free.
    """
    # The gap between two pixels is the distance of their centres with one of them grown by a
    # pixel all around, so growing the obstacles first makes the distance transform, which
    # measures between centres, give gaps.
    blocked = np.pad((~free).astype(np.uint8), int(border), constant_values=1)
    grown = cv2.dilate(blocked, np.ones((3, 3), np.uint8))
    gap = cv2.distanceTransform(1 - grown, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)
    # The factor covers the rounding of float32 and of the division: 1.1 / 0.1 is 11 pixels.
    # The limit keeps absurd radii within the range of float32.
    kept = np.asarray(gap >= min(radius / resolution * (1 - 1e-6), 1e30))
    if border:
        kept = kept[1:-1, 1:-1].copy()
    if not kept.any():
        raise MapError(
            f"{name}: a robot of radius {radius} fits nowhere on this map "
            f"({free.shape[1]} x {free.shape[0]} pixels of {resolution})"
        )
    return kept
