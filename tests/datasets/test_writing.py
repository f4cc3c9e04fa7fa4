from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest

from cbagan_ompl.datasets.dataset import Dataset


def test_the_list_of_a_map_holds_the_endpoints_of_its_tasks(
    small_folder: Path, small_dataset: Dataset
) -> None:
    with (small_folder / "train.csv").open() as file:
        first = next(csv.DictReader(file))
    number = Path(first["task"]).stem.removeprefix("task_")
    with (small_folder / "tasks" / f"{Path(first['map']).stem}.csv").open() as file:
        row = list(csv.DictReader(file))[int(number)]
    (u, v), (x, y) = small_dataset.train.start[0] - 0.5, small_dataset.train.goal[0] - 0.5
    assert [float(row[k]) for k in ("istart", "jstart", "igoal", "jgoal")] == [v, u, y, x]
    assert float(row["euclid"]) == pytest.approx(np.hypot(u - x, v - y))
