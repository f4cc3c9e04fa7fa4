"""Files of heat maps: what is not read is refused, with little effort."""

from __future__ import annotations

import io
from pathlib import Path

import cv2
import numpy as np
import pytest
from helpers.fuzzing import mutations, read_all
from helpers.images import png_file
from numpy.lib import format as npy_format

from cbagan_ompl import GridMap, Heatmap, HeatmapError

GRID = GridMap(np.ones((6, 5), bool), name="small")


def _npy(values: np.ndarray, version: tuple[int, int] | None = None) -> bytes:
    buffer = io.BytesIO()
    npy_format.write_array(buffer, values, version)
    return buffer.getvalue()


def _valid_arrays() -> list[bytes]:
    values = np.random.default_rng(0).random((6, 5))
    return [
        _npy(values),
        _npy(values.astype(np.float32)),
        _npy(np.asfortranarray(values)),
        _npy((values * 255).astype(np.uint8), (2, 0)),
        _npy(values > 0.5, (3, 0)),
    ]


@pytest.mark.parametrize("white", [255, 65535])
def test_an_image_of_another_size_is_refused_by_its_header(tmp_path: Path, white: int) -> None:
    path = tmp_path / "heat.png"
    path.write_bytes(png_file((4000, 4000), b"", depth=8 if white == 255 else 16))
    expected = rf"heat map {path}: 4000 x 4000 pixels, but 5 x 6 are expected"
    with pytest.raises(HeatmapError, match=expected):
        Heatmap.load(path, GRID)


@pytest.mark.parametrize("suffix", [".png", ".jpg"])
def test_truncated_images(tmp_path: Path, suffix: str) -> None:
    values = np.random.default_rng(0).integers(0, 256, (6, 5)).astype(np.uint8)
    data = cv2.imencode(suffix, values)[1].tobytes()
    path = tmp_path / f"heat{suffix}"
    path.write_bytes(data[:-20] + data[-2:])
    with pytest.raises(HeatmapError, match=r"cannot read the heat map .*heat"):
        Heatmap.load(path, GRID)


@pytest.mark.parametrize(
    ("count", "seed"), [(600, 0), pytest.param(3000, 1, marks=pytest.mark.slow)]
)
def test_damaged_arrays_are_read_or_refused(tmp_path: Path, count: int, seed: int) -> None:
    path = tmp_path / "heat.npy"

    def load(data: bytes) -> None:
        path.write_bytes(data)
        assert np.isfinite(Heatmap.load(path, GRID).values).all()

    counts = read_all(load, mutations(_valid_arrays(), count, seed))
    assert min(counts["read"], counts["refused"]) > count / 20
