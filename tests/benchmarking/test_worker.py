from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest
from helpers.benchmarks import Finished
from helpers.tasks import GOAL, START

from cbagan_ompl import GridMap, Heatmap, HeatmapError, Task
from cbagan_ompl.benchmarking.inputs import record_inputs
from cbagan_ompl.benchmarking.logs import parse_log
from cbagan_ompl.benchmarking.settings import Settings
from cbagan_ompl.benchmarking.tasks import BenchmarkTask, heatmap_file
from cbagan_ompl.benchmarking.worker import Job, run_job
from cbagan_ompl.planning.workspace import Workspace


def test_heat_maps_of_others(two_walls: GridMap, corridor: Heatmap, tmp_path: Path) -> None:
    task = BenchmarkTask(Workspace(two_walls), 0, Task(START, GOAL))
    with pytest.raises(HeatmapError, match=r"neither .*two_walls_0\.npy nor two_walls_0\.png"):
        heatmap_file(str(tmp_path), task)
    cv2.imwrite(str(tmp_path / "two_walls_0.png"), (corridor.values * 255).astype(np.uint8))
    settings = Settings(
        ("RRT",), ("uniform", "peer"), runs=1, range=20, heatmap_dirs={"peer": str(tmp_path)}
    )
    rounds: list[None] = []
    run_job(Job(task, settings, tmp_path / "x.log"), lambda: rounds.append(None))
    assert len(rounds) == 1
    log = parse_log((tmp_path / "x.log").read_text())
    assert [planner.name for planner in log.planners] == [
        "geometric_RRT_uniform",
        "geometric_RRT_peer",
    ]
    assert int(log.planners[1].runs[0]["learned draws INTEGER"]) > 0
    assert sorted(path.name for path in tmp_path.iterdir()) == ["two_walls_0.png", "x.log"]


def test_auto_is_the_corridor_of_a_small_map(tmp_path: Path) -> None:
    grid = GridMap(np.ones((64, 64), bool), name="small")
    task = BenchmarkTask(Workspace(grid), 0, Task((5, 5), (60, 60)))
    settings = Settings(("RRT",), ("uniform", "auto"), runs=1, time=0.2)
    run_job(Job(task, settings, tmp_path / "x.log"), lambda: None)
    log = parse_log((tmp_path / "x.log").read_text())
    assert log.planners[1].name == "geometric_RRT_auto"
    assert log.parameters["auto VARCHAR"] == "corridor"
    assert int(log.planners[1].runs[0]["learned draws INTEGER"]) > 0
    assert record_inputs([task], settings)["model_hashes"].keys() == {"learned"}


def test_only_the_other_samplers_have_heat_maps(finished: Finished) -> None:
    for log in finished.logs:
        assert [len(planner.runs) for planner in log.planners] == [3] * 4
        for planner in log.planners:
            for run in planner.runs:
                samples = int(run["learned draws INTEGER"]), int(run["uniform draws INTEGER"])
                if planner.name.endswith("_uniform"):
                    assert samples == (0, 0)
                    assert float(run["inference time REAL"]) == 0
                else:
                    assert samples[0] > samples[1] / 3 > 0
                    assert float(run["inference time REAL"]) > 0


def test_parameters_are_set(finished: Finished) -> None:
    for log in finished.logs:
        for planner in log.planners:
            assert "range = 10" in planner.settings
            bias = "0.1" if "RRTstar" in planner.name else "0.05"
            assert any(line.startswith(f"goal_bias = {bias}") for line in planner.settings)


def test_variants_of_a_sampler_have_their_own_options(two_walls: GridMap, tmp_path: Path) -> None:
    task = BenchmarkTask(Workspace(two_walls), 0, Task(START, GOAL))
    samplers = ("uniform", "flat", "flat:adaptation=none:uniform_fraction=0.9")
    settings = Settings(
        ("RRTstar", "RRTConnect"), samplers, runs=2, time=0.3, range=20, simplify=("RRTConnect",)
    )
    run_job(Job(task, settings, tmp_path / "x.log"), lambda: None)
    log = parse_log((tmp_path / "x.log").read_text())
    assert "auto VARCHAR" not in log.parameters
    rrtstar, connect = log.planners[:3], log.planners[3:]
    counts = [
        [int(planner.runs[0][f"{kind} draws INTEGER"]) for kind in ("learned", "uniform")]
        for planner in rrtstar
    ]
    assert counts[1][0] > counts[1][1]
    assert counts[2][1] > 5 * counts[2][0]
    for planner in rrtstar:
        for run in planner.runs:
            # RRT* prunes nothing: what was counted is what is there.
            added, there = (int(run[f"{name} INTEGER"]) for name in ("nodes added", "graph states"))
            assert abs(added - there) <= 1
            assert 1 < int(run["nodes at first solution INTEGER"]) <= added
            assert run["simplification time REAL"] == "0"
    for planner in connect:
        for run in planner.runs:
            assert run["nodes at first solution INTEGER"] == run["graph states INTEGER"]
            assert float(run["simplification time REAL"]) > 0
            first, final = run["first solution cost REAL"], run["checked solution cost REAL"]
            assert float(final) < float(first)
