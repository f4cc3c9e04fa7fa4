"""Map files of every kind, recognised by their suffix, and the maps that come with the package.

Each reader returns a :class:`.raw_map.RawMap`, of which :meth:`cbagan_ompl.GridMap.load` makes the
map.
"""

from __future__ import annotations

import os
from contextlib import suppress
from dataclasses import dataclass, fields
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..common.files import as_path, read_bytes
from ..common.validation import finite_number, positive_number
from ..errors import ConfigError, MapError, show
from .image_files import MAX_IMAGE_BYTES, SUFFIXES, decode_image
from .movingai import read_movingai_map
from .raw_map import RawMap
from .ros import image_of_ros_map, read_ros_map
from .svg import read_svg_map

if TYPE_CHECKING:
    from importlib.resources.abc import Traversable

#: What a path to a map that comes with the package begins with.
BUNDLED = "bundled:"

_YAML_SUFFIXES = (".yaml", ".yml")


@dataclass(frozen=True)
class MapOptions:
    """How map files are read.

    Attributes:
        threshold: plain images only: a pixel is free when its gray level divided by white (255
            for 8 bits) is at least this, 0 to 1. With 0.5 the level 127 is blocked and 128 free.
            ROS maps bring their own thresholds, MovingAI maps need none.
        unknown_is_free: whether pixels of unknown state are free. Unknown are the transparent
            pixels of an image (any alpha below full), and in a ROS map also those that are
            neither free nor occupied, see :mod:`cbagan_ompl.maps.ros`.
        resolution: SVG maps only: world units per pixel.
        margin: SVG maps only: free space around the polygons, world units.

    Raises:
        ConfigError: a value of the wrong type or out of range.
    """

    threshold: float = 0.5
    unknown_is_free: bool = False
    resolution: float = 0.1
    margin: float = 0.0

    def __post_init__(self) -> None:
        number = isinstance(self.threshold, (int, float)) and not isinstance(self.threshold, bool)
        if not number or not 0 <= self.threshold <= 1:
            raise ConfigError(f"threshold must be a number from 0 to 1, got {show(self.threshold)}")
        if not isinstance(self.unknown_is_free, bool):
            raise ConfigError(f"unknown_is_free is True or False, got {show(self.unknown_is_free)}")
        positive_number("resolution", self.resolution)
        finite_number("margin", self.margin, 0.0)


def read_map(path: str | os.PathLike[str], **options: Any) -> RawMap:
    """Read a map file; :meth:`cbagan_ompl.GridMap.load` is the public way to it.

    Args:
        path: the file, or ``bundled:NAME``. The map is called after the file, without suffix.
        **options: the fields of :class:`MapOptions`.

    Raises:
        MapError: the file is missing, unreadable, truncated, empty or of an unknown kind.
        ConfigError: an unknown option, or one with a value that makes no sense.
    """
    known = [field.name for field in fields(MapOptions)]
    for option in options:
        if option not in known:
            raise ConfigError(f"unknown map option {show(option)}; known are {', '.join(known)}")
    settings = MapOptions(**options)
    file = as_path(path, MapError)
    if str(path).startswith(BUNDLED):
        return _read_bundled(str(path).removeprefix(BUNDLED), settings)

    suffix = file.suffix.lower()
    if suffix in SUFFIXES:
        return _read_image_map(
            read_bytes(file, limit=MAX_IMAGE_BYTES), str(file), file.stem, settings
        )
    if suffix in _YAML_SUFFIXES:
        return read_ros_map(file, unknown_is_free=settings.unknown_is_free)
    if suffix == ".map":
        return read_movingai_map(file)
    if suffix == ".svg":
        return read_svg_map(file, resolution=settings.resolution, margin=settings.margin)
    raise MapError(
        f"{file}: unknown kind of map file; known are {', '.join(SUFFIXES)} (images), .yaml and "
        f".yml (ROS map_server), .map (MovingAI), .svg (convex polygons) and {BUNDLED}NAME"
    )


def map_files(path: str | os.PathLike[str]) -> list[Path]:
    """Return the files that a map is read from: the one that is given, and what it names.

    Args:
        path: a file for :func:`read_map`; none for ``bundled:NAME``.

    Example:
        >>> map_files("bundled:maze"), [file.name for file in map_files("maps/hall.png")]
        ([], ['hall.png'])
    """
    if str(path).startswith(BUNDLED):
        return []
    file = Path(path)
    if file.suffix.lower() in _YAML_SUFFIXES:
        with suppress(MapError):  # raised again when it is read
            return [file, image_of_ros_map(file)]
    return [file]


def bundled_maps() -> tuple[str, ...]:
    """Return the names of the maps that come with the package.

    ``GridMap.load("bundled:NAME")`` loads one of them.

    Example:
        >>> "maze" in bundled_maps()
        True
    """
    names = (Path(entry.name) for entry in bundled_folder().iterdir())
    return tuple(sorted(name.stem for name in names if name.suffix == ".png"))


def bundled_folder() -> Traversable:
    """Return the folder of the maps that come with the package and of their ``tasks.csv``."""
    return resources.files("cbagan_ompl") / "maps" / "bundled"


def _read_bundled(name: str, settings: MapOptions) -> RawMap:
    if name not in bundled_maps():
        raise MapError(f"no map {show(name)} is bundled; there are {', '.join(bundled_maps())}")
    data = (bundled_folder() / f"{name}.png").read_bytes()
    return _read_image_map(data, BUNDLED + name, name, settings)


def _read_image_map(data: bytes, location: str, name: str, settings: MapOptions) -> RawMap:
    image = decode_image(data, location)
    white, opaque = image.white, image.opaque
    free = image.look_up(np.arange(white + 1) / white >= settings.threshold)
    if opaque is not None:
        free = free | ~opaque if settings.unknown_is_free else free & opaque
    if not free.any():
        raise MapError(
            f"{location}: no pixel is opaque and as bright as the threshold {settings.threshold:g};"
            " choose a lower threshold, or unknown_is_free where free space is transparent"
        )
    return RawMap(free, name, unknown=None if opaque is None else ~opaque)
