"""New training sets: random maps, tasks on them, and labels by runs of RRT or exact ones.

A map, its tasks and their labels depend on the seed and the number of the map alone. So a set is
the same whatever the number of processes and of interruptions, with one version of OMPL.
"""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..common.files import make_folder, read_text, write_json
from ..common.parallel import Executor, LocalExecutor, run_each
from ..common.validation import (
    check_fraction,
    finite_number,
    positive_number,
    whole_number,
)
from ..errors import ConfigError, DatasetError, show
from ..map_generators import MAP_GENERATORS, MIN_SIZE, check_generators
from ..map_generators.randomization import randomized_map
from ..maps.grid_map import GridMap
from ..sampling.heatmap import REGION_THRESHOLD
from ..sampling.pixels import pixel_pair
from .augmentation import augment
from .dataset import MAX_SIZE, Tasks, check_pixels
from .geodesic_labels import geodesic_label
from .splits import select_test_tasks
from .synthetic import HARD_DETOUR
from .tables import MAX_LINES
from .writing import check_new_folder, task_row, write_lists, write_map, write_tasks

#: File in the folder of a generated set that records its settings.
RECORD = "dataset.json"

#: Kinds of labels.
LABELS = ("rrt", "geodesic")
#: Runs of RRT for a label; the value of the CBAGAN-RRT paper.
RUNS = 50
#: Limit of each run in iterations; the value of the paper.
ITERATIONS = 5000
#: Longest edge of RRT as a fraction of the map's size, one pixel at 64. Of the lengths tried (1/128
#: to 12/64) the short ones give labels like the published ones; half of it is twice as slow.
RANGE = 1 / 64

# Largest record in bytes.
_MAX_RECORD = 2**20

# Attempts to find a task on a map, and those of them that look for a hard one.
_MAX_ATTEMPTS, _MAX_HARD_ATTEMPTS = 1000, 100


