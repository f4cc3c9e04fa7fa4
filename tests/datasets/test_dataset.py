from __future__ import annotations

import struct
import zlib
from pathlib import Path

import pytest
from helpers.training_set import write_training_set

from cbagan_ompl import DatasetError
from cbagan_ompl.datasets.dataset import load_dataset


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
    with pytest.raises(DatasetError, match=r"map_1\.png: an image that is too large"):
        load_dataset(root)
