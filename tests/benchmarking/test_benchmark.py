"""A whole benchmark by the command line, on one small map; the corridor needs no torch."""

from __future__ import annotations

import json
import os
import signal
import sqlite3
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing
from dataclasses import dataclass
from multiprocessing.context import ForkServerProcess
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from helpers.interrupting import interrupted

from cbagan_ompl import GridMap, Heatmap, HeatmapError, PlannerError, Task
from cbagan_ompl.benchmarking.benchmark import Benchmark
from cbagan_ompl.benchmarking.database import write_tables
from cbagan_ompl.benchmarking.logs import ExperimentLog, parse_log
from cbagan_ompl.benchmarking.runner import run_jobs
from cbagan_ompl.benchmarking.settings import Settings
from cbagan_ompl.benchmarking.tasks import BenchmarkTask
from cbagan_ompl.benchmarking.worker import Job
from cbagan_ompl.cli import main
from cbagan_ompl.planning.compat import BOOST_PYTHON
from cbagan_ompl.planning.ompl_benchmark import (
    PlannerVariant,
    RunOptions,
    check_variants,
    run_benchmark,
)

# A planner that no hook reaches.
UNREACHED = "EITstar" if BOOST_PYTHON else "BITstar"
TASKS = "map,start_x,start_y,goal_x,goal_y,optimal_cost\nwalls,10,10,90,90,\nwalls,90,5,10,95,1\n"
COLUMNS = {
    "experiments": {
        *("id", "name", "totaltime", "timelimit", "memorylimit", "runcount", "version", "hostname"),
        *("cpuinfo", "date", "seed", "setup", "map", "task", "best_known_cost"),
    },
    "plannerConfigs": {"id", "name", "settings"},
    "enums": {"name", "value", "description"},
    "runs": {
        *("id", "experimentid", "plannerid", "time", "solved", "status", "memory"),
        *("solution_length", "approximate_solution", "graph_states", "best_cost", "iterations"),
        *("inference_time", "learned_draws", "uniform_draws", "collision_checks"),
        *("checked_solution", "checked_solution_cost", "first_solution_time"),
        *("first_solution_cost", "time_to_10_percent", "time_to_5_percent", "time_to_2_percent"),
        *("cost_at_10_ms", "cost_at_25_ms", "cost_at_50_ms", "cost_at_100_ms"),
    },
    "progress": {"runid", "time", "best_cost", "iterations"},
}


@dataclass(frozen=True)
class Finished:
    arguments: list[str]
    folder: Path
    printed: str

    @property
    def logs(self) -> list[ExperimentLog]:
        return [parse_log(path.read_text()) for path in sorted(self.folder.glob("logs/*.log"))]


@pytest.fixture(scope="module")
def map_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("maps")
    free = np.full((100, 100), 255, np.uint8)
    free[40:44, :75] = 0
    free[62:66, 25:] = 0
    cv2.imwrite(str(folder / "walls.png"), free)
    (folder / "tasks.csv").write_text(TASKS)
    return folder


