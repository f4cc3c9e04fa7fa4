"""Augmentation of maps, as in the CBAGAN-RRT paper (https://arxiv.org/abs/2305.10442).

The values below are those of the paper's table of data augmentation, where it gives one.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from ..map_generators import fill_pockets

#: Largest shift of height and width in pixels, in steps of 1.
SHIFT = 2
#: Probability of a rotation; its angle is uniform over the full circle.
ROTATION_PROBABILITY = 0.5
#: Largest shear angle in degrees; the paper names shearing and gives no number.
SHEAR = 5.0


def augment(free: NDArray[np.bool_], rng: np.random.Generator) -> NDArray[np.bool_]:
    """Return a copy of a map, shifted, sheared, and rotated with probability one half.

    Pixels that come in from outside are free, like the pixels around the obstacles of the published
    maps. Pockets that the change cuts off are filled. The paper also rescales and changes the
    brightness of its images; that leaves a map of free and blocked pixels as it is, so it is left
    out.

    Args:
        free: (S, S), true where free.
        rng: source of all random numbers.

    Returns:
        (S, S), true where free.

    Example:
        >>> augment(np.ones((64, 64), dtype=bool), np.random.default_rng(0)).all()
        np.True_
    """
    size = free.shape[0]
    shift = rng.integers(-SHIFT, SHIFT + 1, size=2)
    angle = rng.uniform(0, 360) if rng.random() < ROTATION_PROBABILITY else 0.0
    shear = np.tan(np.radians(rng.uniform(-SHEAR, SHEAR)))
    centre = (size - 1) / 2
    rotation = np.vstack((cv2.getRotationMatrix2D((centre, centre), angle, 1.0), (0, 0, 1)))
    shear_and_shift = np.array(((1, shear, shift[0] - shear * centre), (0, 1, shift[1]), (0, 0, 1)))
    pixels = cv2.warpAffine(
        free.astype(np.uint8),
        (shear_and_shift @ rotation)[:2],
        (size, size),
        flags=cv2.INTER_NEAREST,
        borderMode=cv2.BORDER_CONSTANT,
        borderValue=1,
    )
    return fill_pockets(pixels.astype(np.bool_))
