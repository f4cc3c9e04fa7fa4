"""Planning tasks: start and goal pairs from files, and those that come with a map."""

from __future__ import annotations

import csv
import os
from dataclasses import dataclass
from importlib import resources
from math import isfinite
from pathlib import Path, PureWindowsPath

from ..common.files import as_path, read_text
from ..errors import MapError, show
from .checks import check_grid
from .grid_map import GridMap
from .loading import BUNDLED, bundled_folder
from .movingai import MAX_TASK_BYTES, MAX_TASKS, read_scenarios

_COLUMNS = ("map", "start_x", "start_y", "goal_x", "goal_y")
_YAWS = ("start_yaw", "goal_yaw")


@dataclass(frozen=True)
class Task:
    """Where to plan from and to.

    Attributes:
        start: (x, y) in the map's world coordinates, or (x, y, yaw) with a yaw in radians.
        goal: the same; both have a yaw or none has.
        optimal_cost: length of the shortest path in world units, where it is known.
        family: the kind of map that it is on, where that is known.

    Example:
        >>> Task((1.5, 2.0), (14.0, -3.0)).optimal_cost is None
        True
    """

    start: tuple[float, ...]
    goal: tuple[float, ...]
    optimal_cost: float | None = None
    family: str | None = None


def load_tasks(path: str | os.PathLike[str], grid: GridMap) -> list[Task]:
    r"""Read the tasks for a map from a MovingAI ``.scen`` or a ``.csv`` file.

    A ``.scen`` file belongs to one map, whose name is not compared. Its cells become the centres
    of pixels, scaled when the file was made for another size of the map in the same
    proportions. ``optimal_cost`` stays
    empty: the length in the file is that of the best path along the eight directions of the grid,
    and a path in any direction may be shorter.

    A ``.csv`` file has the columns ``map, start_x, start_y, goal_x, goal_y`` in any order,
    optionally ``start_yaw`` and ``goal_yaw`` (radians, for robots with heading),
    ``optimal_cost`` and ``family``, and any others, which are not read. ``map`` is the
    file or the name of a map; rows of other maps than ``grid`` are left out. Coordinates are world
    ones.

    Whether the tasks can be planned for is not checked here, :meth:`GridMap.check_task` does that.

    Args:
        path: the file, its kind is recognised by its suffix.
        grid: the map to plan on.

    Raises:
        MapError: the file cannot be read, is malformed (the message names the line), or has no
            task for this map.

    Example:
        >>> import tempfile
        >>> from cbagan_ompl import GridMap
        >>> with tempfile.NamedTemporaryFile("w", suffix=".csv") as file:
        ...     _ = file.write("map,start_x,start_y,goal_x,goal_y\nhall,1,2,3,4\n")
        ...     file.flush()
        ...     tasks = load_tasks(file.name, GridMap([[1, 1], [1, 1]], name="hall"))
        >>> tasks[0].goal
        (3.0, 4.0)
    """
    check_grid(grid)
    file = as_path(path, MapError)
    suffix = file.suffix.lower()
    if suffix == ".scen":
        return _scen_tasks(file, grid)
    if suffix == ".csv":
        return _csv_tasks(file, grid)
    raise MapError(f"{file}: unknown kind of task file; known are .scen and .csv")


def tasks_of(path: str | os.PathLike[str], grid: GridMap, *, with_yaw: bool = False) -> list[Task]:
    """Return the tasks that come with a map.

    These are those of the package for ``bundled:NAME``, and those in ``NAME.map.scen`` or
    ``NAME.scen`` beside a MovingAI map ``NAME.map``.

    Args:
        path: what the map was loaded from.
        grid: the map.
        with_yaw: return tasks for robots with heading. Those of the bundled maps are for a car of
            8 x 4 pixels that drives backwards too, with a turning radius of 6 pixels.

    Returns:
        The tasks, none for other maps.

    Raises:
        MapError: the task file is malformed.

    Example:
        >>> from cbagan_ompl import GridMap
        >>> len(tasks_of("bundled:maze", GridMap.load("bundled:maze")))
        4
    """
    check_grid(grid)
    file = as_path(path, MapError)
    if str(path).startswith(BUNDLED):
        name = "car_tasks.csv" if with_yaw else "tasks.csv"
        with resources.as_file(bundled_folder() / name) as tasks:
            return load_tasks(tasks, grid)
    if with_yaw:
        return []
    files = task_files(file)
    return load_tasks(files[0], grid) if files else []


