"""New training sets: random maps, tasks on them, and labels of RRT or exact ones.

What a map, its tasks and their labels are depends on the seed and the number of the map alone, so
that a set is the same whatever the number of processes and however often it was interrupted (with
one version of OMPL).
"""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..common.files import write_json
from ..common.parallel import run_all
from ..common.validation import check_at_least, check_fraction, require
from ..errors import ConfigError, DatasetError
from ..map_generators import MAP_GENERATORS, MIN_SIDE, check_generators
from ..map_generators.randomization import randomized_map
from ..maps.grid_map import GridMap
from ..sampling.heatmap import REGION_THRESHOLD, pixel_pair
from .augmentation import augmented
from .dataset import Tasks
from .splits import is_test_task
from .synthetic import HARD_DETOUR, detour_heat
from .writing import Row, task_row, write_lists, write_map, write_tasks

RECORD = "dataset.json"

#: Kinds of labels.
LABELS = ("rrt", "geodesic")
#: The paper's number of runs of RRT for a label.
RUNS = 50
#: Limit of each run, in iterations: the paper's.
ITERATIONS = 5000
#: Longest edge of RRT as a share of the map's side, one pixel at 64. Of the lengths tried (1/128 to
#: 12/64) the short ones give labels like the published ones; half of it is twice as slow.
RANGE = 1 / 64

_MAX_TRIES, _MAX_HARD_TRIES = 1000, 100


