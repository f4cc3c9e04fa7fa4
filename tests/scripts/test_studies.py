"""The studies in benchmarks/studies run."""

from __future__ import annotations

import json
import runpy
from pathlib import Path

import pytest
from helpers.predictions import store
from helpers.scripts import run_script

from cbagan_ompl.benchmarking.tasks import heatmap_file, select_tasks
from cbagan_ompl.datasets.dataset import load_dataset
from cbagan_ompl.datasets.generation import GenerationSettings, generate

STUDIES = Path(__file__).resolve().parents[2] / "benchmarks" / "studies"


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
    run_script(STUDIES / "paper_suite.py", str(folder), "--tasks", "7", "--output", str(output))
    words = (output / "tasks.args").read_text().splitlines()
    maps = words[: words.index("--tasks")]
    tasks = select_tasks(maps, str(output / "tasks.csv")).tasks
    assert len(tasks) == 7
    assert {task.task.family for task in tasks} <= {"original 0", "original 1", "original 2"}
    for task in tasks:
        heatmap = heatmap_file(str(output / "sagan_test_predictions"), task)
        # The region of a task holds its start.
        assert heatmap.values[int(task.task.start[1]), int(task.task.start[0])] == 1


@pytest.mark.slow
def test_paper_tables(folder: Path, tmp_path: Path) -> None:
    pytest.importorskip("torch")
    from cbagan_ompl.inference.bundled_models import bundled_model

    report = tmp_path / "tables.json"
    words = [str(folder), "--model", f"bundled={bundled_model()}", "--runs", "2", "--tasks", "3"]
    printed = run_script(STUDIES / "paper_tables.py", *words, "--json", str(report))
    assert "all test tasks" in printed
    result = json.loads(report.read_text())
    assert len(result["maps"]) == 3
    for samplers in (*result["maps"].values(), result["all_test_tasks"]):
        assert samplers["uniform"]["nodes_ratio"] == [1, 1, 1]
        assert samplers["bundled"]["nodes"][0] > 1
        assert samplers["bundled"]["inference_ms"][0] > 0
        assert samplers["bundled, not adapted"]["nodes"][0] > 1


@pytest.mark.slow
def test_paper_networks(folder: Path, tmp_path: Path) -> None:
    pytest.importorskip("torch")
    report = tmp_path / "networks.json"
    words = [str(folder), "--output", str(tmp_path / "runs"), "--seeds", "2", "--epochs", "1"]
    for _ in range(2):  # the second time all runs are complete
        run_script(
            STUDIES / "paper_networks.py", *words, "--tasks", "2", "--timing", "--json", str(report)
        )
    result = json.loads(report.read_text())
    assert result["epochs"] == 1
    networks = result["networks"]
    assert networks.keys() == {"cbagan", "sa", "ca", "none", "sagan", "segmentation"}
    for row in networks.values():
        assert row["epoch_s"] > 0
        assert [run["epoch"] for run in row["seeds"]] == [1, 1]
        assert row["iou"][1] <= row["seeds"][0]["scores"]["iou"] <= row["iou"][2]
    # The discriminators are no part of what is exported.
    assert networks["segmentation"]["parameters"] == networks["cbagan"]["parameters"]


def test_pixels_of_both_classes_are_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("torch")
    monkeypatch.syspath_prepend(str(STUDIES))
    right_pixels = runpy.run_path(str(STUDIES / "paper_networks.py"))["right_pixels"]
    # Of 100 pixels 20 are in the region; 15 of them are found, and 5 others are taken for it.
    scores = {"precision": 15 / 20, "recall": 15 / 20}
    assert right_pixels(scores, 0.2) == pytest.approx(0.9)
    # An empty prediction.
    assert right_pixels({"precision": 0.0, "recall": 0.0}, 0.18) == pytest.approx(0.82)


@pytest.mark.slow
def test_headings(tmp_path: Path) -> None:
    pytest.importorskip("torch")
    rows, report = tmp_path / "rows.jsonl", tmp_path / "headings.json"
    words = ["--count", "1", "--planners", "RRT", "--time", "0.05", "--rows", str(rows)]
    for _ in range(2):  # the second time every run is there already
        run_script(STUDIES / "headings.py", *words, "--json", str(report))
    summary = json.loads(report.read_text())["rows"]
    assert len(rows.read_text().splitlines()) == len(summary)


@pytest.mark.slow
def test_control(tmp_path: Path) -> None:
    pytest.importorskip("torch")
    rows, report = tmp_path / "rows.jsonl", tmp_path / "control.json"
    words = ["--count", "1", "--seeds", "1", "--time", "0.2", "--rows", str(rows)]
    for _ in range(2):  # the second time every run is there already
        run_script(STUDIES / "control.py", *words, "--json", str(report))
        assert len(rows.read_text().splitlines()) == 4
    summary = json.loads(report.read_text())["rows"]
    assert [row["sampler"] for row in summary] == ["OMPL's own", "learned"] * 2
    assert [row["ratio"] for row in summary[::2]] == [1, 1]


