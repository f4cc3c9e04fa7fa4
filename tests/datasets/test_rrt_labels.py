from __future__ import annotations

import numpy as np
from helpers.training_set import SMALL

from cbagan_ompl.datasets.generation import generate_map
from cbagan_ompl.datasets.rrt_labels import rrt_region
from cbagan_ompl.maps.grid_map import GridMap


def test_labels_depend_on_the_seed() -> None:
    grid = GridMap(generate_map(SMALL, 0))
    rows, columns = np.nonzero(grid.free)
    task = grid.check_task((columns[0] + 0.5, rows[0] + 0.5), (columns[-1] + 0.5, rows[-1] + 0.5))
    one, same, other = (rrt_region(grid, task, 3, 2.0, 5000, seed) for seed in (5, 5, 6))
    assert np.array_equal(one, same)
    assert (one != other).any()
    more = rrt_region(grid, task, 12, 2.0, 5000, 5)
    assert not (one & ~more).any(), "further runs only add pixels"
    assert not rrt_region(grid, task, 3, 2.0, 5, 5).any(), "five iterations find no path"
