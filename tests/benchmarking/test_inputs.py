from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.fuzzing import mutations, read_all

from cbagan_ompl import ConfigError, GridMap, Task, __version__
from cbagan_ompl.benchmarking.benchmark import Benchmark
from cbagan_ompl.benchmarking.inputs import check_same, read_record, record_inputs
from cbagan_ompl.benchmarking.settings import Settings
from cbagan_ompl.benchmarking.tasks import BenchmarkTask
from cbagan_ompl.planning.compat import ompl_version
from cbagan_ompl.planning.workspace import Workspace

START, GOAL = (10.0, 10.0), (240.0, 240.0)


def test_a_record_identifies_versions_maps_and_tasks(two_walls: GridMap) -> None:
    settings = Settings(("RRT",), ("uniform", "corridor"))
    task = BenchmarkTask(Workspace(two_walls), 0, Task(START, GOAL, 325.5, "walls"))
    record = record_inputs([task], settings)
    assert record.items() >= settings.to_dict().items()
    assert record["package_version"] == __version__
    assert record["ompl_version"] == ompl_version()
    assert record["model_hashes"] == {}
    assert record["tasks"] == {
        "two_walls_0": {
            "start": [10, 10],
            "goal": [240, 240],
            "optimal_cost": 325.5,
            "family": "walls",
        }
    }
    assert {**record["maps"]["two_walls"], "hash": ""} == {
        "width": 256,
        "height": 256,
        "resolution": 1,
        "origin": None,
        "hash": "",
    }


@pytest.mark.parametrize(
    "changes", [{"resolution": 0.5}, {"origin": (0, 0, 0)}, {"origin": (1, 0, 0)}]
)
def test_the_same_cells_elsewhere_are_another_map(
    two_walls: GridMap, tmp_path: Path, changes: dict[str, Any]
) -> None:
    settings, task = Settings(("RRT",), ("uniform",)), Task(START, GOAL)
    before = record_inputs([BenchmarkTask(Workspace(two_walls), 0, task)], settings)
    saved = tmp_path / "settings.json"
    saved.write_text(json.dumps(before))
    check_same(before, saved)
    moved = GridMap(two_walls.free, name=two_walls.name, **changes)
    with pytest.raises(ConfigError, match="maps two_walls"):
        check_same(record_inputs([BenchmarkTask(Workspace(moved), 0, task)], settings), saved)


def test_heat_maps_of_another_content_are_refused(two_walls: GridMap, tmp_path: Path) -> None:
    task = BenchmarkTask(Workspace(two_walls), 0, Task(START, GOAL))
    file = tmp_path / "two_walls_0.npy"
    np.save(file, np.ones(two_walls.shape, np.float32))
    settings = Settings(("RRT",), ("uniform", "peer"), heatmap_dirs={"peer": str(tmp_path)})
    Benchmark([task], settings, tmp_path / "out")
    Benchmark([task], settings, tmp_path / "out", resume=True)
    np.save(file, np.full(two_walls.shape, 0.5, np.float32))
    with pytest.raises(ConfigError, match="heatmap_hashes peer"):
        Benchmark([task], settings, tmp_path / "out", resume=True)


def test_models_of_another_content_are_refused(two_walls: GridMap, tmp_path: Path) -> None:
    task = BenchmarkTask(Workspace(two_walls), 0, Task(START, GOAL))
    model = tmp_path / "m.pt"
    settings = Settings(("RRT",), ("uniform", "mine"), models={"mine": str(model)})
    model.write_bytes(b"one")
    one = record_inputs([task], settings)
    model.write_bytes(b"two")
    two = record_inputs([task], settings)
    assert one["model_hashes"].keys() == two["model_hashes"].keys() == {"mine"}
    assert one["model_hashes"] != two["model_hashes"]


def test_logs_without_settings_are_not_taken_over(two_walls: GridMap, tmp_path: Path) -> None:
    task = BenchmarkTask(Workspace(two_walls), 0, Task(START, GOAL))
    (tmp_path / "logs").mkdir()
    (tmp_path / "logs" / "two_walls_0.log").write_text("")
    for resume in (False, True):
        with pytest.raises(ConfigError, match=r"settings\.json is missing"):
            Benchmark([task], Settings(("RRT",), ("uniform",)), tmp_path, resume)


def test_large_records_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "settings.json"
    path.write_bytes(b" " * (2**24 + 1))
    with pytest.raises(ConfigError, match="more than the 16 MiB"):
        read_record(path)


def test_damaged_records_are_read_or_refused(two_walls: GridMap, tmp_path: Path) -> None:
    settings = Settings(("RRT", "RRTstar"), ("uniform",), parameters={"RRTstar": {"goal_bias": 0}})
    record = record_inputs([BenchmarkTask(Workspace(two_walls), 0, Task(START, GOAL))], settings)
    path = tmp_path / "settings.json"

    def read(data: bytes) -> None:
        path.write_bytes(data)
        check_same(record, path)

    counts = read_all(read, mutations([json.dumps(record, indent=2).encode()], 600, seed=0))
    assert counts["read"] > 0
    assert counts["refused"] > 500
