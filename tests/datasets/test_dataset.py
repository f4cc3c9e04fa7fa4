from __future__ import annotations

import struct
import zlib
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from helpers.training_set import SIDE, write_training_set

from cbagan_ompl import DatasetError
from cbagan_ompl.datasets.dataset import Dataset, load_dataset


@pytest.fixture(scope="module")
def dataset(tmp_path_factory: pytest.TempPathFactory) -> Dataset:
    return load_dataset(write_training_set(tmp_path_factory.mktemp("data") / "tiny"))


def test_dataset_content(dataset: Dataset) -> None:
    assert (len(dataset.train), len(dataset.test)) == (16, 4)
    assert dataset.description()["side"] == SIDE
    tasks = dataset.test
    for i in range(len(tasks)):
        (u, v), (column, row) = tasks.start[i], tasks.goal[i].astype(int)
        assert (u, v % 1) == (2.5, 0.5)
        assert tasks.region[i, int(v), 2] == tasks.region[i, row, column] == 1
        assert not tasks.free[i, 15, 15]
        assert tasks.free[i, 0, 0]


def test_split_is_seeded_and_disjoint(dataset: Dataset) -> None:
    (a, b), (c, d) = dataset.split(0.25, 3), dataset.split(0.25, 3)
    assert (len(a), len(b)) == (12, 4)
    assert np.array_equal(a.region, c.region)
    assert np.array_equal(b.region, d.region)
    everything = np.concatenate((a.goal, b.goal))
    assert sorted(everything.tolist()) == sorted(dataset.train.goal.tolist())


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        (lambda root: (root / "train.csv").unlink(), "train.csv"),
        (lambda root: (root / "test.csv").write_text("map,task\na,b\n"), "column roi is missing"),
        (lambda root: (root / "test.csv").write_text("map,task,roi\n"), "empty"),
        (lambda root: (root / "maps" / "map_1.png").unlink(), "map_1.png"),
        (lambda root: (root / "tasks/map_0/task_1_roi.png").write_bytes(b"text"), "no PNG, JPEG"),
        (
            lambda root: cv2.imwrite(
                str(root / "tasks/map_0/task_1_roi.png"), np.zeros((8, 9, 3), np.uint8)
            ),
            "9 x 8 pixels",
        ),
        (
            lambda root: cv2.imwrite(
                str(root / "tasks/map_0/task_1.png"), np.full((SIDE, SIDE, 3), 255, np.uint8)
            ),
            "start is missing",
        ),
        (
            lambda root: cv2.imwrite(
                str(root / "maps/map_0.png"), np.full((20, 32, 3), 255, np.uint8)
            ),
            "squares; map_0.png has 32 x 20",
        ),
    ],
)
def test_damaged_sets(tmp_path: Path, damage: Any, message: str) -> None:
    root = write_training_set(tmp_path / "set")
    damage(root)
    with pytest.raises(DatasetError, match=message):
        load_dataset(root)


def test_missing_folder(tmp_path: Path) -> None:
    with pytest.raises(DatasetError, match="no such folder"):
        load_dataset(tmp_path / "none")


def test_lists_that_lead_out_of_the_folder(tmp_path: Path) -> None:
    root = write_training_set(tmp_path / "set")
    text = (root / "train.csv").read_text()
    (root / "train.csv").write_text(text.replace("map_0.png", "../maps/map_0.png"))
    with pytest.raises(DatasetError, match=r"train\.csv: '\.\./maps/map_0\.png' is no name"):
        load_dataset(root)
    (root / "train.csv").write_text(text.replace("map_0.png", "map_0\0.png"))
    with pytest.raises(DatasetError, match="cannot read"):
        load_dataset(root)


def test_an_image_that_is_too_large(tmp_path: Path) -> None:
    root = write_training_set(tmp_path / "set")
    path = root / "maps" / "map_1.png"
    data = bytearray(path.read_bytes())
    data[16:24] = struct.pack(">II", 60_000, 60_000)  # width and height of the header
    data[29:33] = struct.pack(">I", zlib.crc32(data[12:29]))
    path.write_bytes(data)
    with pytest.raises(DatasetError, match=r"map_1\.png: 60000 x 60000 pixels; maps up to 4096"):
        load_dataset(root)
