"""Sets that others have published: unpacked, checked, and split anew."""

from __future__ import annotations

import platform
import tarfile
import zipfile
import zlib
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..common.validation import check_at_least
from ..errors import ConfigError, DatasetError
from ..evaluation.metrics import connects
from .dataset import Dataset, Tasks, load_dataset
from .splits import is_test_task
from .writing import task_row, write_lists, write_map, write_tasks

KEEP = "keep"


def read_set(path: Path) -> Dataset:
    """The set in a folder, or in an archive (.tar, .tar.gz, .zip) that holds it in any folder.

    Raises:
        DatasetError: it cannot be read, see :func:`cbagan_ompl.datasets.dataset.load_dataset`, or
            the archive holds no set or several.
    """
    if path.is_dir():
        return load_dataset(path)
    with TemporaryDirectory() as temporary:
        # A set that has no folder in the archive is called as the archive is.
        folder = Path(temporary) / path.name.split(".")[0]
        _unpack(path, folder)
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


def _unpack(path: Path, folder: Path) -> None:
    try:
        if zipfile.is_zipfile(path):
            with zipfile.ZipFile(path) as zipped:
                zipped.extractall(folder)  # leaves out what would lead out of the folder
            return
        with tarfile.open(path) as archive:
            if not hasattr(tarfile, "data_filter"):
                raise DatasetError(
                    f"{path}: Python {platform.python_version()} cannot keep a tar archive from "
                    "writing outside its folder (3.10.12, 3.11.4 and newer can); unpack it "
                    "yourself, and give the folder"
                )
            archive.extractall(folder, filter="data")
    except _UNREADABLE as error:
        reason = getattr(error, "strerror", None) or error
        raise DatasetError(
            f"{path}: neither a folder nor an archive that can be unpacked ({reason})"
        ) from error


#: What damaged or encrypted archives raise; ``zipfile`` has no root for its own.
_UNREADABLE = (
    OSError,
    EOFError,
    tarfile.TarError,
    zipfile.BadZipFile,
    zlib.error,
    RuntimeError,
    ValueError,
)


def described(dataset: Dataset) -> dict[str, Any]:
    """What a set is, for people who think of training with it.

    Returns:
        Counts of maps and tasks, ``shared_maps`` (those with tasks in both lists: of these the
        test tells how well a network knows them, not how it does on others),
        ``repeated_tasks`` (test tasks that are in training as well), ``region_share`` (of free
        space), ``joined`` (share of the labels in whose free pixels start and goal are joined),
        ``blocked_ends`` (tasks that start or end in an obstacle).
    """
    train, test = dataset.train, dataset.test
    known = {_key(train, i) for i in range(len(train))}
    both = (train, test)
    masks = [(tasks.free, tasks.region.astype(bool)) for tasks in both]
    free = sum(int(free.sum()) for free, _ in masks)
    region = sum(int((free & region).sum()) for free, region in masks)
    return {
        **dataset.description(),
        "shared_maps": len(set(train.map_of.tolist()) & set(test.map_of.tolist())),
        "repeated_tasks": sum(_key(test, i) in known for i in range(len(test))),
        "region_share": region / free,
        "joined": float(
            np.mean([_is_joined(tasks, i) for tasks in both for i in range(len(tasks))])
        ),
        "blocked_ends": sum(_is_blocked(tasks, i) for tasks in both for i in range(len(tasks))),
    }


def _key(tasks: Tasks, i: int) -> tuple[int, bytes, bytes]:
    return int(tasks.map_of[i]), tasks.start[i].tobytes(), tasks.goal[i].tobytes()


def _ends(tasks: Tasks, i: int) -> tuple[tuple[int, int], tuple[int, int]]:
    (u, v), (x, y) = (end[i].astype(int).tolist() for end in (tasks.start, tasks.goal))
    return (u, v), (x, y)


def _is_joined(tasks: Tasks, i: int) -> bool:
    inside = (tasks.region[i] & tasks.maps[tasks.map_of[i]]).astype(np.bool_)
    return connects(inside, *_ends(tasks, i))


def _is_blocked(tasks: Tasks, i: int) -> bool:
    free = tasks.maps[tasks.map_of[i]]
    return not all(free[row, column] for column, row in _ends(tasks, i))


def write_dataset(
    folder: Path,
    dataset: Dataset,
    split: str = KEEP,
    copies: int = 1,
    test_fraction: float = 0.2,
    seed: int = 0,
) -> None:
    """Write a set in the published layout, its tasks numbered anew.

    The maps keep their numbers, which tell whose copies they are; where not all are called
    ``map_K.png``, or two have the same number, they are numbered anew too.

    Args:
        folder: where to; must not hold a set yet.
        dataset: the set.
        split: ``keep`` for the lists as they are, or see
            :func:`cbagan_ompl.datasets.splits.is_test_task`.
        copies: so many maps in a row (by their number) are copies of one original: 10 in the
            published set. They stay on one side of a split by map.
        test_fraction: share of the tasks, or of the original maps, for testing.
        seed: of the split.

    Raises:
        ConfigError: the folder holds a set, or the split cannot be made.
        DatasetError: a file cannot be written.
    """
    if (folder / "train.csv").exists():
        raise ConfigError(f"{folder} holds a set already; choose another folder")
    check_at_least("copies", copies, 1)
    tasks, was_test = _together(dataset)
    order = np.argsort(tasks.map_of, kind="stable")
    tasks, was_test = tasks.select(order), was_test[order]
    is_test = was_test
    if split != KEEP:
        is_test = is_test_task(
            split, _originals(dataset, copies)[tasks.map_of], test_fraction, seed
        )
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


def _originals(dataset: Dataset, copies: int) -> NDArray[np.int64]:
    """The number of the original of each map, (M,)."""
    if copies == 1:
        return np.arange(len(dataset.map_numbers))
    if min(dataset.map_numbers) < 0:
        raise ConfigError(
            f"{copies} copies of each original cannot be told: the maps are not called map_K.png"
        )
    return np.array(dataset.map_numbers) // copies


def _together(dataset: Dataset) -> tuple[Tasks, NDArray[np.bool_]]:
    """All tasks of a set, and which of them are for testing."""
    train, test = dataset.train, dataset.test
    together = Tasks(
        train.maps,
        *(
            np.concatenate((getattr(train, name), getattr(test, name)))
            for name in ("map_of", "start", "goal", "region")
        ),
    )
    return together, np.repeat((False, True), (len(train), len(test)))
