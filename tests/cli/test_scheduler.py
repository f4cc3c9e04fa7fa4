"""Commands with ``--scheduler``: two workers, processes of this machine, write what none would."""

from __future__ import annotations

import json
import platform
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("distributed")

from helpers.benchmarks import write_map
from helpers.cluster_calls import Aborting
from helpers.clusters import Cluster, cluster_of
from helpers.interrupting import interrupted, processes_of
from helpers.training_set import SMALL, assert_same_files, generate_small_set, write_training_set

from cbagan_ompl import GridMap, Task
from cbagan_ompl.benchmarking.logs import ExperimentLog, parse_log
from cbagan_ompl.benchmarking.remote import run_jobs_remotely
from cbagan_ompl.benchmarking.settings import Settings
from cbagan_ompl.benchmarking.tasks import BenchmarkTask
from cbagan_ompl.benchmarking.worker import Job
from cbagan_ompl.cli import main
from cbagan_ompl.common.cluster import ClusterExecutor
from cbagan_ompl.datasets.generation import generate
from cbagan_ompl.planning.workspace import Workspace

# Only against hanging: a busy machine may take long.
_PATIENCE_S = 60


@pytest.fixture(scope="module")
def cluster(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Cluster]:
    with cluster_of(tmp_path_factory.mktemp("cluster"), workers=2) as cluster:
        yield cluster


def logs_in(folder: Path) -> list[ExperimentLog]:
    return [parse_log(path.read_text()) for path in sorted(folder.glob("logs/*.log"))]


def test_benchmark_is_the_same_on_workers(cluster: Cluster, tmp_path: Path) -> None:
    write_map(tmp_path)
    heatmaps = tmp_path / "heatmaps"
    heatmaps.mkdir()
    for number in range(2):
        np.save(heatmaps / f"walls_{number}.npy", np.ones((100, 100), np.float32))
    # Each run ends with its first path, far from the limit of time.
    words = ["benchmark", str(tmp_path / "walls.png"), "--tasks", str(tmp_path / "tasks.csv")]
    words += ["--planners", "RRT", "--samplers", "uniform,corridor", "--range", "10"]
    words += ["--heatmap-dir", f"peer={heatmaps}", "--runs", "2", "--time", "60"]
    local, remote = tmp_path / "local", tmp_path / "remote"
    assert main([*words, "--output", str(local), "--jobs", "2"]) == 0
    assert main([*words, "--output", str(remote), "--scheduler", cluster.address]) == 0
    names = ("nodes", "draws", "graph states", "solved", "collision")
    for here, there in zip(logs_in(local), logs_in(remote), strict=True):
        assert (here.name, here.seed, here.parameters) == (there.name, there.seed, there.parameters)
        for one, other in zip(here.planners, there.planners, strict=True):
            counts = [
                [
                    {key: value for key, value in run.items() if any(n in key for n in names)}
                    for run in planner.runs
                ]
                for planner in (one, other)
            ]
            assert counts[0] == counts[1]
            assert any("draws" in key for key in counts[0][0])
    assert json.loads((remote / "settings.json").read_text()) == json.loads(
        (local / "settings.json").read_text()
    )
    assert json.loads((remote / "summary.json").read_text())["hosts"] == {platform.node(): 2}

    first = next(remote.glob("logs/*.log"))
    first.unlink()
    words += ["--output", str(remote), "--scheduler", cluster.address, "--resume"]
    assert main(words) == 0
    assert first.is_file()


