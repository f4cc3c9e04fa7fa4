from __future__ import annotations

import numpy as np

from cbagan_ompl.datasets.dataset import Dataset
from cbagan_ompl.evaluation.baselines import trivial_baselines


def test_baselines_lie_in_free_space_and_hold_the_endpoints(dataset: Dataset) -> None:
    tasks = dataset.test
    regions = trivial_baselines(tasks)
    assert np.array_equal(regions["all free space"], tasks.free)
    line = regions["straight line"]
    assert not (line & ~tasks.free).any()
    for i, points in enumerate(zip(tasks.start, tasks.goal, strict=True)):
        for column, row in np.array(points).astype(int):
            assert line[i, row, column]
