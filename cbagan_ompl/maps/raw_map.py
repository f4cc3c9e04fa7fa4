"""What a map file says, before anything is derived from it, and how large it may be."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..common.validation import is_finite_number
from ..errors import CbaganOmplError, MapError, show
from .frames import Origin

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
    origin: Origin | None = None
    unknown: NDArray[np.bool_] | None = None


def check_map_size(
    width: int,
    height: int,
    name: str,
    error_class: type[CbaganOmplError] = MapError,
    longest: int = MAX_SIDE,
) -> None:
    """Raise if a map, or another image, is too large to work with.

    Args:
        width: columns, in pixels.
        height: rows, in pixels.
        name: what to call the map in the message.
        error_class: what to raise.
        longest: side in pixels that is allowed.

    Raises:
        CbaganOmplError: of that class; it has more pixels a side, or more than
            :data:`MAX_PIXELS` in all.
    """
    if max(width, height) > longest or width * height > MAX_PIXELS:
        raise error_class(
            f"{name}: {width} x {height} pixels; maps up to {longest} pixels a side and "
            f"{MAX_PIXELS} pixels in all are supported, scale it down first"
        )


def check_cells(free: ArrayLike, name: str) -> NDArray[np.bool_]:
    """Return the cells of a map as a new array of truth values.

    Args:
        free: shape (H, W), truth values, or 1 where free and 0 where blocked.
        name: what to call the map in the message.

    Raises:
        MapError: anything else, too many cells, or none that is free.
    """
    try:
        cells = np.asarray(free)
    except Exception as error:  # rows of different lengths, and whatever odd classes raise
        raise MapError(f"{name}: a map is a 2-D array (H, W): {error}") from error
    if cells.ndim != 2 or cells.size == 0:
        raise MapError(
            f"{name}: a map is a 2-D array (H, W) of at least one pixel, "
            f"this one has shape {cells.shape}"
        )
    check_map_size(cells.shape[1], cells.shape[0], name)
    if np.ma.is_masked(free):
        raise MapError(
            f"{name}: masked cells are neither free nor blocked: say which with .filled(False)"
        )
    if cells.dtype.kind not in "buif":
        raise MapError(f"{name}: a map holds booleans or numbers, not {cells.dtype}")
    if cells.dtype.kind == "f" and not np.isfinite(cells).all():
        raise MapError(f"{name}: the map holds NaN or infinite values")
    if cells.dtype.kind != "b" and ((cells != 0) & (cells != 1)).any():
        raise MapError(
            f"{name}: a map holds truth values, or 1 where free and 0 where blocked, these span "
            f"{cells.min():g} to {cells.max():g}; occupancy grids are read by "
            "GridMap.from_occupancy_grid, costmaps by GridMap.from_costmap, anything else is "
            "compared first, as in GridMap(image > 127)"
        )
    mask: NDArray[np.bool_] = np.ascontiguousarray(cells != 0)
    if not mask.any():
        raise MapError(f"{name}: every pixel is blocked, there is nowhere to plan")
    return mask


def check_name(name: str) -> str:
    """Return the name of a map.

    Raises:
        MapError: it is no text.
    """
    if not isinstance(name, str):
        raise MapError(f"the name of a map is a text, got {show(name)}")
    return name


def check_unknown(
    unknown: NDArray[np.bool_] | None, shape: tuple[int, int], name: str
) -> NDArray[np.bool_] | None:
    """Return the mask of unknown pixels.

    Raises:
        MapError: it is neither None nor a boolean array of the map's shape.
    """
    if unknown is not None and not (
        isinstance(unknown, np.ndarray) and unknown.shape == shape and unknown.dtype == np.bool_
    ):
        raise MapError(
            f"{name}: unknown is an array of booleans of shape {shape}, got {show(unknown)}"
        )
    return unknown


def check_resolution(resolution: float, name: str) -> float:
    """Return a resolution as a float.

    Raises:
        MapError: it is no positive length, or one whose inverse is infinite.
    """
    if not (is_finite_number(resolution) and resolution > 0 and isfinite(1 / float(resolution))):
        raise MapError(
            f"{name}: resolution is the length of a pixel in world units and must be "
            f"positive, got {show(resolution)}"
        )
    return float(resolution)


def check_origin(origin: Origin | None, name: str) -> Origin | None:
    """Return an origin as three floats, or None.

    Raises:
        MapError: it is neither None nor three finite numbers.
    """
    if origin is None:
        return None
    pose = origin.tolist() if isinstance(origin, np.ndarray) else origin
    if not (isinstance(pose, Sequence) and len(pose) == 3 and all(map(is_finite_number, pose))):
        raise MapError(f"{name}: origin is (x, y, yaw) with finite numbers, got {show(origin)}")
    return float(pose[0]), float(pose[1]), float(pose[2])