@dataclass(frozen=True)
class GenerationSettings:
    """What decides a generated set.

    Attributes:
        maps: number of maps.
        tasks: on each map.
        size: side of the maps in pixels.
        families: names from :data:`cbagan_ompl.map_generators.MAP_GENERATORS`, taken in turn.
        varied: scale, turn and wear each original, see
            :mod:`cbagan_ompl.map_generators.randomization`.
        copies: maps from each original; the first is the original itself, the others are
            augmented (10 in the paper).
        label: ``rrt``, the union of the paths of many runs, as in the paper; or ``geodesic``, the
            region of :func:`cbagan_ompl.datasets.synthetic.detour_heat`.
        hard_share: share of tasks whose shortest way is at least
            :data:`cbagan_ompl.datasets.synthetic.HARD_DETOUR` times as long as the straight line,
            where a map has such tasks; the others are as they come.
        runs: of RRT for each label.
        range: longest edge of RRT in pixels; None for ``size`` / 64.
        min_distance: least distance from start to goal as a share of the side.
        split: see :func:`cbagan_ompl.datasets.splits.is_test_task`.
        test_fraction: share of the tasks, or of the original maps, for testing.
        seed: of everything.

    Raises:
        ConfigError: an option that makes no sense.
    """

    maps: int = 100
    tasks: int = 100
    size: int = 64
    families: tuple[str, ...] = tuple(MAP_GENERATORS)
    varied: bool = False
    copies: int = 1
    label: str = LABELS[0]
    hard_share: float = 0.0
    runs: int = RUNS
    range: float | None = None
    min_distance: float = 0.25
    split: str = "map"
    test_fraction: float = 0.2
    seed: int = 0

    def __post_init__(self) -> None:
        for name in ("maps", "tasks", "copies", "runs"):
            check_at_least(name, getattr(self, name), 1)
        check_at_least("size", self.size, MIN_SIDE)
        check_generators(self.families)
        if self.label not in LABELS:
            raise ConfigError(f"a label is one of {', '.join(LABELS)}, got {self.label!r}")
        check_fraction("hard_share", self.hard_share)
        if self.range is not None and not 0 < self.range < float("inf"):
            raise ConfigError(f"range must be above 0, got {self.range}")
        if not 0 <= self.min_distance < 1:
            raise ConfigError(
                f"min_distance is a share of the map's side, from 0 to below 1, "
                f"got {self.min_distance}"
            )
        # Refuses a seed or a split that cannot be before the work is done.
        is_test_task(self.split, self.originals(), self.test_fraction, self.seed)

    def originals(self) -> NDArray[np.int64]:
        """For each task the number of its original map, shape (maps * tasks,)."""
        return (np.arange(self.maps) // self.copies).repeat(self.tasks)

    @property
    def needs_distances(self) -> bool:
        """Whether tasks or labels are made from shortest ways."""
        return self.label == "geodesic" or self.hard_share > 0

    @property
    def longest_edge(self) -> float:
        """Longest edge of RRT in pixels."""
        return self.size * RANGE if self.range is None else self.range


def generate(
    folder: Path, settings: GenerationSettings, jobs: int, resume: bool, progress: bool = True
) -> None:
    """Make a training set.

    Args:
        folder: where to; made if missing.
        settings: what kind of set.
        jobs: processes at a time.
        resume: go on in a folder where a run was interrupted: only missing maps are made.
        progress: show a progress bar.

    Raises:
        ConfigError: ``resume`` with other settings, or without it although the folder holds a set.
        MissingDependencyError: shortest ways are needed, and numba is not installed.
        DatasetError: a file cannot be written, or a map has no task of the wanted distance.
    """
    if settings.needs_distances:
        require("numba", "train")
    _prepare(folder, settings, resume)
    missing = [k for k in range(settings.maps) if not _task_list(folder, k).is_file()]
    run_all(_make_map, [(folder, settings, k) for k in missing], jobs, "maps", progress)
    rows: list[Row] = [task_row(k, n) for k in range(settings.maps) for n in range(settings.tasks)]
    test = is_test_task(settings.split, settings.originals(), settings.test_fraction, settings.seed)
    write_lists(folder, rows, test)


def _prepare(folder: Path, settings: GenerationSettings, resume: bool) -> None:
    from ..planning.compat import ompl_version

    record = folder / RECORD
    made_by = json.loads(json.dumps({"settings": asdict(settings), "ompl": ompl_version()}))
    if record.exists():
        if not resume:
            raise ConfigError(
                f"{folder} holds a set already; go on with it (--resume), or choose another folder"
            )
        if _read_record(record) != made_by:
            raise ConfigError(
                f"{record} was written with other options or another OMPL; go on with the same"
            )
        return
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise DatasetError(f"cannot make the folder {folder}: {error.strerror or error}") from error
    write_json(str(record), made_by)


def _read_record(path: Path) -> Any:
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise DatasetError(f"{path}: cannot read how the set was made ({error})") from error


def _task_list(folder: Path, number: int) -> Path:
    return folder / "tasks" / f"map_{number}.csv"


def _make_map(folder: Path, settings: GenerationSettings, number: int) -> None:
    """Draw a map and its tasks, label them, and write all of it."""
    free = draw_map(settings, number)
    grid = GridMap(free)
    rng = np.random.default_rng((settings.seed, number, 1))
    drawn = [_draw_task(grid, settings, rng) for _ in range(settings.tasks)]
    write_map(folder, number, free)
    tasks = Tasks(
        free[None].astype(np.uint8),
        np.zeros(settings.tasks, dtype=np.int64),
        np.array([ends[0] for ends, _ in drawn], dtype=np.float32),
        np.array([ends[1] for ends, _ in drawn], dtype=np.float32),
        np.array([region for _, region in drawn], dtype=np.uint8),
    )
    write_tasks(folder, number, tasks)


def draw_map(settings: GenerationSettings, number: int) -> NDArray[np.bool_]:
    """A map of a set, (S, S), true where free.

    Args:
        settings: of the set.
        number: of the map, from 0.
    """
    original, copy = divmod(number, settings.copies)
    family = settings.families[original % len(settings.families)]
    rng = np.random.default_rng((settings.seed, original))
    if settings.varied:
        free = randomized_map(rng, settings.size, [family])
    else:
        free = MAP_GENERATORS[family](rng, settings.size, settings.size)
    return augmented(free, np.random.default_rng((settings.seed, original, copy))) if copy else free


def _draw_task(
    grid: GridMap, settings: GenerationSettings, rng: np.random.Generator
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Start and goal, (2, 2), and their region; drawn again until they are joined."""
    rows, columns = np.nonzero(grid.free)
    points = (np.stack((columns, rows), axis=-1) + 0.5).astype(np.float64)
    hard = settings.hard_share > 0 and rng.random() < settings.hard_share
    for attempt in range(_MAX_TRIES):
        ends = points[rng.integers(len(points), size=2)]
        seed = int(rng.integers(2**32))
        if np.hypot(*(ends[1] - ends[0])) < max(settings.min_distance * settings.size, 1):
            continue
        # Some maps have no hard tasks.
        if hard and attempt < _MAX_HARD_TRIES and not _is_hard(grid, ends):
            continue
        region = _label(grid, ends, settings, seed)
        if region.any():
            return ends, region
    raise DatasetError(
        f"found no task of at least {settings.min_distance:g} of the side on a map; "
        "ask for a smaller distance"
    )


def _is_hard(grid: GridMap, ends: NDArray[np.float64]) -> bool:
    from .geodesic import distances

    start, goal = pixel_pair(ends)
    shortest = distances(grid.free, start)[goal[1], goal[0]]
    return bool(HARD_DETOUR * np.hypot(*(ends[1] - ends[0])) <= shortest < np.inf)


def _label(
    grid: GridMap, ends: NDArray[np.float64], settings: GenerationSettings, seed: int
) -> NDArray[np.bool_]:
    if settings.label == "geodesic":
        from .geodesic import distances

        start, goal = pixel_pair(ends)
        fields = distances(grid.free, start), distances(grid.free, goal)
        return detour_heat(*fields, goal) >= REGION_THRESHOLD
    from .rrt_labels import rrt_region

    task = grid.check_task(*ends)
    return rrt_region(grid, task, settings.runs, settings.longest_edge, ITERATIONS, seed)
