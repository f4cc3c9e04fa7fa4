"""Which maps and tasks a benchmark runs on."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from zlib import crc32

import numpy as np

from ..common.validation import check_at_least
from ..errors import ConfigError, HeatmapError, TaskError
from ..maps.grid_map import GridMap
from ..maps.loading import BUNDLED, bundled_maps
from ..maps.tasks import Task, load_tasks, tasks_of
from ..sampling.heatmap import Heatmap

# Random tasks are at least this share of the map's longer side apart, as the crow flies.
_LEAST_DISTANCE = 0.5
_RANDOM_TASKS = 4
_MAX_TRIES = 1000


@dataclass(frozen=True)
class BenchmarkTask:
    """A task on its map.

    Attributes:
        grid: the map, inflated by the robot's radius.
        number: of the task among those of its map, from 0.
        task: the task.
    """

    grid: GridMap
    number: int
    task: Task

    @property
    def name(self) -> str:
        """``MAP_NUMBER``: what logs and heat maps of the task are called."""
        return f"{re.sub(r'[^A-Za-z0-9_.-]', '_', self.grid.name)}_{self.number}"


def select_tasks(
    maps: Sequence[str],
    tasks: str | None = None,
    tasks_per_map: int | None = None,
    radius: float = 0.0,
    seed: int = 0,
    map_options: Mapping[str, Any] | None = None,
) -> list[BenchmarkTask]:
    """The tasks on some maps.

    They are those of a file, or else those that come with a map, or else random ones.

    Args:
        maps: map files, or ``bundled:NAME``; all bundled maps for none.
        tasks: a ``.csv`` or ``.scen`` file, see :func:`cbagan_ompl.load_tasks`.
        tasks_per_map: at most so many of each map, spread evenly over its list; the number of
            random ones for a map that comes with none.
        radius: of the robot, world units.
        seed: of random tasks.
        map_options: of :meth:`GridMap.load`.

    Raises:
        MapError: a map or task file that cannot be used.
        TaskError: a task that cannot be planned for.
        ConfigError: two maps of one name, or an option that makes no sense.
    """
    if tasks_per_map is not None:
        check_at_least("tasks per map", tasks_per_map, 1)
    selected = []
    for path in maps or [BUNDLED + name for name in bundled_maps()]:
        grid = GridMap.load(path, **(map_options or {})).inflated(radius)
        given = tasks_of(path, grid) if tasks is None else load_tasks(tasks, grid)
        if not given:
            given = random_tasks(grid, tasks_per_map or _RANDOM_TASKS, seed)
        for number in _spread(len(given), tasks_per_map):
            task = given[number]
            try:
                grid.check_task(task.start, task.goal)
            except TaskError as error:
                raise TaskError(f"task {number} of {grid.name}: {error}") from error
            selected.append(BenchmarkTask(grid, number, task))
    names = [task.name for task in selected]
    if len(set(names)) < len(names):
        twice = sorted({name for name in names if names.count(name) > 1})
        raise ConfigError(f"maps must have different names, there are two {twice[0]}")
    return selected


def _spread(count: int, most: int | None) -> list[int]:
    """At most so many of the numbers below ``count``, spread evenly."""
    if most is None or most >= count:
        return list(range(count))
    numbers: list[int] = np.linspace(0, count - 1, most).round().astype(int).tolist()
    return numbers


def random_tasks(grid: GridMap, count: int, seed: int) -> list[Task]:
    """Tasks between random free pixels of one connected part, at least half the map apart.

    The same map and seed give the same tasks.

    Raises:
        TaskError: the map has no such pair of pixels, or hardly one.
    """
    rng = np.random.default_rng((seed, crc32(grid.name.encode()), crc32(grid.cells)))
    rows, columns = np.nonzero(grid.free)
    points = grid.to_world(np.stack((columns, rows), -1) + 0.5)
    labels = grid.components[rows, columns]
    least = _LEAST_DISTANCE * max(grid.shape) * grid.resolution
    tasks: list[Task] = []
    for _ in range(_MAX_TRIES * count):
        i, j = rng.integers(len(points), size=2)
        if labels[i] == labels[j] and np.hypot(*(points[i] - points[j])) >= least:
            (x0, y0), (x1, y1) = points[i].tolist(), points[j].tolist()
            tasks.append(Task((x0, y0), (x1, y1)))
        if len(tasks) == count:
            return tasks
    raise TaskError(
        f"{grid.name}: found no {count} tasks of at least {least:g} between connected free "
        "pixels; give tasks of your own"
    )


def heatmap_file(folder: str, task: BenchmarkTask) -> Heatmap:
    """The heat map of a task in a folder of them: ``MAP_NUMBER.npy`` or an image of that name.

    Raises:
        HeatmapError: there is none, or one that does not belong to the task's map.
    """
    files = [Path(folder) / f"{task.name}{suffix}" for suffix in (".npy", ".png")]
    for file in files:
        if file.is_file():
            return Heatmap.load(file, task.grid)
    raise HeatmapError(f"no heat map of the task: neither {files[0]} nor {files[1].name}")