def task_files(path: str | os.PathLike[str]) -> list[Path]:
    """Return the file of the tasks that lies beside a MovingAI map, in a list; none for others.

    Args:
        path: of the map.
    """
    file = Path(path)
    if file.suffix.lower() == ".map":
        for beside in (Path(f"{file}.scen"), file.with_suffix(".scen")):
            if os.path.isfile(beside):  # False also where the name is too long to be one
                return [beside]
    return []


def _scen_tasks(path: Path, grid: GridMap) -> list[Task]:
    tasks = []
    for scenario in read_scenarios(path):
        # A scaled map may be a pixel off in one of its sides, where the other one is scaled.
        skew = grid.width * scenario.height - grid.height * scenario.width
        is_scaled = grid.width != scenario.width and grid.height != scenario.height
        if abs(skew) > max(scenario.width, scenario.height) * is_scaled:
            raise MapError(
                f"{path}: made for a map of {scenario.width} x {scenario.height} cells, "
                f"{grid.name} has {grid.width} x {grid.height} pixels: sizes in other proportions, "
                "so this is another map, or width and height are exchanged"
            )
        # In whole numbers: the pixel that the centre of the scaled cell lies in.
        pixels = [
            (
                (2 * x + 1) * grid.width // (2 * scenario.width) + 0.5,
                (2 * y + 1) * grid.height // (2 * scenario.height) + 0.5,
            )
            for x, y in (scenario.start, scenario.goal)
        ]
        (start_x, start_y), (goal_x, goal_y) = grid.to_world(pixels).tolist()
        tasks.append(Task((start_x, start_y), (goal_x, goal_y)))
    return tasks


def _csv_tasks(path: Path, grid: GridMap) -> list[Task]:
    tasks, others = [], set()
    lines = read_text(path, limit=MAX_TASK_BYTES).splitlines()
    if len(lines) > MAX_TASKS:
        raise MapError(f"{path}: {len(lines)} lines, at most {MAX_TASKS} are read")
    reader = csv.DictReader(lines, skipinitialspace=True)
    try:
        missing = [name for name in _COLUMNS if name not in (reader.fieldnames or ())]
        if missing:
            raise MapError(f"{path}, line 1: missing columns: {', '.join(missing)}")
        for row in reader:
            location = f"{path}, line {reader.line_num}"
            if None in row or None in row.values():
                raise MapError(f"{location}: expected {len(reader.fieldnames or ())} fields")
            # The folders of either system are left out.
            if grid.name in (row["map"], PureWindowsPath(row["map"]).stem):
                tasks.append(_csv_task(location, row))
            else:
                others.add(row["map"])
    except csv.Error as error:
        # The line that cannot be split is not counted yet.
        raise MapError(f"{path}, line {reader.line_num + 1}: {error}") from error
    if not tasks:
        raise MapError(
            f"{path}: no task for the map {grid.name!r}, only for "
            f"{', '.join(sorted(others)) or 'none'}"
        )
    return tasks


def _csv_task(location: str, row: dict[str, str]) -> Task:
    start_x, start_y, goal_x, goal_y = (_number(location, row, name) for name in _COLUMNS[1:])
    given = [name for name in _YAWS if row.get(name, "").strip()]
    if len(given) == 1:
        raise MapError(f"{location}: {' and '.join(_YAWS)} come together, only {given[0]} is given")
    yaws = [_number(location, row, name) for name in given]
    cost = _number(location, row, "optimal_cost") if row.get("optimal_cost", "").strip() else None
    if cost is not None and cost < 0:
        raise MapError(f"{location}: optimal_cost is a length and cannot be {cost:g}")
    start, goal = (start_x, start_y, *yaws[:1]), (goal_x, goal_y, *yaws[1:])
    return Task(start, goal, cost, row.get("family") or None)


def _number(location: str, row: dict[str, str], column: str) -> float:
    try:
        number = float(row[column])
    except ValueError:
        number = float("nan")
    if not isfinite(number):
        raise MapError(f"{location}: {column} must be a finite number, got {show(row[column])}")
    return number
