"""Maps of convex polygons in SVG files, as Inkscape writes them.

Read are paths of straight lines (commands ``m``, ``l``, ``h``, ``v`` and ``z``, relative and
absolute) in groups with ``transform="translate(x,y)"``. World coordinates are those of the drawing
with y negated, so y points up, as in the files of the suite Bench-MR
(https://github.com/robot-motion/bench-mr). Anything else that draws is an error, so that no
obstacle is left out.
"""

from __future__ import annotations

import re
from itertools import pairwise
from math import ceil, floor
from pathlib import Path
from typing import Any
from xml.parsers import expat

import cv2
import numpy as np
from numpy.typing import NDArray

from ..common.files import read_bytes
from ..errors import CbaganOmplError, MapError, show
from .raw_map import RawMap, check_map_size

Points = NDArray[np.float64]

#: Largest SVG file, in bytes, and most points of its paths in all.
MAX_SVG_BYTES = 2**22
MAX_POINTS = 100_000

# Most rows of pixels that polygons lie in, over all polygons: about a second.
_MAX_ROWS = 10_000_000

_SVG = "http://www.w3.org/2000/svg"
# Elements that hold no drawing of their own, or none that is shown.
_IGNORED = frozenset({"defs", "metadata", "title", "desc", "style", "symbol", "marker", "clipPath"})
_CONTAINERS = frozenset({"svg", "g"})

# The convex hull stands for a path; it may be larger by this fraction, for rounded corners.
_HULL_EXCESS = 0.05

# Each text fits them in one way only: what does not fit costs no time to take back.
_NUMBER = r"[-+]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][-+]?\d+)?"
_TOKEN = re.compile(rf"\s*(?:,\s*)?([A-Za-z]|{_NUMBER})")
_TRANSLATE = re.compile(rf"\s*translate\(\s*({_NUMBER})(?:[\s,]+({_NUMBER}))?\s*\)\s*")

# Slack for rounding, in pixels: a pixel that a polygon touches is blocked.
_ROUNDING = 1e-9


def read_svg_map(path: Path, *, resolution: float, margin: float) -> RawMap:
    """Read a map whose obstacles are the convex polygons of an SVG file.

    Every pixel that a polygon touches is blocked: obstacles grow by up to a pixel, and no gap is
    wider than in the drawing.

    Args:
        path: the file.
        resolution: world units per pixel.
        margin: free space around the polygons, world units.

    Raises:
        MapError: the file cannot be read, holds something else than such paths, or makes a map
            that is too large or all blocked.
    """
    polygons = read_svg_polygons(path, MapError)
    corners = np.concatenate(polygons)
    low, high = corners.min(axis=0) - margin, corners.max(axis=0) + margin
    size = np.ceil((high - low) / resolution - _ROUNDING)
    if not (size < 2**31).all():
        raise MapError(f"{path}: the resolution {resolution:g} is too fine for this drawing")
    width, height = (max(int(side), 1) for side in size)
    check_map_size(width, height, str(path))
    if sum(np.ptp(polygon[:, 1]) for polygon in polygons) / resolution > _MAX_ROWS:
        raise MapError(
            f"{path}: the {len(polygons)} polygons lie in more than {_MAX_ROWS} rows of pixels in "
            f"all; the resolution {resolution:g} is too fine for them"
        )
    # By how much each pixel lies in more polygons than the one before it in its row.
    changes = np.zeros((height, width + 1), np.uint16)
    for polygon in polygons:
        # Row 0 is on top.
        _cover(changes, ((polygon - low) / resolution - (0, height)) * (1, -1))
    free = np.empty((height, width), np.bool_)
    for row in range(height):
        free[row] = np.cumsum(changes[row, :-1], dtype=np.uint16) == 0
    if not free.any():
        raise MapError(f"{path}: the polygons leave no pixel free; try a margin around them")
    return RawMap(free, path.stem, resolution, (float(low[0]), float(low[1]), 0.0))


def read_svg_polygons(path: Path, error_class: type[CbaganOmplError]) -> list[Points]:
    """Return the convex polygons of an SVG file, (N, 2) each, world, y up.

    Args:
        path: the file.
        error_class: what to raise.

    Raises:
        CbaganOmplError: of that class; the file cannot be read, is no SVG, has entities or a
            document type, paths with curves or that are not convex, or no path.
    """
    data = read_bytes(path, error_class, MAX_SVG_BYTES)
    drawing = _Drawing(path, error_class)
    parser = expat.ParserCreate(namespace_separator=" ")
    # Entities can stand for gigabytes, or for other files; these files need none.
    parser.StartDoctypeDeclHandler = drawing.refuse_doctype
    parser.StartElementHandler = drawing.start
    parser.EndElementHandler = drawing.end
    try:
        parser.Parse(data, True)
    except CbaganOmplError:
        raise
    except Exception as error:  # also whatever Python raises for odd encodings
        raise error_class(f"{path}: no valid XML: {error}") from error
    if not drawing.polygons:
        raise error_class(f"{path}: there is no path in this SVG file")
    return drawing.polygons


