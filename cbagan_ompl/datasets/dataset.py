"""A training set on disk: maps, start and goal points, and the promising regions between them.

The layout is that of the published (map, point, ROI) set of the CBAGAN-RRT paper
(https://arxiv.org/abs/2305.10442)::

    maps/map_K.png             white free, black blocked
    tasks/map_K/task_N.png     one blue spot (start) and one red spot (goal) on white
    tasks/map_K/task_N_roi.png green region on white
    train.csv, test.csv        columns map, task, roi: the names of the three files of each task

Blue is the start in every published task: it is the point that ``tasks/map_K.csv`` calls the start,
and the root of the trees that made the label. The label holds the start in 99.9 % of the tasks, and
the goal, to which a tree need only come near, in 74 %.

All images are squares of one size. They are held in memory as bytes, 80 MB for 10,000 tasks of
64 x 64 pixels; nothing is written to disk.
"""

from __future__ import annotations

import csv
import io
import re
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from ..common.files import read_bytes, read_text
from ..errors import DatasetError

#: Columns of ``train.csv`` and ``test.csv``.
COLUMNS = ("map", "task", "roi")

# Values of a colour channel below this count as dark.
_DARK = 128


@dataclass(frozen=True)
class Tasks:
    """Planning tasks with their regions.

    Attributes:
        maps: (M, S, S) uint8, 1 where free.
        map_of: (N,), index into ``maps`` for each task.
        start: (N, 2), image coordinates (u, v) in pixels, u right, v down from the top left corner.
        goal: (N, 2), the same.
        region: (N, S, S), the labels: uint8 0 or 1, 1 in the region, in a data set on disk; float16
            from 0 to 1 in synthetic tasks (:mod:`cbagan_ompl.datasets.synthetic`).
    """

    maps: NDArray[np.uint8]
    map_of: NDArray[np.int64]
    start: NDArray[np.float32]
    goal: NDArray[np.float32]
    region: NDArray[np.uint8 | np.float16]

    def __len__(self) -> int:
        return len(self.region)

    @property
    def size(self) -> int:
        """Width and height S of the images in pixels."""
        return int(self.region.shape[-1])

    @property
    def free(self) -> NDArray[np.bool_]:
        """(N, S, S), the map of each task, true where free."""
        return self.maps[self.map_of].astype(bool)

    def select(self, indices: NDArray[np.int64]) -> Tasks:
        """Return the tasks with some indices, on the same maps."""
        return Tasks(
            self.maps,
            self.map_of[indices],
            self.start[indices],
            self.goal[indices],
            self.region[indices],
        )


@dataclass(frozen=True)
class Dataset:
    """A training set in memory.

    Attributes:
        name: for records.
        map_numbers: the number K of each map, from its file name ``map_K.png``; -1 for maps of
            other names.
        train: the tasks of ``train.csv``.
        test: the tasks of ``test.csv``, on the same maps.
    """

    name: str
    map_numbers: tuple[int, ...]
    train: Tasks
    test: Tasks

    def description(self) -> dict[str, Any]:
        """Return what checkpoints and model files record of the data."""
        return {
            "name": self.name,
            "maps": len(self.train.maps),
            "side": self.train.size,
            "train_tasks": len(self.train),
            "test_tasks": len(self.test),
        }

    def split(self, fraction: float, seed: int) -> tuple[Tasks, Tasks]:
        """Split the training tasks at random.

        Args:
            fraction: of the tasks that is held out for validation, at least one task.
            seed: the same seed gives the same parts.

        Returns:
            The tasks for training, and those for validation.

        Raises:
            DatasetError: there are fewer than three tasks.
        """
        if len(self.train) < 3:
            raise DatasetError(f"{self.name}: train.csv lists fewer than three tasks")
        order = np.random.default_rng(seed).permutation(len(self.train))
        count = min(max(1, round(fraction * len(order))), len(order) - 2)
        held_out, kept = np.sort(order[:count]), np.sort(order[count:])
        return self.train.select(kept), self.train.select(held_out)


def load_dataset(folder: str | PathLike[str]) -> Dataset:
    """Read a training set.

    Args:
        folder: the folder that holds ``train.csv``.

    Raises:
        DatasetError: a file is missing or unreadable, a column is missing, a list is empty or
            names a file in another folder, an image differs in size from the first map, or a task
            has no start or goal spot.
    """
    root = Path(folder)
    if not root.is_dir():
        raise DatasetError(f"{root}: no such folder; give the folder that holds train.csv")
    rows = {name: _read_rows(root / f"{name}.csv") for name in ("train", "test")}
    names = sorted({row["map"] for part in rows.values() for row in part}, key=_map_number)
    maps = _read_maps(root, names)
    index = {name: i for i, name in enumerate(names)}
    parts = {name: _read_tasks(root, part, maps, index) for name, part in rows.items()}
    numbers = tuple(_map_number(name)[0] for name in names)
    return Dataset(root.resolve().name, numbers, parts["train"], parts["test"])


