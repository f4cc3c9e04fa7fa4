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

import re
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from ..common.files import read_bytes
from ..errors import CbaganOmplError, DatasetError, show
from ..maps.image_files import MAX_IMAGE_BYTES, decode_pixels
from .tables import read_table

#: Columns of ``train.csv`` and ``test.csv``.
COLUMNS = ("map", "task", "roi")

#: Longest side of the images of a set, and most pixels of all images of a kind together.
MAX_SIZE, MAX_PIXELS = 4096, 2**32

# Values of a colour channel below this count as dark.
_DARK = 128


class Row(NamedTuple):
    """The names of a task's files."""

    map: str
    task: str
    roi: str


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
        direction: (N, 2, S // 4, S // 4) float16, the directions of travel of synthetic tasks, see
            :func:`cbagan_ompl.datasets.geodesic_labels.travel_directions`; None where unknown.
    """

    maps: NDArray[np.uint8]
    map_of: NDArray[np.int64]
    start: NDArray[np.float32]
    goal: NDArray[np.float32]
    region: NDArray[np.uint8 | np.float16]
    direction: NDArray[np.float16] | None = None

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
            None if self.direction is None else self.direction[indices],
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
    names = sorted({row.map for part in rows.values() for row in part}, key=_map_number)
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
        root / "tasks" / Path(row.map).stem / row.roi for row in _read_rows(root / f"{part}.csv")
    ]


def _map_number(name: str) -> tuple[int, str]:
    """Return K of ``map_K.png``, or -1, and the name itself as a key to sort by."""
    match = re.fullmatch(r"map_(\d{1,18})(\.[^.]*)?", name)
    return int(match[1]) if match else -1, name


def _read_rows(path: Path) -> list[Row]:
    rows = [Row(*cells) for cells in read_table(path, COLUMNS)]
    if not rows:
        raise DatasetError(f"{path}: the list is empty")
    for row in rows:
        for name in row:
            if "/" in name or name == "." or name.startswith(".."):
                raise DatasetError(f"{path}: {show(name)} is no name of a file without folders")
    return rows


def _read_maps(root: Path, names: list[str]) -> NDArray[np.uint8]:
    first = read_image(root / "maps" / names[0])
    size = len(first)
    if first.shape[1] != size:
        raise DatasetError(
            f"{root}: the images of a training set are squares; {names[0]} has "
            f"{first.shape[1]} x {size} pixels"
        )
    check_pixels(len(names), size, str(root))
    maps = np.empty((len(names), size, size), dtype=np.uint8)
    for i, name in enumerate(names):
        maps[i] = read_image(root / "maps" / name, size)[..., 0] >= _DARK
    return maps


def _read_tasks(
    root: Path, rows: list[Row], maps: NDArray[np.uint8], map_index: dict[str, int]
) -> Tasks:
    size = maps.shape[-1]
    check_pixels(len(rows), size, str(root))
    endpoints = np.empty((len(rows), 2, 2), dtype=np.float32)
    region = np.empty((len(rows), size, size), dtype=np.uint8)
    for i, row in enumerate(rows):
        folder = root / "tasks" / Path(row.map).stem
        endpoints[i] = _find_endpoints(folder / row.task, read_image(folder / row.task, size))
        image = read_image(folder / row.roi, size)
        region[i] = (image[..., 1] >= _DARK) & (image[..., 0] < _DARK)
    map_of = np.array([map_index[row.map] for row in rows], dtype=np.int64)
    return Tasks(maps, map_of, endpoints[:, 0].copy(), endpoints[:, 1].copy(), region)


def read_image(path: Path, size: int | None = None) -> NDArray[np.uint8]:
    """Read an image as (H, W, 3), red, green, blue, each from 0 to 255.

    Args:
        path: of the file.
        size: width and height that it must have; None for any.

    Raises:
        DatasetError: it is missing, no image, of another size, or longer on a side than
            :data:`MAX_SIZE`, which is found out before memory is spent on it.
    """
    data = read_bytes(path, DatasetError, limit=MAX_IMAGE_BYTES)
    expected = None if size is None else (size, size)
    pixels: Any
    pixels, white = decode_pixels(data, str(path), DatasetError, expected, MAX_SIZE)
    if white != 255:
        pixels = cv2.convertScaleAbs(pixels, alpha=255 / white)
    if pixels.ndim == 2:
        pixels = np.broadcast_to(pixels[..., None], (*pixels.shape, 3))
    return np.asarray(pixels[..., 2::-1], dtype=np.uint8)


def check_pixels(
    count: int, size: int, name: str, error_class: type[CbaganOmplError] = DatasetError
) -> None:
    """Raise if images do not fit into memory together.

    Args:
        count: number of the images.
        size: width and height of each in pixels.
        name: what to call them in the message.
        error_class: what to raise.

    Raises:
        CbaganOmplError: of that class; they have more than :data:`MAX_PIXELS` pixels.
    """
    if count * size * size > MAX_PIXELS:
        raise error_class(
            f"{name}: {count} images of {size} x {size} pixels; a set holds up to "
            f"{MAX_PIXELS} pixels, which are kept in memory"
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