@pytest.fixture(scope="module")
def finished(map_folder: Path, tmp_path_factory: pytest.TempPathFactory) -> Finished:
    folder = tmp_path_factory.mktemp("benchmark") / "out"
    arguments = ["benchmark", str(map_folder / "walls.png"), "--range", "10", "--time", "0.1"]
    arguments += ["--tasks", str(map_folder / "tasks.csv"), "--planners", "RRT,RRTstar"]
    arguments += ["--samplers", "uniform,corridor", "--runs", "3", "--set", "RRTstar.goal_bias=0.1"]
    arguments += ["--jobs", "2", "--output", str(folder)]
    done = subprocess.run(
        [sys.executable, "-m", "cbagan_ompl.cli", *arguments], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    assert "leaked" not in done.stderr
    return Finished(arguments, folder, done.stdout)


def rows(database: Path, query: str) -> list[tuple[Any, ...]]:
    with closing(sqlite3.connect(database)) as connection:
        return connection.execute(query).fetchall()


def columns(database: Path, table: str) -> set[tuple[str, str]]:
    return {(row[1], row[2]) for row in rows(database, f"PRAGMA table_info({table})")}


def test_database_has_what_planner_arena_reads(finished: Finished) -> None:
    database = finished.folder / "benchmark.db"
    for table, wanted in COLUMNS.items():
        assert {name for name, _ in columns(database, table)} >= wanted
        assert rows(database, f"SELECT COUNT(*) FROM {table}")[0][0] > 0
    assert rows(database, "SELECT COUNT(*) FROM runs") == [(2 * 4 * 3,)]
    names = {name for (name,) in rows(database, "SELECT name FROM plannerConfigs")}
    assert names == {
        f"geometric_{planner}_{sampler}"
        for planner in ("RRT", "RRTstar")
        for sampler in ("uniform", "corridor")
    }
    views = rows(database, "SELECT name FROM sqlite_master WHERE type = 'view'")
    assert {name for (name,) in views} == {"bestPlannerConfigs", "bestPlannerConfigsPerExperiment"}


@pytest.mark.skipif(BOOST_PYTHON, reason="the wheel has no ompl_benchmark_statistics")
def test_own_tables_are_those_of_ompls_script(finished: Finished, tmp_path: Path) -> None:
    theirs, ours = finished.folder / "benchmark.db", tmp_path / "ours.db"
    write_tables(finished.logs, ours)
    views = ("bestPlannerConfigs", "bestPlannerConfigsPerExperiment")
    for table in (*COLUMNS, *views):
        assert columns(ours, table) == columns(theirs, table)
        names = ", ".join(sorted(name for name, _ in columns(ours, table)))
        query = f"SELECT {names} FROM {table}"
        assert rows(ours, query) == rows(theirs, query)


def test_only_the_other_samplers_draw(finished: Finished) -> None:
    for log in finished.logs:
        assert [len(planner.runs) for planner in log.planners] == [3] * 4
        for planner in log.planners:
            for run in planner.runs:
                draws = int(run["learned draws INTEGER"]), int(run["uniform draws INTEGER"])
                if planner.name.endswith("_uniform"):
                    assert draws == (0, 0)
                    assert float(run["inference time REAL"]) == 0
                else:
                    assert draws[0] > draws[1] > 0
                    assert float(run["inference time REAL"]) > 0


def test_measures_of_runs_agree(finished: Finished) -> None:
    for log in finished.logs:
        costs = [
            float(run["checked solution cost REAL"])
            for planner in log.planners
            for run in planner.runs
            if run["checked solution BOOLEAN"] == "1"
        ]
        assert len(costs) > 8
        given = 1.0 if log.name == "walls_1" else np.inf
        best = float(log.parameters["best_known_cost REAL"])
        assert best == pytest.approx(min(*costs, given))
        for planner in log.planners:
            for run in planner.runs:
                if run["checked solution BOOLEAN"] == "1":
                    cost = float(run["checked solution cost REAL"])
                    assert cost == pytest.approx(float(run["solution length REAL"]), rel=1e-4)
                    assert float(run["first solution cost REAL"]) >= cost * (1 - 1e-6)
                    assert 0 < float(run["first solution time REAL"]) <= float(run["time REAL"])
                    assert float(run["cost at 100 ms REAL"]) == pytest.approx(cost)
                assert int(run["collision checks INTEGER"]) > int(run["graph states INTEGER"]) / 2


def test_parameters_are_set(finished: Finished) -> None:
    for log in finished.logs:
        for planner in log.planners:
            assert "range = 10" in planner.settings
            bias = "0.1" if "RRTstar" in planner.name else "0.05"
            assert any(line.startswith(f"goal_bias = {bias}") for line in planner.settings)


def test_report(finished: Finished) -> None:
    summary = json.loads((finished.folder / "summary.json").read_text())
    assert summary["tasks"] == 2
    assert summary["failures"] == {}
    rows_of = {(row["planner"], row["sampler"]): row for row in summary["overall"]}
    assert len(rows_of) == 4
    assert rows_of["RRT", "uniform"]["ratios"] == {}
    assert rows_of["RRT", "corridor"]["ratios"]["first_solution_s"]["median"] > 0
    assert rows_of["RRT", "corridor"]["runs"] == 6
    assert list(summary["families"]) == ["walls"]
    text = (finished.folder / "summary.md").read_text()
    assert text == finished.printed.removesuffix("\n")
    assert "| RRTstar | corridor | " in text
    assert "cbagan-ompl benchmark" in text
    for name in ("success", "cost", "first_solution", "nodes", "ratio_first_solution"):
        image = cv2.imread(str(finished.folder / f"{name}.png"))
        assert image.std() > 10
        assert (finished.folder / f"{name}.pdf").stat().st_size > 5000


def test_resume_runs_only_what_is_missing(
    finished: Finished, capsys: pytest.CaptureFixture[str]
) -> None:
    first, second = sorted(finished.folder.glob("logs/*.log"))
    before = first.stat().st_mtime_ns
    second.unlink()
    assert main([*finished.arguments, "--resume"]) == 0
    assert first.stat().st_mtime_ns == before
    assert second.is_file()
    assert "2 tasks" in capsys.readouterr().out
    assert main(finished.arguments) == 2
    assert "--resume" in capsys.readouterr().err
    assert main([*finished.arguments, "--resume", "--runs", "4"]) == 2
    assert "other options" in capsys.readouterr().err


@pytest.mark.usefixtures("interruptible")
def test_interrupt_keeps_finished_tasks(map_folder: Path, tmp_path: Path) -> None:
    folder = tmp_path / "out"
    words = ["benchmark", str(map_folder / "walls.png"), "--tasks-per-map", "30", "--runs", "2"]
    words += ["--time", "0.3", "--planners", "RRTstar", "--samplers", "uniform,corridor"]
    words += ["--jobs", "1", "--output", str(folder)]
    status, said = interrupted(words, lambda: any(folder.glob("logs/*.log")))
    assert status == 130, said
    assert "Traceback" not in said
    assert said.endswith("interrupted\n")
    logs = list(folder.glob("logs/*"))
    assert 1 <= len(logs) < 30
    for log in logs:
        assert parse_log(log.read_text()).runs == 2


@pytest.mark.usefixtures("interruptible")
def test_an_interrupt_while_a_process_starts_leaves_none(
    two_walls: GridMap, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    settings = Settings(("RRTstar",), ("uniform",), runs=99)
    tasks = [BenchmarkTask(two_walls, i, Task((10, 10), (240, 240))) for i in range(3)]
    jobs = [Job(task, settings, tmp_path / f"{task.name}.log") for task in tasks]
    start, started = ForkServerProcess.start, []

    def start_and_interrupt(process: ForkServerProcess) -> None:
        start(process)
        started.append(process)
        if len(started) == 2:
            # In another thread, as a mask of the main one would make it come.
            pool.submit(signal.raise_signal, signal.SIGINT).result()

    monkeypatch.setattr(ForkServerProcess, "start", start_and_interrupt)
    with ThreadPoolExecutor(1) as pool, pytest.raises(KeyboardInterrupt):
        run_jobs(jobs, 2, show_progress=False)
    assert [process.exitcode for process in started] == [-signal.SIGTERM] * 2
    assert not list(tmp_path.iterdir())
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


class Aborting(BenchmarkTask):
    """Endpoints the process that it is sent to."""

    def __reduce__(self) -> Any:
        return os.abort, ()


def test_crashes_are_reported_with_their_task(two_walls: GridMap, tmp_path: Path) -> None:
    good = Settings(("RRT",), ("uniform", "corridor"), runs=1, time=0.2, range=20)
    bad = Settings(("Magic",), ("uniform",), runs=1)
    tasks = [
        kind(two_walls, number, Task((10, 10), (240, 240)))
        for number, kind in enumerate((Aborting, BenchmarkTask, BenchmarkTask))
    ]
    jobs = [
        Job(task, settings, tmp_path / f"{task.name}.log")
        for task, settings in zip(tasks, (good, bad, good), strict=True)
    ]
    failures = run_jobs(jobs, 2, show_progress=False)
    assert set(failures) == {"two_walls_0", "two_walls_1"}
    assert failures["two_walls_0"] == "ended by SIGABRT"
    assert "PlannerError: there is no planner 'Magic'" in failures["two_walls_1"].splitlines()[-1]
    assert [path.name for path in tmp_path.iterdir()] == ["two_walls_2.log"]


# Endpoints the process that the task is sent to with a status that says whether torch is there.
TELLING = """
from pathlib import Path
import numpy as np
from cbagan_ompl import GridMap, Task
from cbagan_ompl.benchmarking.runner import run_jobs
from cbagan_ompl.benchmarking.tasks import BenchmarkTask
from cbagan_ompl.benchmarking.settings import Settings
from cbagan_ompl.benchmarking.worker import Job

class Telling(BenchmarkTask):
    def __reduce__(self):
        return eval, ("__import__('os')._exit(3 if 'torch' in __import__('sys').modules else 4)",)

task = Telling(GridMap(np.ones((9, 9), bool)), 0, Task((1, 1), (8, 8)))
settings = Settings(("RRT",), ("uniform", "mine"), models={"mine": "mine.pt"})
print(run_jobs([Job(task, settings, Path("x.log"))], 1, show_progress=False))
"""


def test_torch_is_imported_before_the_tasks_and_not_by_each() -> None:
    pytest.importorskip("torch")
    done = subprocess.run([sys.executable, "-c", TELLING], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "exit status 3" in done.stdout


def test_every_task_needs_its_heat_map(two_walls: GridMap, tmp_path: Path) -> None:
    tasks = [BenchmarkTask(two_walls, i, Task((10, 10), (240, 240))) for i in range(2)]
    np.save(tmp_path / "two_walls_0.npy", np.ones(two_walls.shape, np.float32))
    settings = Settings(("RRT",), ("uniform", "peer"), heatmap_dirs={"peer": str(tmp_path)})
    Benchmark(tasks[:1], settings, tmp_path / "one")
    with pytest.raises(HeatmapError, match=r"neither .*two_walls_1\.npy"):
        Benchmark(tasks, settings, tmp_path / "both")
    assert not (tmp_path / "both").exists()


def test_errors_in_events_come_out(two_walls: GridMap) -> None:
    task = two_walls.check_task((10, 10), (240, 240))
    far = Heatmap.uniform(GridMap(np.ones((9, 9), bool), origin=(1e3, 1e3, 0.0)))
    entrants = [PlannerVariant("RRTstar", name, lambda *_: far) for name in ("one", "two")]
    options = RunOptions(5, 1.0)
    rounds: list[int] = []
    with pytest.raises(HeatmapError, match="coordinates of the map"):
        run_benchmark("x", two_walls, task, entrants, options, lambda: rounds.append(1))
    assert len(rounds) == 1


@pytest.mark.usefixtures("interruptible")
def test_interrupt_of_a_benchmark_in_this_process(two_walls: GridMap, corridor: Heatmap) -> None:
    task = two_walls.check_task((10, 10), (240, 240))
    entrants = [PlannerVariant("RRTstar", "corridor", lambda *_: corridor)]
    rounds = []

    def interrupt() -> None:
        rounds.append(1)
        os.kill(os.getpid(), signal.SIGINT)

    with pytest.raises(KeyboardInterrupt):
        run_benchmark("x", two_walls, task, entrants, RunOptions(9, 0.1), interrupt)
    assert len(rounds) == 1
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_unreached_planners_run_with_their_own_sampler_only(two_walls: GridMap) -> None:
    task = two_walls.check_task((10, 10), (240, 240))
    recording = run_benchmark(
        "x", two_walls, task, [PlannerVariant("RRTConnect", "uniform", None)], RunOptions(2, 1.0)
    )
    assert all(run.cost < np.inf for run in recording.runs["RRTConnect_uniform"])
    entrants = [PlannerVariant(UNREACHED, "corridor", Heatmap.corridor)]
    with pytest.raises(PlannerError, match=f"no hook reaches {UNREACHED}"):
        check_variants(two_walls, task, entrants, RunOptions(1, 0.1))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--planners", "Magic"], "no planner 'Magic'"),
        (["--planners", UNREACHED], f"no hook reaches {UNREACHED}"),
        (["--samplers", "uniform,magic"], "no sampler 'magic'"),
        (["--samplers", "uniform,uniform"], "each once"),
        (["--runs", "0"], "runs must be at least 1"),
        (["--time", "-1"], "time must be above 0"),
        (["--range", "0"], "range must be above 0"),
        (["--seed", "-1"], "seed must be"),
        (["--jobs", "0"], "jobs must be"),
        (["--uniform-fraction", "0"], "uniform_fraction"),
        (["--tasks-per-map", "0"], "at least 1"),
        (["--radius", "-1"], "radius"),
        (["--set", "RRT.magic=1"], "RRT has no parameter 'magic'"),
        (["--set", "RRT.range=far"], "setRange does not take 'far'"),
        (["--set", "RRT.range"], "PLANNER.parameter=value"),
        (["--set", "PRM.range=1"], "not among the planners"),
        (["--tasks", "missing.csv"], "missing.csv"),
        (["--model", "uniform=x.pt"], "cannot be called uniform"),
        (["--model", "x.pt"], "the learned sampler is not among the samplers"),
        (["--model", "peer=x.pt"], "x.pt: no such file"),
        (["--threshold", "7"], "threshold"),
        (["--heatmap-dir", "peer=."], "no heat map of the task: neither maze_0.npy"),
    ],
)
def test_bad_input_is_status_2(
    arguments: list[str],
    message: str,
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    common = ["--planners", "RRT", "--samplers", "uniform,corridor", "--output", "out"]
    assert main(["benchmark", "bundled:maze", *common, *arguments]) == 2
    printed = capsys.readouterr()
    assert message in printed.err
    assert "Traceback" not in printed.err
    assert not Path("out").exists()


def test_more_jobs_than_cores_are_warned_of(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    arguments = ["benchmark", "missing.png", "--jobs", "999", "--output", str(tmp_path / "out")]
    assert main(arguments) == 2
    said = capsys.readouterr().err
    assert "999 jobs share" in said
    assert "missing.png" in said
