"""Writing training sets in the published layout, see :mod:`cbagan_ompl.datasets.dataset`."""

from __future__ import annotations

import csv
import io
import os
from collections.abc import Iterable, Sequence
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from ..common.files import make_folder, write_atomically
from ..errors import ConfigError, DatasetError
from .dataset import COLUMNS, Row, Tasks

#: Columns of ``tasks/map_K.csv``: row and column of start and goal, and their distance in pixels.
TASK_COLUMNS = ("istart", "jstart", "igoal", "jgoal", "euclid")


# What the folder of a set holds.
_NAMES = ("maps", "tasks", "train.csv", "test.csv", "dataset.json")


def check_new_folder(folder: Path) -> None:
    """Raise if a set in a folder would replace files that are there.

    Args:
        folder: of the new set; may be missing.

    Raises:
        ConfigError: one of the names that a set uses is there already.
    """
    for name in _NAMES:
        if os.path.lexists(folder / name):
            raise ConfigError(
                f"{folder} holds a set already, or other files that a set would replace ({name}); "
                "choose another folder"
            )


def write_map(root: Path, number: int, free: NDArray[np.bool_ | np.uint8]) -> None:
    """Write ``maps/map_K.png``.

    Args:
        root: folder of the set.
        number: K.
        free: (S, S), true where free.

    Raises:
        DatasetError: it cannot be written.
    """
    pixels = np.where(free[..., None], 255, 0).astype(np.uint8).repeat(3, axis=2)
    write_image(root / "maps" / f"map_{number}.png", pixels)


def write_tasks(root: Path, number: int, tasks: Tasks) -> None:
    """Write the tasks of one map, and last of all their list, which marks them as complete.

    Args:
        root: folder of the set.
        number: K of the map.
        tasks: those of this map alone.

    Raises:
        DatasetError: a file cannot be written.
    """
    folder = root / "tasks" / f"map_{number}"
    rows = []
    for n in range(len(tasks)):
        (u, v), (x, y) = (points[n].astype(int).tolist() for points in (tasks.start, tasks.goal))
        spots = np.full((tasks.size, tasks.size, 3), 255, dtype=np.uint8)
        spots[v, u], spots[y, x] = (0, 0, 255), (255, 0, 0)
        region = np.full_like(spots, 255)
        region[tasks.region[n] > 0] = (0, 255, 0)
        write_image(folder / f"task_{n}.png", spots)
        write_image(folder / f"task_{n}_roi.png", region)
        rows.append((v, u, y, x, np.hypot(u - x, v - y)))
    write_csv(root / "tasks" / f"map_{number}.csv", TASK_COLUMNS, rows)


def task_row(map_number: int, task: int) -> Row:
    """Return the row of a task in ``train.csv`` or ``test.csv``.

    Example:
        >>> task_row(3, 0)
        Row(map='map_3.png', task='task_0.png', roi='task_0_roi.png')
    """
    return Row(f"map_{map_number}.png", f"task_{task}.png", f"task_{task}_roi.png")


def write_lists(root: Path, rows: Sequence[Row], is_test: NDArray[np.bool_]) -> None:
    """Write ``train.csv`` and ``test.csv``.

    Args:
        root: folder of the set.
        rows: one for each task.
        is_test: (N,), true for those that go to ``test.csv``.

    Raises:
        DatasetError: a file cannot be written.
    """
    for name, wanted in (("train", False), ("test", True)):
        selected = [row for row, test in zip(rows, is_test.tolist(), strict=True) if test is wanted]
        write_csv(root / f"{name}.csv", COLUMNS, selected)


def write_image(path: Path, pixels: NDArray[np.uint8]) -> None:
    """Write a PNG file whole or not at all; missing folders are made.

    Args:
        path: of the file.
        pixels: (H, W, 3), red, green, blue.

    Raises:
        DatasetError: it cannot be written.
    """
    _write(path, cv2.imencode(".png", np.ascontiguousarray(pixels[..., ::-1]))[1].tobytes())


def write_csv(path: Path, columns: Iterable[str], rows: Iterable[Iterable[object]]) -> None:
    """Write a CSV file whole or not at all; missing folders are made.

    Raises:
        DatasetError: it cannot be written.
    """
    text = io.StringIO(newline="")
    writer = csv.writer(text)
    writer.writerow(columns)
    writer.writerows(rows)
    _write(path, text.getvalue())


def _write(path: Path, data: bytes | str) -> None:
    make_folder(path.parent, DatasetError)
    write_atomically(path, data, DatasetError)
