from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest
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
