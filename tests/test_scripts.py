"""The scripts in benchmarks/ run."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest
from helpers.predictions import store

from cbagan_ompl.benchmarking.tasks import heatmap_file, select_tasks
from cbagan_ompl.datasets.dataset import load_dataset
from cbagan_ompl.datasets.generation import GenerationSettings, generate

SCRIPTS = Path(__file__).resolve().parents[1] / "benchmarks"


def script(name: str, *words: str) -> str:
    command = [sys.executable, str(SCRIPTS / name), *words]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    root = tmp_path_factory.mktemp("set") / "set"
    settings = GenerationSettings(maps=30, tasks=2, copies=10, runs=2, generators=("clutter",))
    generate(root, settings, jobs=1, resume=False, progress=False)
    # All tasks are for testing, so that every original has some.
    rows = [(root / f"{name}.csv").read_text().splitlines() for name in ("train", "test")]
    (root / "test.csv").write_text("\n".join([*rows[0], *rows[1][1:]]) + "\n")
    return root


def test_paper_suite(folder: Path, tmp_path: Path) -> None:
    store(folder / "sagan_test_predictions", folder, load_dataset(folder).test.region, listed=True)
    output = tmp_path / "suite"
    script("paper_suite.py", str(folder), "--tasks", "7", "--output", str(output))
    words = (output / "tasks.args").read_text().splitlines()
    maps = words[: words.index("--tasks")]
    tasks = select_tasks(maps, str(output / "tasks.csv"))
    assert len(tasks) == 7
    assert {task.task.family for task in tasks} <= {"original 0", "original 1", "original 2"}
    for task in tasks:
        heatmap = heatmap_file(str(output / "sagan_test_predictions"), task)
        # The region of a task holds its start.
        assert heatmap.values[int(task.task.start[1]), int(task.task.start[0])] == 1


def test_paper_tables(folder: Path, tmp_path: Path) -> None:
    pytest.importorskip("torch")
    from cbagan_ompl.inference.model_files import bundled_model

    report = tmp_path / "tables.json"
    words = [str(folder), "--model", f"bundled={bundled_model()}", "--runs", "2", "--tasks", "3"]
    printed = script("paper_tables.py", *words, "--json", str(report))
    assert "all test tasks" in printed
    result = json.loads(report.read_text())
    assert len(result["maps"]) == 3
    for samplers in (*result["maps"].values(), result["all_test_tasks"]):
        assert samplers["uniform"]["nodes_ratio"] == [1, 1, 1]
        assert samplers["bundled"]["nodes"][0] > 1
        assert samplers["bundled"]["inference_ms"][0] > 0


def test_readme_table(tmp_path: Path) -> None:
    interval = {"median": 0.5, "low": 0.25, "high": None}
    names = ("nodes", "first_solution_s", "within_5_percent_s", "within_5_percent_total_s")
    censored = {**dict.fromkeys(names, 0.1), "within_5_percent_s": 0.7}
    own = {"planner": "RRT", "sampler": "uniform", "success": 0.5, "ratios": {}}
    learned = {"planner": "RRT", "sampler": "learned", "success": 1.0, "censored": censored}
    own["censored"] = censored
    summary = {
        "ompl_version": "2.0.1",
        "overall": [own, {**learned, "ratios": dict.fromkeys(names, interval)}],
    }
    (tmp_path / "summary.json").write_text(json.dumps(summary))
    table = script("readme_table.py", str(tmp_path / "summary.json")).splitlines()
    assert table[2].startswith("| 2.0.1 | RRT | learned | 100.0% | 50.0% | 0.50 [0.25, ∞] |")
    assert table[2].split(" | ")[7] == "-"
    assert len(table) == 3
