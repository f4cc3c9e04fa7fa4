"""A training set of a few simple tasks, written in the published layout, and a recipe for it."""

from __future__ import annotations

import csv
from pathlib import Path

import cv2
import numpy as np

from cbagan_ompl.networks.config import NetworkConfig
from cbagan_ompl.training.config import TrainingConfig

SIDE = 32
TINY = TrainingConfig(
    network=NetworkConfig(widths=(4, 4, 6, 8), discriminator_width=4),
    epochs=2,
    batch_size=4,
    adversarial_every=2,
)


def write_training_set(folder: Path, maps: int = 2, tasks: int = 10) -> Path:
    """A block in the middle of each map; the region is an L around it. Every fifth is a test."""
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
