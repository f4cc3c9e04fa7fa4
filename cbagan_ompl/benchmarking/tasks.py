"""The choice of the maps and tasks that a benchmark runs on."""

from __future__ import annotations

import os
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from zlib import crc32

import numpy as np

from ..common.text import one_line
from ..common.validation import positive_number, whole_number
from ..errors import ConfigError, HeatmapError, TaskError
from ..maps.grid_map import GridMap
from ..maps.loading import BUNDLED, bundled_maps
from ..maps.tasks import Task, load_tasks, tasks_of
from ..planning.workspace import Workspace
from ..robots.robot import Robot
from ..sampling.heatmap import Heatmap

# Start and goal of a random task are at least this fraction of the map's longer side apart.
_LEAST_DISTANCE = 0.5
_RANDOM_TASKS = 4

#: Most tasks of a benchmark.
MAX_TASKS = 10_000

_LONGEST_NAME = 100  # of a map, in names of files
_MAX_TRIES = 1000


@dataclass(frozen=True)
class BenchmarkTask:
    """A task on its map.

    Attributes:
        workspace: the robot on the map.
        number: number of the task among those of its map, from 0.
        task: the task.
    """

    workspace: Workspace
    number: int
    task: Task

    @property
    def grid(self) -> GridMap:
        """The map of the robot's positions, which heat maps lie on."""
        return self.workspace.grid

    @property
    def map_name(self) -> str:
        """The map's name as part of a file's: letters, digits, ``_.-``, at most 100 characters."""
        return one_line(re.sub("[^A-Za-z0-9_.-]", "_", self.grid.name), _LONGEST_NAME)

    @property
    def name(self) -> str:
        """``MAP_NUMBER``: the name of logs and heat maps of the task."""
        return f"{self.map_name}_{self.number}"

    def why_impossible(self) -> str:
        """Return why the task cannot be planned for, nothing where it can."""
        try:
            self.workspace.check_task(self.task.start, self.task.goal)
        except TaskError as error:
            return str(error)
        return ""


@dataclass(frozen=True)
class Selection:
    """The tasks of a benchmark, and those that nobody could solve.

    Attributes:
        tasks: the tasks that can be planned for.
        left_out: why a task cannot be planned for, by its name.
    """

    tasks: list[BenchmarkTask]
    left_out: dict[str, str]


def select_tasks(
    maps: Sequence[str],
    tasks: str | None = None,
    tasks_per_map: int | None = None,
    robot: Robot | None = None,
    seed: int = 0,
    map_options: Mapping[str, Any] | None = None,
    least_distance: float | None = None,
) -> Selection:
    """Choose the tasks on some maps: those of a file, else those of the map, else random ones.

    Tasks that cannot be planned for, such as those with an end in an obstacle, are left out.

    Args:
        maps: map files, ``bundled:NAME``, or ``NAME=FILE``; all bundled maps for none. Files that
            share their name are called after their folders.
        tasks: a ``.csv`` or ``.scen`` file, see :func:`cbagan_ompl.load_tasks`.
        tasks_per_map: at most so many of each map, spread evenly over its list; the number of
            random ones for a map without tasks.
        robot: what moves, a point by default.
        seed: seed of random tasks.
        map_options: keyword arguments of :meth:`GridMap.load`.
        least_distance: from start to goal of random tasks, world units; half the longer side of
            the map by default.

    Raises:
        MapError: a map or task file that cannot be used.
        TaskError: no task can be planned for; the message says why for one of them.
        ConfigError: two maps of one name, or an option that makes no sense.
    """
    if tasks_per_map is not None:
        whole_number("tasks per map", tasks_per_map, 1, MAX_TASKS)
    if least_distance is not None:
        positive_number("least distance", least_distance)
    selected: list[BenchmarkTask] = []
    left_out: dict[str, str] = {}
    for name, path in name_maps(maps or [BUNDLED + name for name in bundled_maps()]):
        loaded = GridMap.load(path, name=name, **(map_options or {}))
        # By the name of the file: that of an inflated map says so.
        workspace = Workspace(loaded, robot or Robot.point())
        if tasks is None:
            given = tasks_of(path, loaded, with_yaw=workspace.robot.has_heading)
        else:
            given = load_tasks(tasks, loaded)
        if not given:
            given = random_tasks(workspace, tasks_per_map or _RANDOM_TASKS, seed, least_distance)
        numbered = [BenchmarkTask(workspace, number, task) for number, task in enumerate(given)]
        reasons = {task.name: reason for task in numbered if (reason := task.why_impossible())}
        possible = [task for task in numbered if task.name not in reasons]
        selected += [possible[i] for i in _spread(len(possible), tasks_per_map)]
        left_out |= reasons
    if not selected:
        name, reason = next(iter(left_out.items()))
        raise TaskError(f"none of {len(left_out)} tasks can be planned for; {name}: {reason}")
    _check_selected(selected)
    return Selection(selected, left_out)