class _Drawing:
    """What a parser finds in an SVG file."""

    def __init__(self, path: Path, error_class: type[CbaganOmplError]) -> None:
        self.polygons: list[Points] = []
        self._path, self._error_class = path, error_class
        self._offsets = [np.zeros(2)]
        self._ignored = self._points = 0

    def error(self, reason: str) -> CbaganOmplError:
        return self._error_class(f"{self._path}: {reason}")

    def refuse_doctype(self, *_: Any) -> None:
        raise self.error("files with a document type or entities are not read; remove <!DOCTYPE>")

    def start(self, name: str, attributes: dict[str, str]) -> None:
        namespace, _, tag = name.rpartition(" ")
        if self._ignored or namespace not in ("", _SVG) or tag in _IGNORED:
            self._ignored += 1
            return
        if tag not in _CONTAINERS and tag != "path":
            raise self.error(
                f"<{tag}> is not read, only paths of straight lines; convert it to a path first"
            )
        offset = self._offsets[-1] + self._translation(attributes.get("transform", ""))
        self._offsets.append(offset)
        if tag == "path":
            self._add(attributes.get("d", ""), str(attributes.get("id", "?")), offset)

    def end(self, _: str) -> None:
        if self._ignored:
            self._ignored -= 1
        else:
            self._offsets.pop()

    def _translation(self, transform: str) -> Points:
        if not transform.strip():
            return np.zeros(2)
        match = _TRANSLATE.fullmatch(transform)
        if not match:
            raise self.error(f"of transforms only translate(x,y) is read, not {show(transform)}")
        return np.array([float(match[1]), float(match[2] or 0.0)])

    def _add(self, description: str, name: str, offset: Points) -> None:
        try:
            points = _path_points(description)
        except ValueError as error:
            raise self.error(f"path {show(name)}: {error}") from error
        self._points += len(points)
        if self._points > MAX_POINTS:
            raise self.error(f"more than {MAX_POINTS} points")
        world = (np.array(points) + offset) * (1, -1)
        if not np.isfinite(world).all() or np.abs(world).max() > 1e9:
            raise self.error(f"path {show(name)} has coordinates that are no lengths")
        hull = _convex_hull(world)
        area = _area(hull)
        if not area > 0:
            raise self.error(f"path {show(name)} has no area")
        if area > (1 + _HULL_EXCESS) * _area(world):
            raise self.error(
                f"path {show(name)} is not convex; cut it into convex ones (in Inkscape: "
                "Path, Division)"
            )
        self.polygons.append(hull)


def _path_points(description: str) -> list[tuple[float, float]]:
    """Return the points of a path of straight lines.

    Raises:
        ValueError: another command, a second subpath, or numbers where none belong.
    """
    points: list[tuple[float, float]] = []
    x = y = 0.0
    for command, numbers in _path_commands(description):
        if command not in "mMlLhHvVzZ":
            raise ValueError(f"the command {command} is a curve; only straight lines are read")
        if command in "mM" and points:
            raise ValueError("it has several parts; break it apart")
        axes = {"h": 1, "v": 1, "z": 0}.get(command.lower(), 2)
        if len(numbers) % axes if axes else numbers:
            raise ValueError(f"the command {command} has {len(numbers)} numbers")
        for index in range(0, len(numbers), axes or 1):
            first, last = numbers[index], numbers[index + axes - 1]
            base_x, base_y = (x, y) if command.islower() else (0.0, 0.0)
            x = x if command in "vV" else base_x + first
            y = y if command in "hH" else base_y + last
            points.append((x, y))
    return points


def _path_commands(description: str) -> list[tuple[str, list[float]]]:
    """Return the commands of a path, each with the numbers that follow it."""
    text = description.strip()
    commands: list[tuple[str, list[float]]] = []
    position = 0
    while match := _TOKEN.match(text, position):
        position = match.end()
        if match[1].isalpha():
            commands.append((match[1], []))
        elif commands:
            commands[-1][1].append(float(match[1]))
        else:
            break
    if position != len(text) or not commands or commands[0][0] not in "mM":
        raise ValueError(f"no path data of moves and lines: {show(description)}")
    return commands


def _convex_hull(points: Points) -> Points:
    # OpenCV computes in single precision: of indices alone, near the origin and not too small.
    near = points - points.mean(axis=0)
    indices = cv2.convexHull(
        (near / (np.abs(near).max() or 1.0)).astype(np.float32), returnPoints=False
    )
    return np.asarray(points[indices.ravel()])


def _area(points: Points) -> float:
    x, y = (points - points[0]).T  # the first one is (0, 0), and so is its product with the last
    return abs(float(x[:-1] @ y[1:] - x[1:] @ y[:-1])) / 2


def _cover(changes: NDArray[np.uint16], polygon: Points) -> None:
    """Count the pixels that a convex polygon touches.

    Args:
        changes: (H, W + 1), how many polygons more than in the column before touch a pixel.
        polygon: (N, 2), pixels.
    """
    height, width = changes.shape[0], changes.shape[1] - 1
    first = max(int(np.floor(polygon[:, 1].min() - _ROUNDING)), 0)
    last = min(int(np.floor(polygon[:, 1].max() + _ROUNDING)), height - 1)
    left = np.full(last - first + 1, np.inf)
    right = -left
    for (u0, v0), (u1, v1) in pairwise([*polygon.tolist(), polygon[0].tolist()]):
        low, high = sorted((v0, v1))
        begin = max(ceil(low - 1 - _ROUNDING), first)
        end = min(floor(high + _ROUNDING), last) + 1
        rows = np.arange(begin, end)
        crossed = slice(begin - first, end - first)
        slope = (u1 - u0) / (v1 - v0) if v1 != v0 else 0.0
        columns = [
            u0 + (np.maximum(low, rows - _ROUNDING) - v0) * slope,
            u0 + (np.minimum(high, rows + 1 + _ROUNDING) - v0) * slope,
            *([u1] if v1 == v0 else []),
        ]
        for column in columns:
            left[crossed] = np.minimum(left[crossed], column)
            right[crossed] = np.maximum(right[crossed], column)
    begins = np.maximum(np.floor(left - _ROUNDING), 0).astype(np.intp)
    ends = np.minimum(np.floor(right + _ROUNDING), width - 1).astype(np.intp) + 1
    rows = np.arange(first, last + 1)
    changes[rows, begins] += np.uint16(1)
    changes[rows, ends] -= np.uint16(1)
