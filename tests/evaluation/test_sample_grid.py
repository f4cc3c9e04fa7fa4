from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

from cbagan_ompl import ConfigError
from cbagan_ompl.datasets.dataset import Dataset
from cbagan_ompl.evaluation.baselines import trivial_baselines
from cbagan_ompl.evaluation.evaluator import Evaluator
from cbagan_ompl.evaluation.frechet import region_features
from cbagan_ompl.evaluation.sample_grid import _choose_cases, save_sample_grid


def test_best_median_and_worst_cases() -> None:
    ious = np.array([0.5, 0.1, 0.9, 0.3, 0.7, 0.2, 0.8, 0.4, 0.6])
    cases = {name: ious[chosen].tolist() for name, chosen in _choose_cases(ious).items()}
    assert cases == {
        "best": [0.9, 0.8, 0.7],
        "median": [0.6, 0.5, 0.4],
        "worst": [0.1, 0.2, 0.3],
    }


@pytest.mark.parametrize("count", [2, 8])
def test_the_figure_is_written(dataset: Dataset, tmp_path: Path, count: int) -> None:
    tasks = dataset.test.select(np.arange(count))
    line = trivial_baselines(tasks)["straight line"]
    evaluation = Evaluator(tasks, region_features, seed=0).evaluate("line", line)
    save_sample_grid(evaluation, tasks, tmp_path / "line.png")
    assert min(cv2.imread(str(tmp_path / "line.png")).shape[:2]) > 500
    with pytest.raises(ConfigError, match=r"cannot write .*none/line\.png"):
        save_sample_grid(evaluation, tasks, tmp_path / "none" / "line.png")
