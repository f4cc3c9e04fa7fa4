"""Further maps from one: the augmentation of the paper (its table of data augmentation)."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from ..map_generators import without_pockets

#: Height and width shift of the paper's table, in pixels, in steps of 1.
SHIFT = 2
#: Rotation probability of the paper's table; the angle is uniform over the circle.
ROTATION_PROBABILITY = 0.5
#: Largest shear angle in degrees; the paper names shearing and gives no number.
SHEAR = 5.0


def augmented(free: NDArray[np.bool_], rng: np.random.Generator) -> NDArray[np.bool_]:
    """A copy of a map, shifted, sheared, and turned with probability one half.

    What comes in from outside is free, as the ground around the obstacles of the published maps
    is. Pockets that this cuts off are filled. The paper also rescales and changes the brightness
    of its images; on a map of free and blocked that does nothing, so it is left out.

    Args:
        free: (S, S), true where free.
        rng: draws the change.
    """
    side = free.shape[0]
    shift = rng.integers(-SHIFT, SHIFT + 1, size=2)
    angle = rng.uniform(0, 360) if rng.random() < ROTATION_PROBABILITY else 0.0
    shear = np.tan(np.radians(rng.uniform(-SHEAR, SHEAR)))
    middle = (side - 1) / 2
    turn = np.vstack((cv2.getRotationMatrix2D((middle, middle), angle, 1.0), (0, 0, 1)))
    lean = np.array(((1, shear, shift[0] - shear * middle), (0, 1, shift[1]), (0, 0, 1)))
    pixels = cv2.warpAffine(
        free.astype(np.uint8),
        (lean @ turn)[:2],
        (side, side),
        flags=cv2.INTER_NEAREST,
        borderMode=cv2.BORDER_CONSTANT,
        borderValue=1,
    )
    return without_pockets(pixels.astype(np.bool_))
