"""What a map file says, before anything is derived from it, and how large it may be."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import MapError

#: Longest side and largest area of a map, in pixels. Larger files are an error before memory is
#: spent on them: a learned plan takes about 140 bytes a pixel.
MAX_SIDE = 16384
MAX_PIXELS = 2**26


@dataclass(frozen=True)
class RawMap:
    """The content of a map file, as its reader understands it.

    Attributes:
        free: (H, W), row 0 on top, true where the robot may be.
        name: of the map, from its file.
        resolution: world units per pixel.
        origin: pose (x, y, yaw) of the lower left corner for maps in the ROS frame; None for maps
            in the image frame, see :class:`cbagan_ompl.GridMap`.
        unknown: (H, W), true where the file says that nothing is known; None where no pixel is so.
    """

    free: NDArray[np.bool_]
    name: str
    resolution: float = 1.0
    origin: tuple[float, float, float] | None = None
    unknown: NDArray[np.bool_] | None = None


def check_map_size(width: int, height: int, name: str) -> None:
    """Raise if a map is too large to plan on.

    Args:
        width: columns, in pixels.
        height: rows, in pixels.
        name: what to call the map in the message.

    Raises:
        MapError: more than :data:`MAX_SIDE` pixels a side or :data:`MAX_PIXELS` in all.
    """
    if max(width, height) > MAX_SIDE or width * height > MAX_PIXELS:
        raise MapError(
            f"{name}: {width} x {height} pixels; maps up to {MAX_SIDE} pixels a side and "
            f"{MAX_PIXELS} pixels in all are supported, scale it down first"
        )
