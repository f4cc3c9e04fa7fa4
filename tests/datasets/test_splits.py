from __future__ import annotations

import numpy as np

from cbagan_ompl.datasets.splits import select_test_tasks


def test_splits() -> None:
    originals = np.repeat(np.arange(10), 20)
    by_task = select_test_tasks("task", originals, 0.2, 0)
    assert by_task.sum() == 40
    assert len(np.unique(originals[by_task])) > 5
    by_map = select_test_tasks("map", originals, 0.2, 0)
    assert by_map.sum() == 40
    assert len(np.unique(originals[by_map])) == 2
    assert np.array_equal(by_map, select_test_tasks("map", originals, 0.2, 0))
