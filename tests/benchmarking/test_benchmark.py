from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cbagan_ompl import GridMap, HeatmapError, Task
from cbagan_ompl.benchmarking.benchmark import Benchmark
from cbagan_ompl.benchmarking.settings import Settings
from cbagan_ompl.benchmarking.tasks import BenchmarkTask
from cbagan_ompl.planning.workspace import Workspace


def test_every_task_needs_its_heat_map(two_walls: GridMap, tmp_path: Path) -> None:
    tasks = [BenchmarkTask(Workspace(two_walls), i, Task((10, 10), (240, 240))) for i in range(2)]
    np.save(tmp_path / "two_walls_0.npy", np.ones(two_walls.shape, np.float32))
    settings = Settings(("RRT",), ("uniform", "peer"), heatmap_dirs={"peer": str(tmp_path)})
    Benchmark(tasks[:1], settings, tmp_path / "one")
    with pytest.raises(HeatmapError, match=r"neither .*two_walls_1\.npy"):
        Benchmark(tasks, settings, tmp_path / "both")
    assert not (tmp_path / "both").exists()