@dataclass(frozen=True)
class GenerationSettings:
    """Settings of a generated set.

    Attributes:
        maps: number of maps.
        tasks: number of tasks on each map.
        size: width and height of the maps in pixels.
        generators: keys of :data:`cbagan_ompl.map_generators.MAP_GENERATORS`, taken in turn.
        varied: change each original map at random, see
            :mod:`cbagan_ompl.map_generators.randomization`.
        copies: maps from each original; the first is the original itself, the others are
            augmented (10 in the CBAGAN-RRT paper).
        label: ``rrt``, the union of the paths of many runs, as in the paper; or ``geodesic``, the
            region of :func:`cbagan_ompl.datasets.geodesic_labels.geodesic_label`.
        hard_fraction: fraction of tasks whose shortest path is at least
            :data:`cbagan_ompl.datasets.synthetic.HARD_DETOUR` times as long as the straight line,
            where a map has such tasks; the other tasks may be hard or easy.
        runs: of RRT for each label.
        range: longest edge of RRT in pixels; None for ``size`` / 64.
        min_distance: least distance from start to goal as a fraction of the size.
        split: see :func:`cbagan_ompl.datasets.splits.select_test_tasks`.
        test_fraction: fraction of the tasks, or of the original maps, for testing.
        seed: of all random numbers.

    Raises:
        ConfigError: a setting out of range, or an unknown name.

    Example:
        >>> GenerationSettings(size=128).longest_edge
        2.0
    """

    maps: int = 100
    tasks: int = 100
    size: int = 64
    generators: tuple[str, ...] = tuple(MAP_GENERATORS)
    varied: bool = False
    copies: int = 1
    label: str = LABELS[0]
    hard_fraction: float = 0.0
    runs: int = RUNS
    range: float | None = None
    min_distance: float = 0.25
    split: str = "map"
    test_fraction: float = 0.2
    seed: int = 0

    def __post_init__(self) -> None:
        for name in ("maps", "tasks", "copies", "runs"):
            whole_number(name, getattr(self, name), 1, MAX_LINES)
        whole_number("size", self.size, MIN_SIZE, MAX_SIZE)
        check_generators(self.generators)
        if self.label not in LABELS:
            raise ConfigError(f"a label is one of {', '.join(LABELS)}, got {show(self.label)}")
        check_fraction("hard_fraction", finite_number("hard_fraction", self.hard_fraction, 0))
        if self.range is not None:
            positive_number("range", self.range)
        if not finite_number("min_distance", self.min_distance, 0) < 1:
            raise ConfigError(
                f"min_distance is a fraction of the map's size, from 0 to below 1, "
                f"got {show(self.min_distance)}"
            )
        if self.maps * self.tasks > MAX_LINES:
            raise ConfigError(
                f"a set holds up to {MAX_LINES} tasks, {self.maps * self.tasks} are asked for"
            )
        check_pixels(self.maps * self.tasks, self.size, "the set", ConfigError)
        # Raises for an impossible seed or split before any work is done.
        self.select_test_tasks()

    @property
    def longest_edge(self) -> float:
        """Longest edge of RRT in pixels."""
        return self.size * RANGE if self.range is None else self.range

    def select_test_tasks(self) -> NDArray[np.bool_]:
        """Return which of all tasks, map after map, are for testing, (maps * tasks,)."""
        originals = (np.arange(self.maps) // self.copies).repeat(self.tasks)
        return select_test_tasks(self.split, originals, self.test_fraction, self.seed)


def generate(
    folder: Path,
    settings: GenerationSettings,
    jobs: int,
    resume: bool,
    progress: bool = True,
    executor: Executor | None = None,
) -> None:
    """Generate a training set.

    Args:
        folder: of the set; made if missing.
        settings: of the set.
        jobs: number of processes.
        resume: continue in a folder where a run was interrupted: only missing maps are made.
        progress: show a progress bar.
        executor: where maps are made; by default ``jobs`` processes of this machine. The files are
            the same, and this process writes them.

    Raises:
        ConfigError: ``resume`` with other settings, or without it although the folder holds a
            set; or files that are no part of such a set are in its place.
        DatasetError: a file cannot be written, a map has no task of the wanted distance, or a
            process has died.
        ClusterError: the cluster cannot do the work.
    """
    prepare_folder(folder, settings, resume, {})
    executor = executor or LocalExecutor(jobs)
    write_missing(folder, settings, executor, progress, [None] * settings.maps)


def write_missing(
    folder: Path,
    settings: GenerationSettings,
    executor: Executor,
    progress: bool,
    maps: Sequence[NDArray[np.bool_] | None],
) -> None:
    """Write the maps of a set that are not there yet, their tasks, and the lists.

    Args:
        folder: of the set.
        settings: of the set.
        executor: where maps are labelled; this process writes the files.
        progress: show a progress bar.
        maps: (S, S) each, true where free; None for a map that is generated.

    Raises:
        DatasetError: a file cannot be written, or a map has no task of the wanted distance.
    """
    missing = [k for k in range(settings.maps) if not _task_list(folder, k).is_file()]
    calls = {f"map_{k}": (settings, k, maps[k]) for k in missing}

    def write(_: str, made: tuple[int, Tasks]) -> None:
        number, tasks = made
        write_map(folder, number, tasks.maps[0] > 0)
        write_tasks(folder, number, tasks)

    run_each(_make_map_and_tasks, calls, executor, write, "maps", progress)
    rows = [task_row(k, n) for k in range(settings.maps) for n in range(settings.tasks)]
    write_lists(folder, rows, settings.select_test_tasks())


def prepare_folder(
    folder: Path, settings: GenerationSettings, resume: bool, inputs: dict[str, Any]
) -> None:
    """Make the folder of a set and its record, or check the record that is there.

    The record also names the version of OMPL: RRT's labels differ between versions.

    Args:
        folder: of the set.
        settings: of the set.
        resume: a set may be there.
        inputs: what else decides the set, for the record.

    Raises:
        ConfigError: see :func:`generate`.
        DatasetError: the record cannot be read or written.
    """
    from ..planning.compat import ompl_version

    record = folder / RECORD
    described = {"settings": asdict(settings), "ompl": ompl_version(), **inputs}
    made_by = json.loads(json.dumps(described))
    if os.path.lexists(record):
        if not resume:
            raise ConfigError(
                f"{folder} holds a set already; go on with it (--resume), or choose another folder"
            )
        if _read_record(record) != made_by:
            raise ConfigError(
                f"{record} was written with other options or maps, or another OMPL; go on with the "
                "same"
            )
        return
    check_new_folder(folder)
    make_folder(folder, DatasetError)
    write_json(record, made_by)


def _read_record(path: Path) -> Any:
    text = read_text(path, DatasetError, _MAX_RECORD)
    try:
        return json.loads(text)
    except Exception as error:  # ValueError, and RecursionError where it is nested deeply
        raise DatasetError(f"{path}: cannot read how the set was made ({error})") from error


def _task_list(folder: Path, number: int) -> Path:
    return folder / "tasks" / f"map_{number}.csv"


def _make_map_and_tasks(
    settings: GenerationSettings, number: int, free: NDArray[np.bool_] | None
) -> tuple[int, Tasks]:
    """Return the number of a map, and the map, made unless it is given, with its labelled tasks."""
    free = generate_map(settings, number) if free is None else free
    grid = GridMap(free)
    rng = np.random.default_rng((settings.seed, number, 1))
    labelled = [_generate_task(grid, settings, rng) for _ in range(settings.tasks)]
    return number, Tasks(
        free[None].astype(np.uint8),
        np.zeros(settings.tasks, dtype=np.int64),
        np.array([endpoints[0] for endpoints, _ in labelled], dtype=np.float32),
        np.array([endpoints[1] for endpoints, _ in labelled], dtype=np.float32),
        np.array([region for _, region in labelled], dtype=np.uint8),
    )


def generate_map(settings: GenerationSettings, number: int) -> NDArray[np.bool_]:
    """Generate a map of a set.

    Args:
        settings: of the set.
        number: of the map, from 0.

    Returns:
        (S, S), true where free.
    """
    original, copy = divmod(number, settings.copies)
    name = settings.generators[original % len(settings.generators)]
    rng = np.random.default_rng((settings.seed, original))
    if settings.varied:
        free = randomized_map(rng, settings.size, [name])
    else:
        free = MAP_GENERATORS[name](rng, settings.size, settings.size)
    return augment(free, np.random.default_rng((settings.seed, original, copy))) if copy else free


def _generate_task(
    grid: GridMap, settings: GenerationSettings, rng: np.random.Generator
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Sample start and goal, (2, 2), until a path connects them; return them and their region."""
    rows, columns = np.nonzero(grid.free)
    points = (np.stack((columns, rows), axis=-1) + 0.5).astype(np.float64)
    hard = settings.hard_fraction > 0 and rng.random() < settings.hard_fraction
    for attempt in range(_MAX_ATTEMPTS):
        endpoints = points[rng.integers(len(points), size=2)]
        seed = int(rng.integers(2**32))
        if np.hypot(*(endpoints[1] - endpoints[0])) < max(settings.min_distance * settings.size, 1):
            continue
        # Some maps have no hard tasks.
        if hard and attempt < _MAX_HARD_ATTEMPTS and not _is_hard(grid, endpoints):
            continue
        region = _label_task(grid, endpoints, settings, seed)
        if region.any():
            return endpoints, region
    raise DatasetError(
        f"found no task of at least {settings.min_distance:g} of the map's size; "
        "ask for a smaller distance"
    )


def _is_hard(grid: GridMap, endpoints: NDArray[np.float64]) -> bool:
    from .geodesic import distance_field

    start, goal = pixel_pair(endpoints)
    shortest = distance_field(grid.free, start)[goal[1], goal[0]]
    return bool(HARD_DETOUR * np.hypot(*(endpoints[1] - endpoints[0])) <= shortest < np.inf)


def _label_task(
    grid: GridMap, endpoints: NDArray[np.float64], settings: GenerationSettings, seed: int
) -> NDArray[np.bool_]:
    """Return the region of a task; empty where no path was found."""
    if settings.label == "geodesic":
        from .geodesic import distance_field

        start, goal = pixel_pair(endpoints)
        fields = distance_field(grid.free, start), distance_field(grid.free, goal)
        return geodesic_label(*fields, goal) >= REGION_THRESHOLD
    from .rrt_labels import rrt_region

    task = grid.check_task(*endpoints)
    return rrt_region(grid, task, settings.runs, settings.longest_edge, ITERATIONS, seed)