def label_files(folder: str | PathLike[str], part: str) -> list[Path]:
    """Return the path of each label, in the order of the tasks.

    Args:
        folder: of the set.
        part: ``train`` or ``test``.

    Raises:
        DatasetError: the list of the tasks cannot be read.
    """
    root = Path(folder)
    return [
        root / "tasks" / Path(row["map"]).stem / row["roi"]
        for row in _read_rows(root / f"{part}.csv")
    ]


def _map_number(name: str) -> tuple[int, str]:
    """Return K of ``map_K.png``, or -1, and the name itself as a key to sort by."""
    match = re.fullmatch(r"map_(\d+)", Path(name).stem)
    return int(match[1]) if match else -1, name


def _read_rows(path: Path) -> list[dict[str, str]]:
    text = read_text(path, DatasetError)
    try:
        reader = csv.DictReader(io.StringIO(text, newline=""))
        missing = set(COLUMNS) - set(reader.fieldnames or ())
        rows = list(reader)
    except csv.Error as error:
        raise DatasetError(f"{path}: cannot read the list of tasks ({error})") from error
    if missing:
        raise DatasetError(
            f"{path}: column {', '.join(sorted(missing))} is missing; "
            f"the columns are {', '.join(COLUMNS)}"
        )
    if not rows or any(not row[column] for row in rows for column in COLUMNS):
        raise DatasetError(f"{path}: the list is empty, or a line has an empty or missing cell")
    for row in rows:
        for column in COLUMNS:
            if Path(row[column]).name != row[column]:
                raise DatasetError(f"{path}: {row[column]!r} is no name of a file without folders")
    return rows


def _read_maps(root: Path, names: list[str]) -> NDArray[np.uint8]:
    images = [read_image(root / "maps" / name) for name in names]
    size = images[0].shape[0]
    if images[0].shape[1] != size:
        raise DatasetError(
            f"{root}: the images of a training set are squares; {names[0]} has "
            f"{images[0].shape[1]} x {size} pixels"
        )
    for name, image in zip(names, images, strict=True):
        _check_size(root / "maps" / name, image, size)
    return np.stack([(image[..., 0] >= _DARK).astype(np.uint8) for image in images])


def _read_tasks(
    root: Path, rows: list[dict[str, str]], maps: NDArray[np.uint8], map_index: dict[str, int]
) -> Tasks:
    size = maps.shape[-1]
    endpoints = np.empty((len(rows), 2, 2), dtype=np.float32)
    region = np.empty((len(rows), size, size), dtype=np.uint8)
    for i, row in enumerate(rows):
        folder = root / "tasks" / Path(row["map"]).stem
        image = read_image(folder / row["task"])
        _check_size(folder / row["task"], image, size)
        endpoints[i] = _find_endpoints(folder / row["task"], image)
        image = read_image(folder / row["roi"])
        _check_size(folder / row["roi"], image, size)
        region[i] = (image[..., 1] >= _DARK) & (image[..., 0] < _DARK)
    map_of = np.array([map_index[row["map"]] for row in rows], dtype=np.int64)
    return Tasks(maps, map_of, endpoints[:, 0].copy(), endpoints[:, 1].copy(), region)


def read_image(path: Path) -> NDArray[np.uint8]:
    """Read an image as (H, W, 3), red, green, blue.

    Raises:
        DatasetError: it is missing, no image, or too large.
    """
    # cv2.imread itself would print a warning for a missing file, and cannot open every path.
    data = np.frombuffer(read_bytes(path, DatasetError), dtype=np.uint8)
    try:
        image = cv2.imdecode(data, cv2.IMREAD_COLOR) if data.size else None
    except cv2.error as error:
        raise DatasetError(f"{path}: an image that is too large ({error.err})") from error
    if image is None:
        raise DatasetError(f"{path}: not an image, or a damaged one")
    return np.asarray(image[..., ::-1], dtype=np.uint8)


def _check_size(path: Path, image: NDArray[np.uint8], size: int) -> None:
    if image.shape[:2] != (size, size):
        raise DatasetError(
            f"{path}: {image.shape[1]} x {image.shape[0]} pixels, "
            f"but the first map has {size} x {size}"
        )


def _find_endpoints(path: Path, image: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Return the centres (u, v) of the spots of start and goal, shape (2, 2)."""
    red, blue = image[..., 0] >= _DARK, image[..., 2] >= _DARK
    centres = []
    for role, colour, spot in (("start", "blue", blue & ~red), ("goal", "red", red & ~blue)):
        rows, columns = np.nonzero(spot)
        if not rows.size:
            raise DatasetError(f"{path}: no {colour} pixel, the {role} is missing")
        centres.append((columns.mean() + 0.5, rows.mean() + 0.5))
    return np.array(centres, dtype=np.float32)
