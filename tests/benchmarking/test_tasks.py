from __future__ import annotations

import json
import shutil
from pathlib import Path

import cv2
import numpy as np
import pytest
from helpers.tasks import GOAL, START

from cbagan_ompl import ConfigError, GridMap, Heatmap, HeatmapError, MapError, Task, TaskError
from cbagan_ompl.benchmarking.benchmark import Benchmark
from cbagan_ompl.benchmarking.logs import parse_log
from cbagan_ompl.benchmarking.settings import Settings, parse_parameters
from cbagan_ompl.benchmarking.tasks import BenchmarkTask, heatmap_file, random_tasks, select_tasks
from cbagan_ompl.benchmarking.worker import Job, run_job
from cbagan_ompl.cli import main
from cbagan_ompl.planning import compat
from cbagan_ompl.planning.compat import ob
from cbagan_ompl.planning.problem import set_parameter

SUITES = Path(__file__).resolve().parents[2] / "benchmarks" / "suites"


@pytest.fixture
def image(two_walls: GridMap, tmp_path: Path) -> str:
    path = tmp_path / "walls.png"
    cv2.imwrite(str(path), two_walls.free.astype(np.uint8) * 255)
    return str(path)


def test_bundled_maps_and_their_tasks_are_the_default() -> None:
    tasks = select_tasks([])
    assert len(tasks) == 28
    assert tasks[0].name == "bug_trap_0"
    assert [task.name for task in select_tasks(["bundled:maze"], tasks_per_map=2)] == [
        "maze_0",
        "maze_3",
    ]


def test_maps_without_tasks_get_random_ones(image: str) -> None:
    tasks = select_tasks([image], seed=3)
    assert [task.name for task in tasks] == [f"walls_{i}" for i in range(4)]
    assert [t.task for t in select_tasks([image], seed=3)] == [t.task for t in tasks]
    assert [t.task for t in select_tasks([image], seed=4)] != [t.task for t in tasks]
    for task in tasks:
        start, goal = task.grid.check_task(task.task.start, task.task.goal)
        assert np.hypot(*(goal - start)) >= 128
    assert len(select_tasks([image], tasks_per_map=7)) == 7


def test_random_tasks_need_room() -> None:
    free = np.zeros((100, 100), bool)
    free[:3, :3] = True
    with pytest.raises(TaskError, match="found no 2 tasks"):
        random_tasks(GridMap(free), 2, 0)


def test_tasks_are_checked(image: str, tmp_path: Path) -> None:
    tasks = tmp_path / "tasks.csv"
    tasks.write_text("map,start_x,start_y,goal_x,goal_y\nwalls,10,10,20,20\nwalls,10,65,20,20\n")
    with pytest.raises(TaskError, match=r"task 1 of walls: start .* is in an obstacle"):
        select_tasks([image], str(tasks))
    tasks.write_text("map,start_x,start_y,goal_x,goal_y\nwalls,10,10,20,20\n")
    assert select_tasks([image], str(tasks))[0].task == Task((10, 10), (20, 20))
    with pytest.raises(ConfigError, match="two walls_0"):
        select_tasks([image, image], str(tasks))


def test_names_have_no_blanks() -> None:
    grid = GridMap(np.ones((9, 9), bool), name="my map/1")
    assert BenchmarkTask(grid, 2, Task((0, 0), (1, 1))).name == "my_map_1_2"


def test_heat_maps_of_others(two_walls: GridMap, corridor: Heatmap, tmp_path: Path) -> None:
    task = BenchmarkTask(two_walls, 0, Task(START, GOAL))
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


