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

from ..errors import DatasetError
from .dataset import COLUMNS, Tasks

#: Columns of ``tasks/map_K.csv``: row and column of start and goal, and their distance.
TASK_COLUMNS = ("istart", "jstart", "igoal", "jgoal", "euclid")

Row = tuple[str, str, str]


def write_map(root: Path, number: int, free: NDArray[np.bool_ | np.uint8]) -> None:
    """Write ``maps/map_K.png``.

    Args:
        root: folder of the set.
        number: K.
        free: (S, S), true where free.
    """
    pixels = np.where(free[..., None], 255, 0).astype(np.uint8).repeat(3, axis=2)
    write_image(root / "maps" / f"map_{number}.png", pixels)


def write_tasks(root: Path, number: int, tasks: Tasks) -> None:
    """Write the tasks of one map, last of all their list, which says that they are complete.

    Args:
        root: folder of the set.
        number: K of the map.
        tasks: those of this map alone.
    """
    folder = root / "tasks" / f"map_{number}"
    lines = []
    for n in range(len(tasks)):
        (u, v), (x, y) = (ends[n].astype(int).tolist() for ends in (tasks.start, tasks.goal))
        spots = np.full((tasks.side, tasks.side, 3), 255, dtype=np.uint8)
        spots[v, u], spots[y, x] = (0, 0, 255), (255, 0, 0)
        region = np.full_like(spots, 255)
        region[tasks.region[n] > 0] = (0, 255, 0)
        write_image(folder / f"task_{n}.png", spots)
        write_image(folder / f"task_{n}_roi.png", region)
        lines.append((v, u, y, x, np.hypot(u - x, v - y)))
    write_csv(root / "tasks" / f"map_{number}.csv", TASK_COLUMNS, lines)


def task_row(map_number: int, task: int) -> Row:
    """The line of a task in ``train.csv`` or ``test.csv``."""
    return f"map_{map_number}.png", f"task_{task}.png", f"task_{task}_roi.png"


def write_lists(root: Path, rows: Sequence[Row], is_test: NDArray[np.bool_]) -> None:
    """Write ``train.csv`` and ``test.csv``.

    Args:
        root: folder of the set.
        rows: one for each task.
        is_test: (N,), true for those that go to ``test.csv``.
    """
    for name, wanted in (("train", False), ("test", True)):
        chosen = [row for row, test in zip(rows, is_test.tolist(), strict=True) if test is wanted]
        write_csv(root / f"{name}.csv", COLUMNS, chosen)


def write_image(path: Path, pixels: NDArray[np.uint8]) -> None:
    """Write a PNG file, (H, W, 3), red, green, blue, whole or not at all; folders are made.

    Raises:
        DatasetError: it cannot be written.
    """
    data = cv2.imencode(".png", np.ascontiguousarray(pixels[..., ::-1]))[1].tobytes()
    _write(path, data)


def write_csv(path: Path, columns: Iterable[str], rows: Iterable[Iterable[object]]) -> None:
    """Write a CSV file, whole or not at all.

    Raises:
        DatasetError: it cannot be written.
    """
    text = io.StringIO(newline="")
    writer = csv.writer(text)
    writer.writerow(columns)
    writer.writerows(rows)
    _write(path, text.getvalue().encode("utf-8"))


def _write(path: Path, data: bytes) -> None:
    temporary = path.with_suffix(".tmp")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        temporary.write_bytes(data)
        os.replace(temporary, path)
    except OSError as error:
        raise DatasetError(f"cannot write {path}: {error.strerror or error}") from error