def name_maps(words: Sequence[str]) -> list[tuple[str | None, str]]:
    """Return the name and the file of each map; None for one that is called after its file.

    Args:
        words: files, ``bundled:NAME``, or ``NAME=FILE``. Different files with one name are called
            after their folders.

    Example:
        >>> name_maps(["bundled:maze", "a/map.yaml", "b/map.yaml", "hall=c/map.yaml"])
        [(None, 'bundled:maze'), ('a', 'a/map.yaml'), ('b', 'b/map.yaml'), ('hall', 'c/map.yaml')]
    """
    named: list[tuple[str | None, str]] = []
    for word in words:
        name, equals, file = str(word).partition("=")
        given = bool(name and equals and file) and not os.path.exists(word)
        named.append((name, file) if given else (None, str(word)))
    unnamed = {file for name, file in named if name is None and not file.startswith(BUNDLED)}
    stems = Counter(Path(file).stem for file in unnamed)
    return [
        (Path(os.path.abspath(file)).parent.name or None, file)
        if name is None and file in unnamed and stems[Path(file).stem] > 1
        else (name, file)
        for name, file in named
    ]


def _check_selected(selected: Sequence[BenchmarkTask]) -> None:
    if len(selected) > MAX_TASKS:
        raise ConfigError(
            f"a benchmark has at most {MAX_TASKS} tasks, these are {len(selected)}; choose some "
            "of each map with --tasks-per-map"
        )
    name, count = Counter(task.name for task in selected).most_common(1)[0]
    if count > 1:
        raise ConfigError(
            f"maps must have different names, there are two {name} (characters other than letters, "
            "digits, '_', '.' and '-' count as '_'): name one, as NAME=FILE"
        )


def _spread(count: int, most: int | None) -> list[int]:
    """Return at most so many of the numbers below ``count``, spread evenly."""
    if most is None or most >= count:
        return list(range(count))
    numbers: list[int] = np.linspace(0, count - 1, most).round().astype(int).tolist()
    return numbers


def random_tasks(
    workspace: Workspace, count: int, seed: int, least_distance: float | None = None
) -> list[Task]:
    """Return tasks between random connected free pixels.

    The headings of robots that have one are uniform. The same map, robot and seed give the same
    tasks.

    Args:
        workspace: the robot on the map.
        count: number of tasks.
        seed: at least 0.
        least_distance: between start and goal, world units; half the longer side of the map by
            default.

    Raises:
        TaskError: the map has none or too few such pairs of pixels.
    """
    grid = workspace.grid
    name = grid.name.encode(errors="surrogateescape")
    rng = np.random.default_rng((seed, crc32(name), crc32(grid.cells)))
    rows, columns = np.nonzero(grid.free)
    points = grid.to_world(np.stack((columns, rows), -1) + 0.5)
    labels = grid.components[rows, columns]
    half = _LEAST_DISTANCE * max(grid.shape) * grid.resolution
    least = half if least_distance is None else least_distance
    tasks: list[Task] = []
    tries = 0
    while tries < _MAX_TRIES * _RANDOM_TASKS:  # since the last task that was found
        tries += 1
        i, j = rng.integers(len(points), size=2)
        if labels[i] == labels[j] and np.hypot(*(points[i] - points[j])) >= least:
            start, goal = (_with_heading(workspace, points[k].tolist(), rng) for k in (i, j))
            if start is not None and goal is not None:
                tasks.append(Task(start, goal))
                tries = 0
        if len(tasks) == count:
            return tasks
    raise TaskError(
        f"{grid.name}: found no {count} tasks of at least {least:g} between connected free "
        "pixels; give tasks of your own"
    )


def _with_heading(
    workspace: Workspace, point: list[float], rng: np.random.Generator
) -> tuple[float, ...] | None:
    """Return a position with a random heading where the robot has one; None where it collides."""
    if not workspace.robot.has_heading:
        return tuple(point)
    pose = *point, float(rng.uniform(-np.pi, np.pi))
    return pose if workspace.checker.pose_is_free(*pose) else None


def heatmap_path(folder: str, task: BenchmarkTask) -> Path:
    """Return the file of the heat map of a task: ``MAP_NUMBER.npy`` or ``MAP_NUMBER.png``.

    Args:
        folder: folder of the heat maps.
        task: the task.

    Raises:
        HeatmapError: there is none.
    """
    files = [Path(folder) / f"{task.name}{suffix}" for suffix in (".npy", ".png")]
    for file in files:
        if os.path.isfile(file):
            return file
    raise HeatmapError(f"no heat map of the task: neither {files[0]} nor {files[1].name}")


def heatmap_file(folder: str, task: BenchmarkTask) -> Heatmap:
    """Return the heat map of a task from a folder; arguments as for :func:`heatmap_path`.

    Raises:
        HeatmapError: there is none, or it does not fit the map of the task.
    """
    return Heatmap.load(heatmap_path(folder, task), task.grid)
