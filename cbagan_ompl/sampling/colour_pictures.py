"""Regions that are drawn in colour, as in the published (map, point, ROI) data sets.

There the region is green on white, often with obstacles in black and marks at start and goal. Read
as gray levels such a picture is the wrong way round: green is darker than white.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import HeatmapError

# Levels, of 1, that are as good as dark and as bright: between them a colour is not clear.
_DARK, _BRIGHT = 0.2, 0.8

# The least green, and how much more of it there is than of the other two.
_LEAST_GREEN, _MORE_GREEN = 0.35, 2.5

# The fraction of a picture that marks of start and goal have at most.
_MOST_MARKED = 0.05


def has_colours(pixels: NDArray[np.uint8 | np.uint16]) -> bool:
    """Return whether the pixels of an image, (H, W) or (H, W, C), are more than gray levels."""
    if pixels.ndim == 2:
        return False
    return bool((pixels[..., :1] != pixels[..., 1:3]).any())


def read_green_region(
    pixels: NDArray[np.uint8 | np.uint16], white: int, name: str
) -> NDArray[np.float32]:
    """Return the region of a picture that is white where free and green in the region.

    Args:
        pixels: (H, W, 3) or (H, W, 4), blue, green, red and alpha.
        white: the brightest level.
        name: of the file, for the message.

    Returns:
        (H, W), 1 in the region, with the marks of start and goal, and 0 elsewhere.

    Raises:
        HeatmapError: the picture has other colours, so that nobody can tell where the region is.
    """
    blue, green, red = (pixels[..., channel].astype(np.float32) / white for channel in range(3))
    others = np.maximum(blue, red)
    is_region = (green >= _LEAST_GREEN) & (green >= _MORE_GREEN * others)
    is_white = np.minimum(np.minimum(blue, green), red) >= _BRIGHT
    is_black = np.maximum(others, green) <= _DARK
    # Marks are red, blue, or of another colour without shades.
    is_mark = (others >= _BRIGHT) & (np.minimum(np.minimum(blue, green), red) <= _DARK) & ~is_region
    is_clear: Any = is_region | is_white | is_black | is_mark
    is_opaque = pixels.shape[2] == 3 or bool((pixels[..., 3] == white).all())
    # Otherwise the green may be a mark as well.
    marked = is_mark.mean()
    stands_out = is_region.mean() > marked <= _MOST_MARKED
    if not (is_opaque and is_clear.all() and stands_out):
        raise HeatmapError(
            f"{name}: a heat map is a gray image, black 0 and white 1, or a picture with a green "
            "region on white, obstacles in black; the colours of this one are others, and nobody "
            "can tell which of them are high values: save the values as a gray image or with "
            "numpy.save"
        )
    return (is_region | is_mark).astype(np.float32)