def test_a_cluster_that_cannot_be_used_leaves_no_folder(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    output = tmp_path / "results"
    words = ["benchmark", "bundled:maze", "--samplers", "uniform", "--output", str(output)]
    assert main([*words, "--scheduler", "nowhere://host"]) == 2
    assert "no scheduler answers at 'nowhere://host'" in capsys.readouterr().err
    assert not output.exists()


def test_tasks_that_fail_are_reported_alone(
    cluster: Cluster, two_walls: GridMap, tmp_path: Path
) -> None:
    good = Settings(("RRT",), ("uniform",), runs=1, time=5, range=20)
    bad = Settings(("Magic",), ("uniform",), runs=1)
    tasks = [
        kind(Workspace(two_walls), number, Task((10, 10), (240, 240)))
        for number, kind in enumerate((Aborting, BenchmarkTask, BenchmarkTask))
    ]
    jobs = [
        Job(task, settings, tmp_path / f"{task.name}.log")
        for task, settings in zip(tasks, (good, bad, good), strict=True)
    ]
    with ClusterExecutor(str(cluster.file)) as executor:
        failures = run_jobs_remotely(jobs, executor, show_progress=False)
    assert set(failures) == {"two_walls_0", "two_walls_1"}
    assert failures["two_walls_0"] == "ended by SIGABRT"
    assert "PlannerError: there is no planner 'Magic'" in failures["two_walls_1"].splitlines()[-1]
    assert [path.name for path in tmp_path.iterdir()] == ["two_walls_2.log"]


def test_a_set_is_the_same_although_a_worker_dies(tmp_path: Path) -> None:
    local, remote = generate_small_set(tmp_path / "local"), tmp_path / "remote"

    def kill_after_the_first_map() -> None:
        end = time.monotonic() + _PATIENCE_S
        while not any(remote.glob("tasks/*.csv")) and time.monotonic() < end:
            time.sleep(0.01)
        cluster.kill_worker(0)

    with cluster_of(tmp_path, workers=2) as cluster, ThreadPoolExecutor(1) as pool:
        killing = pool.submit(kill_after_the_first_map)
        with ClusterExecutor(str(cluster.file)) as executor:
            generate(remote, SMALL, 1, resume=False, progress=False, executor=executor)
        killing.result()
    assert_same_files(local, remote)


@pytest.mark.usefixtures("interruptible")
def test_an_interrupt_ends_what_workers_do(cluster: Cluster, tmp_path: Path) -> None:
    root = tmp_path / "set"
    words = ["dataset", "generate", "--maps", "12", "--tasks", "1", "--runs", "3", "--seed", "1"]
    words += ["--scheduler", str(cluster.file), "--output", str(root)]
    status, said = interrupted(words, lambda: any(root.glob("tasks/*.csv")))
    assert status == 130, said
    assert "Traceback" not in said
    assert said.endswith("interrupted; go on with the same command and --resume\n")
    end = time.monotonic() + _PATIENCE_S
    while len(children_of(cluster)) > 0 and time.monotonic() < end:
        time.sleep(0.02)
    assert not children_of(cluster)
    assert not (root / "train.csv").exists()
    assert main([*words, "--resume"]) == 0
    settings = replace(SMALL, maps=12, tasks=1, runs=3, seed=1, copies=1)
    settings = replace(settings, generators=type(SMALL)().generators)
    generate(tmp_path / "local", settings, 2, resume=False, progress=False)
    assert_same_files(tmp_path / "local", root)


def children_of(cluster: Cluster) -> list[int]:
    """Processes that run calls; the workers themselves are not meant."""
    workers = [worker.pid for worker in cluster.workers]
    return [pid for worker in workers for pid in processes_of(worker) if pid not in workers]


@pytest.mark.slow
def test_scores_are_the_same_on_workers(cluster: Cluster, tmp_path: Path) -> None:
    pytest.importorskip("torch")
    root = write_training_set(tmp_path / "set")
    words = ["evaluate", "--dataset", str(root)]
    assert main([*words, "--json", str(tmp_path / "local.json")]) == 0
    words += ["--scheduler", cluster.address, "--json", str(tmp_path / "remote.json")]
    assert main(words) == 0
    local, remote = (
        json.loads((tmp_path / f"{name}.json").read_text())["predictions"]
        for name in ("local", "remote")
    )
    assert list(local) == list(remote)
    for name, values in local.items():
        assert remote[name]["scores"] == values["scores"]
    assert remote["cbagan-worlds"]["batched_hosts"] == [platform.node()]
    assert remote["cbagan-worlds"]["inference_host"] == platform.node()


def test_noise_is_the_same_on_workers(cluster: Cluster, tmp_path: Path) -> None:
    root = write_training_set(tmp_path / "set")
    words = ["dataset", "noise", str(root), "--runs", "3", "--tasks", "3"]
    assert main([*words, "--json", str(tmp_path / "local.json")]) == 0
    words += ["--scheduler", cluster.address, "--json", str(tmp_path / "remote.json")]
    assert main(words) == 0
    assert (tmp_path / "local.json").read_text() == (tmp_path / "remote.json").read_text()


@pytest.mark.parametrize("label", ["rrt", "geodesic"])
def test_labels_of_own_maps_are_the_same_on_workers(
    cluster: Cluster, tmp_path: Path, label: str
) -> None:
    words = ["dataset", "label", "bundled:maze", "bundled:rooms", "--size", "64", "--tasks", "2"]
    words += ["--label", label, "--runs", "3", "--seed", "1"]
    local, remote = tmp_path / "local", tmp_path / "remote"
    assert main([*words, "--output", str(local)]) == 0
    assert main([*words, "--output", str(remote), "--scheduler", cluster.address]) == 0
    assert_same_files(local, remote)
