"""ROS map_server maps: a YAML file that says how to read the image beside it.

The rules are those of nav2's map_server. With p the darkness of a pixel, (255 - gray) / 255, or its
brightness where ``negate`` is set:

* ``trinary`` and ``scale``: occupied where p >= occupied_thresh, free where p <= free_thresh; what
  lies between is unknown in trinary mode and partly occupied in scale mode. Pixels that are not
  fully opaque are unknown.
* ``raw``: the gray level is the occupancy in percent, above 100 unknown; free and occupied by the
  same thresholds. ``negate`` and transparency have no meaning here.

A planner needs a yes or no, so only free pixels are free: unknown and partly occupied ones are
blocked, or free with ``unknown_is_free``.

Beware of the gray level 205, p = 0.196, that map savers write for unknown: it is unknown with
``free_thresh: 0.196``, but free with the 0.25 that nav2's own map saver writes. A warning says so
where a map has many such pixels.
"""

from __future__ import annotations

import warnings
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..common.files import read_bytes
from ..common.yaml_text import MAX_YAML_BYTES, parse_yaml
from ..errors import CbaganOmplWarning, MapError, show
from .image_files import MAX_IMAGE_BYTES, DecodedImage, decode_image
from .raw_map import RawMap

_REQUIRED = ("image", "resolution", "origin", "negate", "occupied_thresh", "free_thresh")
_MODES = ("trinary", "scale", "raw")

# What map savers write for unknown, of 255, and the fraction of the pixels that is worth a warning.
_UNKNOWN_GRAY, _MANY = 205, 0.01


class _Description:
    """The keys of a map_server YAML file, checked one by one."""

    def __init__(self, path: Path) -> None:
        self.path = path
        data = read_bytes(path, limit=MAX_YAML_BYTES)
        keys = parse_yaml(data, f"Failed to read {path}", MapError)
        if not isinstance(keys, dict):
            raise MapError(
                f"Failed to read {path}: a map_server file has the keys {', '.join(_REQUIRED)}; "
                "this one has no keys at all"
            )
        missing = [key for key in _REQUIRED if key not in keys]
        if missing:
            raise MapError(f"Failed to read {path}: missing keys: {', '.join(missing)}")
        self.keys: dict[Any, Any] = keys

    def error(self, key: str, reason: str) -> MapError:
        return MapError(
            f"Failed to read {self.path}, key '{key}' = {show(self.keys[key])}: {reason}"
        )

    def _number(self, key: str, value: object) -> float:
        # PyYAML takes 5e-2 for a string (YAML 1.1 wants 5.0e-2), the parser of ROS for a number.
        if isinstance(value, (int, float, str)) and not isinstance(value, bool):
            try:
                number = float(value)
            except (ValueError, OverflowError):
                number = float("nan")
            if isfinite(number):
                return number
        raise self.error(key, f"expected finite numbers, got {show(value)}")

    @property
    def resolution(self) -> float:
        resolution = self._number("resolution", self.keys["resolution"])
        if resolution <= 0:
            raise self.error("resolution", "the metres per pixel must be positive")
        return resolution

    @property
    def origin(self) -> tuple[float, float, float]:
        origin = self.keys["origin"]
        if not isinstance(origin, list) or len(origin) != 3:
            raise self.error("origin", "must be [x, y, yaw], the pose of the lower left corner")
        x, y, yaw = (self._number("origin", value) for value in origin)
        return x, y, yaw

    @property
    def thresholds(self) -> tuple[float, float]:
        """(free_thresh, occupied_thresh)."""
        low, high = (
            self._number(key, self.keys[key]) for key in ("free_thresh", "occupied_thresh")
        )
        for key, value in (("free_thresh", low), ("occupied_thresh", high)):
            if not 0 <= value <= 1:
                raise self.error(key, "a threshold is a fraction from 0 to 1")
        if low >= high:
            raise self.error("free_thresh", f"must be below occupied_thresh, which is {high:g}")
        return low, high

    @property
    def negate(self) -> bool:
        negate = self.keys["negate"]
        if not isinstance(negate, int) or negate not in (0, 1):  # True and False are ints as well
            raise self.error("negate", "must be 0, 1, false or true")
        return bool(negate)

    @property
    def mode(self) -> str:
        mode = self.keys.get("mode", "trinary")
        if not isinstance(mode, str) or mode.lower() not in _MODES:
            raise self.error("mode", f"choose one of {', '.join(_MODES)}")
        return mode.lower()

    @property
    def image_path(self) -> Path:
        """Of the image; the one in the file is relative to its folder."""
        file = self.keys["image"]
        if not isinstance(file, str) or not file:
            raise self.error("image", "must be the path of an image, relative to this file")
        try:
            return self.path.parent / Path(file).expanduser()
        except RuntimeError as error:
            raise self.error("image", f"the home of this user is not known: {error}") from error

    @property
    def image(self) -> DecodedImage:
        path = self.image_path
        try:
            return decode_image(read_bytes(path, limit=MAX_IMAGE_BYTES), str(path))
        except MapError as error:
            raise self.error("image", str(error)) from error