def test_several_models_side_by_side(tmp_path: Path) -> None:
    pytest.importorskip("torch")
    from cbagan_ompl.inference.model_files import bundled_model

    copy = shutil.copy(bundled_model(), tmp_path / "copy.pt")
    words = ["benchmark", "bundled:maze", "--tasks-per-map", "1", "--planners", "RRT"]
    words += ["--samplers", "uniform,learned", "--model", f"copy={copy}", "--runs", "1"]
    assert main([*words, "--range", "20", "--output", str(tmp_path / "out")]) == 0
    log = parse_log((tmp_path / "out" / "logs" / "maze_0.log").read_text())
    assert [planner.name.rsplit("_")[-1] for planner in log.planners] == [
        "uniform",
        "learned",
        "copy",
    ]
    for planner in log.planners[1:]:
        assert int(planner.runs[0]["learned draws INTEGER"]) > 0
        assert float(planner.runs[0]["inference time REAL"]) > 0


def test_options_of_maps(tmp_path: Path) -> None:
    path = tmp_path / "gray.png"
    cv2.imwrite(str(path), np.full((20, 20), 100, np.uint8))
    options = {"threshold": 0.3, "unknown_is_free": False}
    assert select_tasks([str(path)], tasks_per_map=1, map_options=options)[0].grid.free.all()
    with pytest.raises(MapError, match=r"threshold 0\.5"):
        select_tasks([str(path)], tasks_per_map=1)
    words = ["benchmark", str(path), "--tasks-per-map", "1", "--planners", "RRT"]
    words += ["--samplers", "uniform", "--runs", "1", "--output", str(tmp_path / "out")]
    assert main(words) == 2
    assert main([*words, "--threshold", "0.3"]) == 0


@pytest.mark.parametrize("suite", sorted(SUITES.glob("*.args")), ids=lambda path: path.stem)
def test_suites_can_run_on_every_ompl(
    suite: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    # All is checked before the first run.
    monkeypatch.setattr(Benchmark, "run", lambda *_: {})
    assert main(["benchmark", "bundled:maze", f"@{suite}", "--output", str(tmp_path)]) == 0
    settings = json.loads((tmp_path / "settings.json").read_text())
    assert len(settings["planners"]) == 5
    assert settings["samplers"] == ["uniform", "learned", "corridor", "straight-line"]


def test_arguments_can_be_kept_in_a_file(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    suite = tmp_path / "suite.txt"
    suite.write_text("bundled:maze\n--runs=0\n")
    assert main(["benchmark", f"@{suite}", "--output", str(tmp_path / "out")]) == 2
    assert "runs must be at least 1" in capsys.readouterr().err


def test_parameters_from_texts() -> None:
    assert parse_parameters(["RRT.goal_bias=0.1", "RRTstar.k_nearest=false", "RRT.range=3"]) == {
        "RRT": {"goal_bias": 0.1, "range": 3},
        "RRTstar": {"k_nearest": False},
    }


@pytest.mark.parametrize("text", ["RRT", "RRT.range", "range=1", ".range=1", "RRT.=1"])
def test_parameters_of_another_form(text: str) -> None:
    with pytest.raises(ConfigError, match=r"PLANNER\.parameter=value"):
        parse_parameters([text])


def test_set_parameter_calls_the_setter() -> None:
    space = compat.plane_space(np.zeros(2), np.ones(2))
    planner = compat.planner_class("RRTstar")(ob.SpaceInformation(space))
    set_parameter(planner, "rewire_factor", 1.3)
    set_parameter(planner, "range", 7)
    set_parameter(planner, "k_nearest", False)
    set_parameter(planner, "delay_cc", False)
    assert planner.getRewireFactor() == 1.3
    assert planner.getRange() == 7
    assert planner.getKNearest() is False
    assert planner.getDelayCC() is False
    with pytest.raises(ConfigError, match=r"no parameter 'magic' to set.*setRewireFactor"):
        set_parameter(planner, "magic", 1)


def test_settings_are_compared_with_saved_ones(tmp_path: Path) -> None:
    settings = Settings(parameters={"RRT": {"range": 3}}, heatmap_dirs={"peer": "folder"})
    settings.save(tmp_path / "settings.json")
    assert settings.is_saved_in(tmp_path / "settings.json")
    assert not Settings(seed=1).is_saved_in(tmp_path / "settings.json")
