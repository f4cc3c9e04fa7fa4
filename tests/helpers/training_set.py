"""Small training sets in the published layout, written by hand or generated."""

from __future__ import annotations

import csv
import filecmp
from dataclasses import fields
from pathlib import Path

import cv2
import numpy as np

from cbagan_ompl.datasets.dataset import Tasks
from cbagan_ompl.datasets.generation import GenerationSettings, generate

SIDE = 32

#: Of :func:`generate_small_set`.
SMALL = GenerationSettings(maps=6, tasks=3, copies=2, runs=3, generators=("blocks", "triangles"))


def write_training_set(folder: Path, maps: int = 2, tasks: int = 10) -> Path:
    """Write maps with a block in the middle; the region is an L around it, every fifth a test."""
    rng = np.random.default_rng(0)
    (folder / "maps").mkdir(parents=True)
    rows = []
    for k in range(maps):
        blocked = np.full((SIDE, SIDE, 3), 255, np.uint8)
        blocked[10 + k : 20 + k, 12:22] = 0
        cv2.imwrite(str(folder / "maps" / f"map_{k}.png"), blocked)
        (folder / "tasks" / f"map_{k}").mkdir(parents=True)
        for n in range(tasks):
            row, column = rng.integers(1, 9), rng.integers(24, 31)
            points = np.full((SIDE, SIDE, 3), 255, np.uint8)
            points[row, 2] = (255, 0, 0)
            points[28, column] = (0, 0, 255)
            region = np.full((SIDE, SIDE, 3), 255, np.uint8)
            region[row : row + 2, 2 : column + 1] = (0, 255, 0)
            region[row:29, column : column + 2] = (0, 255, 0)
            names = (f"map_{k}.png", f"task_{n}.png", f"task_{n}_roi.png")
            for name, image in zip(names[1:], (points, region), strict=True):
                cv2.imwrite(str(folder / "tasks" / f"map_{k}" / name), image)
            rows.append(names)
    for name, part in (("train", [r for i, r in enumerate(rows) if i % 5]), ("test", rows[::5])):
        with (folder / f"{name}.csv").open("w", newline="") as file:
            csv.writer(file).writerows([("map", "task", "roi"), *part])
    return folder


def generate_small_set(folder: Path) -> Path:
    generate(folder, SMALL, jobs=2, resume=False, progress=False)
    return folder


def relative_files(root: Path) -> set[str]:
    return {str(path.relative_to(root)) for path in root.rglob("*") if path.is_file()}


def assert_same_files(one: Path, other: Path) -> None:
    names = relative_files(one)
    assert names == relative_files(other)
    assert filecmp.cmpfiles(one, other, names, shallow=False)[1:] == ([], [])


def equal_tasks(one: Tasks, other: Tasks) -> bool:
    return all(
        np.array_equal(getattr(one, field.name), getattr(other, field.name))
        for field in fields(Tasks)
    )