def image_of_ros_map(path: Path) -> Path:
    """Return the path of the image that a map_server YAML file names.

    Raises:
        MapError: the file cannot be read, or is no such file.
    """
    return _Description(path).image_path


def read_ros_map(path: Path, *, unknown_is_free: bool) -> RawMap:
    """Read a map_server YAML file and its image: metres, y up, with its origin and yaw.

    Args:
        path: the YAML file; the path of the image in it is relative to its folder.
        unknown_is_free: whether pixels that are neither free nor occupied count as free.

    Raises:
        MapError: a key is missing or makes no sense, or one of the two files cannot be read.
    """
    description = _Description(path)
    resolution, origin, mode = description.resolution, description.origin, description.mode
    (free_thresh, occupied_thresh), negate = description.thresholds, description.negate
    image = description.image
    white, opaque = image.white, image.opaque

    # Decided for each gray level first: that is quick, and leaves 0.2 equal to (255 - 204) / 255.
    levels = np.arange(white + 1)
    if mode == "raw":
        occupancy, opaque = np.rint(levels * (255 / white)) / 100, None
    else:
        occupancy = (levels if negate else white - levels) / white
    if unknown_is_free:
        level_is_free = (occupancy < occupied_thresh) | (occupancy > 1)
    else:
        level_is_free = occupancy <= free_thresh
    free = image.look_up(level_is_free)
    if mode != "raw" and not (negate or unknown_is_free):
        _warn_of_free_unknown(image, level_is_free, path, free_thresh)
    # What lies between the thresholds is partly occupied in scale mode, not unknown.
    between = (occupancy > free_thresh) & (occupancy < occupied_thresh) & (mode != "scale")
    unknown = image.look_up(between | (occupancy > 1))
    if opaque is not None:
        free = free | ~opaque if unknown_is_free else free & opaque
        unknown = unknown | ~opaque
    if not free.any():
        raise MapError(
            f"{path}: no pixel of the image is free with mode {mode}, negate {int(negate)} and "
            f"free_thresh {free_thresh:g}; if all are unknown, try unknown_is_free"
        )
    return RawMap(free, path.stem, resolution, origin, unknown if unknown.any() else None)


def _warn_of_free_unknown(
    image: DecodedImage, level_is_free: NDArray[np.bool_], path: Path, free_thresh: float
) -> None:
    level = _UNKNOWN_GRAY * image.white // 255
    fraction = float((image.gray == level).mean())
    if level_is_free[level] and fraction >= _MANY:
        warnings.warn(
            CbaganOmplWarning(
                f"{path}: {fraction:.0%} of the pixels have the gray level {_UNKNOWN_GRAY}, which "
                f"map savers write for unknown, and count as free with free_thresh {free_thresh:g},"
                " as in nav2: write free_thresh: 0.196 to block them, or say that unknown space is "
                "free"
            ),
            stacklevel=5,
        )
