from __future__ import annotations

import os
from pathlib import Path

import cv2
import numpy as np
import pytest
from helpers.fuzzing import mutations, read_all
from helpers.images import png_file
from helpers.predictions import store

from cbagan_ompl import DatasetError
from cbagan_ompl.datasets.dataset import Dataset
from cbagan_ompl.evaluation.stored_predictions import load_predictions


@pytest.mark.parametrize("listed", [True, False])
def test_stored_predictions(folder: Path, dataset: Dataset, tmp_path: Path, listed: bool) -> None:
    store(tmp_path, folder, dataset.test.region, listed)
    regions = load_predictions(tmp_path, folder, "test")
    assert np.array_equal(regions, dataset.test.region.astype(bool))


def test_faults_in_stored_predictions(folder: Path, dataset: Dataset, tmp_path: Path) -> None:
    store(tmp_path, folder, dataset.test.region, listed=True)
    (tmp_path / "roi_1.png").unlink()
    with pytest.raises(DatasetError, match=r"roi_1\.png"):
        load_predictions(tmp_path, folder, "test")
    cv2.imwrite(str(tmp_path / "roi_1.png"), np.zeros((5, 5, 3), np.uint8))
    with pytest.raises(DatasetError, match="5 x 5 pixels, but 32 x 32 are expected"):
        load_predictions(tmp_path, folder, "test")
    (tmp_path / "results.csv").write_text("label\na\n")
    with pytest.raises(DatasetError, match="columns are true_roi, pred_roi"):
        load_predictions(tmp_path, folder, "test")
    (tmp_path / "results.csv").write_text("true_roi,pred_roi\n")
    with pytest.raises(DatasetError, match="no prediction for map_0/"):
        load_predictions(tmp_path, folder, "test")


def test_gray_predictions_are_not_guessed_at(
    folder: Path, dataset: Dataset, tmp_path: Path
) -> None:
    regions = dataset.test.region.copy()
    regions[0] = 0
    store(tmp_path, folder, regions, listed=True)
    assert not load_predictions(tmp_path, folder, "test")[0].any(), "white alone is no region"
    cv2.imwrite(str(tmp_path / "roi_0.png"), dataset.test.region[0] * np.uint8(255))
    with pytest.raises(DatasetError, match=r"roi_0\.png is a gray image; .* green on white"):
        load_predictions(tmp_path, folder, "test")


def test_damaged_lists_of_predictions_are_read_or_refused(
    folder: Path, dataset: Dataset, tmp_path: Path
) -> None:
    store(tmp_path, folder, dataset.test.region, listed=True)
    path = tmp_path / "results.csv"

    def load(data: bytes) -> None:
        path.write_bytes(data)
        load_predictions(tmp_path, folder, "test")

    counts = read_all(load, mutations([path.read_bytes()], 300, seed=0))
    assert min(counts["read"], counts["refused"]) > 5


def test_predictions_that_are_too_large(folder: Path, dataset: Dataset, tmp_path: Path) -> None:
    store(tmp_path, folder, dataset.test.region, listed=True)
    (tmp_path / "roi_0.png").write_bytes(png_file((32000, 32000), b"", depth=1))
    with pytest.raises(DatasetError, match="32000 x 32000 pixels"):
        load_predictions(tmp_path, folder, "test")
    (tmp_path / "roi_0.png").unlink()
    os.mkfifo(tmp_path / "roi_0.png")
    with pytest.raises(DatasetError, match="a device or a pipe"):
        load_predictions(tmp_path, folder, "test")
