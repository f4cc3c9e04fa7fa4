from __future__ import annotations

from pathlib import Path

import pytest
from helpers.training_set import generate_small_set

from cbagan_ompl import ConfigError
from cbagan_ompl.datasets.dataset import load_dataset
from cbagan_ompl.evaluation.label_noise import label_noise


def test_noise_of_labels(tmp_path: Path) -> None:
    dataset = load_dataset(generate_small_set(tmp_path / "set"))
    noise = label_noise(dataset.test, runs=3, range=1.0, seed=0, jobs=1, progress=False)
    assert 0.05 < noise["two labels"]["iou"] < 1
    assert noise["majority"]["iou"] > 0
    again = label_noise(dataset.test, runs=3, range=1.0, seed=0, jobs=2, progress=False)
    assert again == noise
    with pytest.raises(ConfigError, match="runs"):
        label_noise(dataset.test, runs=0, range=1.0, seed=0, jobs=1)
