"""The MovingAI benchmark files: ``.map`` (a grid in text) and ``.scen`` (start and goal pairs).

Format: https://movingai.com/benchmarks/formats.html
"""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..common.files import read_text
from ..errors import MapError, show
from .raw_map import MAX_PIXELS, MAX_SIDE, RawMap, check_map_size

# A map of the largest size, with its header, blanks and line ends.
_LONGEST_HEADER, _ROW_SLACK = 2**14, 80
_MAX_MAP_BYTES = MAX_PIXELS + MAX_SIDE * _ROW_SLACK + _LONGEST_HEADER

#: Largest file of tasks, in bytes, and most tasks in one.
MAX_TASK_BYTES, MAX_TASKS = 2**23, 100_000

_FREE = ".GS"
_BLOCKED = "@OTW"


def read_movingai_map(path: Path) -> RawMap:
    """Read a MovingAI ``.map``; one character becomes one pixel, in the image frame.

    Ground (``.`` and ``G``) and swamp (``S``) are free; out of bounds (``@`` and ``O``), trees
    (``T``) and water (``W``) are blocked. In the benchmark swamp can be entered from ground and
    water from water; a planner in continuous space knows no terrain, so swamp is taken for ground
    and water for an obstacle.

    Raises:
        MapError: the file cannot be read or is malformed; the message names the line.
    """
    text = read_text(path, limit=_MAX_MAP_BYTES)
    lines = text[:_LONGEST_HEADER].splitlines()
    header: dict[str, str] = {}
    for line in lines[:4]:
        key, _, value = line.strip().partition(" ")
        header[key] = value.strip()
        if key == "map":
            break
    if set(header) != {"type", "height", "width", "map"} or header["map"]:
        raise MapError(
            f"{path}: no MovingAI map; its first lines must be 'type octile', 'height N', "
            f"'width N' and 'map', they are {show([line[:40] for line in lines[:4]])}"
        )
    height, width = (_count(path, lines, key) for key in ("height", "width"))
    check_map_size(width, height, str(path))
    if len(text) > _LONGEST_HEADER + height * (width + _ROW_SLACK):
        raise MapError(
            f"{path}: {len(text)} characters are far more than those of {height} rows of {width}"
        )
    lines = text.splitlines()
    rows = [line.rstrip() for line in lines[4:]]
    while len(rows) > height and not rows[-1]:
        rows.pop()
    for number, row in enumerate(rows[:height], start=5):
        if len(row) != width:
            raise MapError(
                f"{path}, line {number}: a row of {len(row)} characters, the width is {width}"
            )
        unknown = set(row).difference(_FREE, _BLOCKED)
        if unknown:
            raise MapError(
                f"{path}, line {number}: unknown character {min(unknown)!r}; known are "
                f"{' '.join(_FREE)} (free) and {' '.join(_BLOCKED)} (blocked)"
            )
    if len(rows) != height:
        raise MapError(
            f"{path}, line {len(lines)}: the file has {len(rows)} rows, the height is {height}"
        )
    characters = np.frombuffer("".join(rows).encode("ascii"), dtype=np.uint8)
    free = np.isin(characters, np.frombuffer(_FREE.encode("ascii"), dtype=np.uint8))
    return RawMap(free.reshape(height, width), path.stem)


def _count(path: Path, lines: list[str], key: str) -> int:
    """Return the positive number of the header line that begins with ``key``."""
    for number, line in enumerate(lines[:4], start=1):
        words = line.split()
        if words[:1] == [key]:
            # At most nine digits: int() takes long for very many.
            if len(words) == 2 and words[1].isdecimal() and len(words[1]) < 10 and int(words[1]):
                return int(words[1])
            raise MapError(
                f"{path}, line {number}: {key} must be a positive whole number of pixels, "
                f"got {line.strip()[:40]!r}"
            )
    raise AssertionError(key)


class Scenario(NamedTuple):
    """One line of a ``.scen`` file: sizes and cells in pixels of the map that it was made for."""

    width: int
    height: int
    start: tuple[int, int]
    goal: tuple[int, int]


def read_scenarios(path: Path) -> list[Scenario]:
    """Read a MovingAI ``.scen`` file, cells as (column, row).

    The ninth field, the optimal length, is checked to be a number and left out: see
    :func:`cbagan_ompl.load_tasks`.

    Raises:
        MapError: the file cannot be read, is no version 1 scenario file, or has a malformed line
            (named in the message) or none at all.
    """
    lines = read_text(path, limit=MAX_TASK_BYTES).splitlines()
    if not lines or lines[0].split() not in (["version", "1"], ["version", "1.0"]):
        raise MapError(
            f"{path}, line 1: a scenario file begins with 'version 1', "
            f"this one with {(lines or [''])[0][:40]!r}"
        )
    if len(lines) > MAX_TASKS:
        raise MapError(f"{path}: {len(lines)} lines, at most {MAX_TASKS} are read")
    scenarios = [
        _scenario(f"{path}, line {number}", line)
        for number, line in enumerate(lines[1:], start=2)
        if line.strip()
    ]
    if not scenarios:
        raise MapError(f"{path}: no scenario follows the first line")
    return scenarios


def _scenario(location: str, line: str) -> Scenario:
    fields = line.split("\t") if "\t" in line else line.split()
    if len(fields) != 9:
        raise MapError(
            f"{location}: expected 9 fields (bucket, map, width, height, start x, start y, goal x, "
            f"goal y, optimal length), found {len(fields)}"
        )
    try:
        width, height, start_x, start_y, goal_x, goal_y = (int(field) for field in fields[2:8])
        float(fields[8])
    except ValueError as error:
        raise MapError(f"{location}: not a number: {str(error)[:200]}") from error
    if width < 1 or height < 1:
        raise MapError(f"{location}: the map size {width} x {height} must be positive")
    check_map_size(width, height, location)
    for role, x, y in (("start", start_x, start_y), ("goal", goal_x, goal_y)):
        if not (0 <= x < width and 0 <= y < height):
            raise MapError(f"{location}: {role} ({x}, {y}) is outside a map of {width} x {height}")
    return Scenario(width, height, (start_x, start_y), (goal_x, goal_y))
