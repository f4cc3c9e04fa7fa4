"""Importing published training sets: unpack, check, describe, and split them again."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..common.files import reason
from ..common.validation import whole_number
from ..errors import ConfigError, DatasetError
from ..maps.connectivity import connects
from .archives import unpack
from .dataset import Dataset, Tasks, load_dataset
from .splits import select_test_tasks
from .writing import check_new_folder, task_row, write_lists, write_map, write_tasks

#: The split that leaves the lists of a set as they are.
KEEP = "keep"


def import_dataset(path: Path) -> Dataset:
    """Read the set in a folder, or in an archive that holds it in any of its folders.

    Args:
        path: of the folder, or of the archive, see :func:`.archives.unpack`.

    Raises:
        DatasetError: it cannot be read, see :func:`cbagan_ompl.datasets.dataset.load_dataset`, or
            the archive holds no set or several.
    """
    if path.is_dir():
        return load_dataset(path)
    try:
        unpacked = TemporaryDirectory(ignore_cleanup_errors=True)
    except OSError as error:
        raise DatasetError(f"cannot make a folder to unpack {path}: {reason(error)}") from error
    with unpacked as temporary:
        # A set without a folder in the archive takes the archive's name.
        folder = Path(temporary) / path.name.split(".")[0]
        unpack(path, folder)
        lists = list(folder.rglob("train.csv"))
        if len(lists) != 1:
            raise DatasetError(
                f"{path}: the archive of a set holds one train.csv, not {len(lists)}"
            )
        try:
            return load_dataset(lists[0].parent)
        except DatasetError as error:
            message = str(error).replace(f"{folder}/", "")
            raise DatasetError(f"{path}: {message}") from error


def describe(dataset: Dataset) -> dict[str, Any]:
    """Return figures that tell how well a set is suited for training.

    Returns:
        Counts of maps and tasks, ``shared_maps`` (maps with tasks in both lists; the score on
        these does not tell how a network does on unseen maps), ``repeated_tasks`` (test tasks that
        are in training as well), ``region_share`` (fraction of free space in the regions),
        ``joined`` (fraction of labels in which start and goal are connected through free pixels,
        8-connected), ``blocked_ends`` (tasks with a blocked start or goal).
    """
    train, test = dataset.train, dataset.test
    trained = {_task_key(train, i) for i in range(len(train))}
    both = (train, test)
    masks = [(tasks.free, tasks.region.astype(bool)) for tasks in both]
    free = sum(int(free.sum()) for free, _ in masks)
    region = sum(int((free & region).sum()) for free, region in masks)
    return {
        **dataset.description(),
        "shared_maps": len(set(train.map_of.tolist()) & set(test.map_of.tolist())),
        "repeated_tasks": sum(_task_key(test, i) in trained for i in range(len(test))),
        "region_share": region / free,
        "joined": float(
            np.mean([_is_connected(tasks, i) for tasks in both for i in range(len(tasks))])
        ),
        "blocked_ends": sum(_is_blocked(tasks, i) for tasks in both for i in range(len(tasks))),
    }


def _task_key(tasks: Tasks, i: int) -> tuple[int, bytes, bytes]:
    return int(tasks.map_of[i]), tasks.start[i].tobytes(), tasks.goal[i].tobytes()


def _endpoint_pixels(tasks: Tasks, i: int) -> tuple[tuple[int, int], tuple[int, int]]:
    """Return the pixels (column, row) of start and goal."""
    (u, v), (x, y) = (points[i].astype(int).tolist() for points in (tasks.start, tasks.goal))
    return (u, v), (x, y)


def _is_connected(tasks: Tasks, i: int) -> bool:
    inside = (tasks.region[i] & tasks.maps[tasks.map_of[i]]).astype(np.bool_)
    return connects(inside, *_endpoint_pixels(tasks, i), connectivity=8)


def _is_blocked(tasks: Tasks, i: int) -> bool:
    free = tasks.maps[tasks.map_of[i]]
    return not all(free[row, column] for column, row in _endpoint_pixels(tasks, i))


def write_dataset(
    folder: Path,
    dataset: Dataset,
    split: str = KEEP,
    copies: int = 1,
    test_fraction: float = 0.2,
    seed: int = 0,
) -> None:
    """Write a set in the published layout, with its tasks renumbered.

    The maps keep their numbers, which tell the copies of one original. They are renumbered too
    where not all are called ``map_K.png``, or two have the same number.

    Args:
        folder: of the new set; must hold nothing yet that a set would replace.
        dataset: the set.
        split: ``keep`` for the lists as they are, or see
            :func:`cbagan_ompl.datasets.splits.select_test_tasks`.
        copies: this many maps with consecutive numbers are copies of one original: 10 in the
            published set. A split by map keeps them together.
        test_fraction: fraction of the tasks, or of the original maps, for testing.
        seed: of the split.

    Raises:
        ConfigError: the folder holds a set or such files, or the split cannot be made.
        DatasetError: a file cannot be written.
    """
    check_new_folder(folder)
    whole_number("copies", copies, 1)
    tasks, was_test = _concatenate_parts(dataset)
    order = np.argsort(tasks.map_of, kind="stable")
    tasks, was_test = tasks.select(order), was_test[order]
    is_test = was_test
    if split != KEEP:
        originals = _original_numbers(dataset, copies)[tasks.map_of]
        is_test = select_test_tasks(split, originals, test_fraction, seed)
    numbers = dataset.map_numbers
    if min(numbers) < 0 or len(set(numbers)) < len(numbers):
        numbers = tuple(range(len(numbers)))
    rows = []
    for i, (k, free) in enumerate(zip(numbers, tasks.maps, strict=True)):
        of_map = tasks.select(np.flatnonzero(tasks.map_of == i))
        write_map(folder, k, free)
        write_tasks(folder, k, of_map)
        rows += [task_row(k, n) for n in range(len(of_map))]
    write_lists(folder, rows, is_test)


def _original_numbers(dataset: Dataset, copies: int) -> NDArray[np.int64]:
    """Return the number of the original of each map, (M,)."""
    if copies == 1:
        return np.arange(len(dataset.map_numbers))
    if min(dataset.map_numbers) < 0:
        raise ConfigError(
            "cannot tell which maps are copies of one original: they are not called map_K.png"
        )
    return np.array(dataset.map_numbers) // copies


def _concatenate_parts(dataset: Dataset) -> tuple[Tasks, NDArray[np.bool_]]:
    """Return all tasks of a set, and which of them are for testing, (N,)."""
    train, test = dataset.train, dataset.test
    tasks = Tasks(
        train.maps,
        *(
            np.concatenate((getattr(train, name), getattr(test, name)))
            for name in ("map_of", "start", "goal", "region")
        ),
    )
    return tasks, np.repeat((False, True), (len(train), len(test)))