def test_replanning(tmp_path: Path) -> None:
    pytest.importorskip("torch")
    report = tmp_path / "replanning.json"
    words = ["bundled:rooms", "--tasks-per-map", "1", "--cycles", "4", "--json", str(report)]
    printed = run_script(STUDIES / "replanning.py", *words)
    result = json.loads(report.read_text())
    for scene in ("static", "obstacles"):
        assert f"{scene} kept" in printed
        assert result[scene].keys() == {"uniform", "fresh", "kept"}
        assert all(of["cycles"] == 4 for of in result[scene].values())
        assert result[scene]["uniform"]["kept"] == result[scene]["fresh"]["kept"] == 0
    assert result["static"]["kept"]["kept"] >= 0.5


@pytest.mark.slow
def test_rrtconnect(tmp_path: Path) -> None:
    pytest.importorskip("torch")
    report = tmp_path / "rrtconnect.json"
    words = ["--synthetic", "2", "--runs", "2", "--json", str(report)]
    printed = run_script(STUDIES / "rrtconnect.py", *words)
    assert "range 20 px" in printed
    rows = json.loads(report.read_text())["ranges"]["20 px"]["in Python"]
    assert rows["uniform"]["processor_ratio"][0] == 1
    assert rows["learned"]["our_samples"] > 0


def test_wrong_heatmaps(tmp_path: Path) -> None:
    report = tmp_path / "wrong.json"
    words = ["--planners", "RRT,RRTstar", "--runs", "2", "--json", str(report)]
    run_script(STUDIES / "wrong_heatmaps.py", *words)
    planners = json.loads(report.read_text())["planners"]
    assert set(planners) == {"RRT", "RRTstar"}
    assert all(row["solved"] == 1 for rows in planners.values() for row in rows.values())


@pytest.mark.slow
def test_generated_maps(tmp_path: Path) -> None:
    pytest.importorskip("torch")
    report = tmp_path / "generated.json"
    words = ["--model", "bundled=cbagan-worlds", "--not-learned", "--maps", "1"]
    printed = run_script(STUDIES / "generated_maps.py", *words, "--json", str(report))
    assert "| fine mazes |" in printed
    result = json.loads(report.read_text())
    assert result["models"].keys() == {"bundled", "not learned"}
    scores = result["models"]["not learned"]
    assert all(row["tasks"] == 4 for kind, row in scores.items() if kind != "all")
    assert scores["all"]["connected"] > 0.9
    assert scores["all"]["iou"] > 0.8
    assert scores["all"]["angles"]["median"] < 0.15


@pytest.mark.slow
def test_footprints(tmp_path: Path) -> None:
    pytest.importorskip("torch")
    report = tmp_path / "footprints.json"
    run_script(STUDIES / "footprints.py", "--tasks", "1", "--gaps", "1", "--json", str(report))
    result = json.loads(report.read_text())
    rows = {(row["tasks"], row["rectangle"], row["heatmap"]): row for row in result["rows"]}
    assert len(rows) == 3 * 3 * 9
    for group in ("random", "gaps", "border"):
        for rectangle in ("1:1", "2:1", "4:1"):
            everything = rows[group, rectangle, "all positions"]
            assert everything["recall"] == everything["within"] == [1, 1, 1]
            assert everything["ratio"][0] == pytest.approx(1)
            assert rows[group, rectangle, "as shipped"]["difference"]["iou"] == [0, 0, 0]
    # The slender rectangle does not get through where a disc of its width does.
    assert rows["gaps", "4:1", "corridor"]["within"] == [0, 0, 0]
    assert rows["border", "4:1", "border free"]["iou"][0] < 0.8
    assert rows["border", "4:1", "as shipped"]["within"] == [1, 1, 1]


@pytest.mark.slow
def test_overlap(tmp_path: Path) -> None:
    pytest.importorskip("torch")
    rows, report = tmp_path / "rows.jsonl", tmp_path / "overlap.json"
    words = ["bundled:rooms", "--tasks-per-map", "1", "--runs", "1", "--rows", str(rows)]
    for _ in range(2):  # the second time every run is there already
        run_script(STUDIES / "overlap.py", *words, "--json", str(report))
        assert len(rows.read_text().splitlines()) == 2
    summary = json.loads(report.read_text())["rows"]
    assert [row["way"] for row in summary] == ["uniform", "waiting", "overlap"] * 2
    assert [row["processor_ratio"] for row in summary[::3]] == [[1, 1, 1]] * 2


def test_ablation_compares_runs_of_the_same_seed(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("torch")
    monkeypatch.syspath_prepend(str(STUDIES))
    summarize = runpy.run_path(str(STUDIES / "ablation.py"))["summarize"]
    # What a seed adds to all variants is in the interval of the scores, not in the difference.
    scores = {
        name: [{"iou": base + seed} for seed in (0.0, 0.1, 0.2)]
        for name, base in (("whole", 0.5), ("without attention", 0.4))
    }
    result = summarize(scores)
    assert "difference" not in result["whole"]
    assert result["without attention"]["difference"] == pytest.approx([-0.1, -0.1, -0.1])
    # Student's factor for three values is 4.3027, their standard deviation 0.1.
    half = 4.3027 * 0.1 / 3**0.5
    assert result["whole"]["iou"] == pytest.approx([0.6, 0.6 - half, 0.6 + half], abs=1e-4)
