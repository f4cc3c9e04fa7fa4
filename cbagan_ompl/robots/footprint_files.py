"""Footprints as users write them: a size, nav2's list of points, or a drawing."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from ..common.files import as_path, read_bytes
from ..common.yaml_text import MAX_YAML_BYTES, parse_yaml
from ..errors import RobotError, show
from ..maps.svg import read_svg_polygons
from .robot import Robot

_SIZE = re.compile(r"\s*([0-9.eE+-]+)\s*[xX×]\s*([0-9.eE+-]+)\s*")  # noqa: RUF001 - users type it


def parse_footprint(text: str, turning_radius: float | None = None, reverse: bool = False) -> Robot:
    """Return the robot of a footprint as the command line takes it.

    Args:
        text: ``LENGTHxWIDTH`` of a rectangle around the reference point, or the path of a file,
            see :func:`load_footprint`.
        turning_radius: as for :meth:`cbagan_ompl.Robot.rectangle`.
        reverse: as for :meth:`cbagan_ompl.Robot.rectangle`.

    Raises:
        RobotError: neither of them, or values that make no sense.

    Example:
        >>> parse_footprint("4.5x1.8") == Robot.rectangle(4.5, 1.8)
        True
    """
    match = _SIZE.fullmatch(text)
    if match:
        try:
            length, width = float(match[1]), float(match[2])
        except ValueError as error:
            raise RobotError(f"a footprint is LENGTHxWIDTH or a file, got {show(text)}") from error
        return Robot.rectangle(length, width, turning_radius, reverse)
    return load_footprint(text, turning_radius, reverse)


def load_footprint(
    path: str | os.PathLike[str], turning_radius: float | None = None, reverse: bool = False
) -> Robot:
    """Read the outline of a robot from a file.

    * ``.yaml``, ``.yml``: a list of points [x, y], by itself or under the key ``footprint``
      anywhere in the file; nav2's form, in which the list is a text, is read too.
    * ``.svg``: the one path of the drawing, convex, see :mod:`cbagan_ompl.maps.svg`; the reference
      point is the middle of its bounding box, and x points ahead.

    Args:
        path: the file.
        turning_radius: as for :meth:`cbagan_ompl.Robot.polygon`.
        reverse: as for :meth:`cbagan_ompl.Robot.polygon`.

    Raises:
        RobotError: the file cannot be read, is of another kind, or holds no footprint or several
            different ones.
    """
    file = as_path(path, RobotError)
    suffix = file.suffix.lower()
    if suffix in (".yaml", ".yml"):
        vertices = _read_yaml(file)
    elif suffix == ".svg":
        polygons = read_svg_polygons(file, RobotError)
        if len(polygons) != 1:
            raise RobotError(f"{file}: a robot is one path, this file has {len(polygons)}")
        low, high = polygons[0].min(axis=0), polygons[0].max(axis=0)
        vertices = (polygons[0] - (low + high) / 2).tolist()
    else:
        raise RobotError(
            f"a footprint is LENGTHxWIDTH, or a file .yaml, .yml or .svg; got {show(str(file))}"
        )
    try:
        return Robot.polygon(vertices, turning_radius, reverse)
    except RobotError as error:
        raise RobotError(f"{file}: {error}") from error


def _read_yaml(file: Path) -> Any:
    content = parse_yaml(read_bytes(file, RobotError, MAX_YAML_BYTES), str(file), RobotError)
    found = [content] if isinstance(content, list | str) else list(_footprints(content))
    # nav2 writes the list as a text in the YAML file.
    lists = [
        parse_yaml(value, f"{file}, footprint", RobotError) if isinstance(value, str) else value
        for value in found
    ]
    if not lists:
        raise RobotError(f"{file}: no footprint; write footprint: [[x, y], [x, y], ...]")
    if any(value != lists[0] for value in lists):
        raise RobotError(f"{file}: it has {len(lists)} footprints that differ; keep one of them")
    if not isinstance(lists[0], list):
        raise RobotError(f"{file}: a footprint is a list of points, got {show(lists[0])}")
    return _as_numbers(file, lists[0])


def _footprints(content: Any) -> Iterator[Any]:
    """Yield what stands under the key footprint, at any depth of mappings."""
    if isinstance(content, dict):
        for key, value in content.items():
            if key == "footprint":
                yield value
            else:
                yield from _footprints(value)


def _as_numbers(file: Path, points: list[Any]) -> Any:
    try:
        return np.array([[_as_number(value) for value in point] for point in points])
    except (TypeError, ValueError, OverflowError) as error:
        raise RobotError(f"{file}: a footprint is a list of points, got {show(points)}") from error


def _as_number(value: Any) -> float:
    # PyYAML takes 5e-2 for a text (YAML 1.1 wants 5.0e-2), ROS for a number.
    if isinstance(value, bool):
        raise TypeError
    return float(value)
