"""The scripts that make figures and measure speeds run."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import cv2
import pytest
from helpers.scripts import run_script

ROOT = Path(__file__).resolve().parents[2]
SCRIPTS = ROOT / "scripts"
STUDIES = ROOT / "benchmarks" / "studies"

# Runs in an environment of its own, with a package that is not ours.
FOREIGN = {"hybrid_astar.py"}

# Each by its path, as Python would begin to run it, in one process.
IMPORT_ALL = """
import runpy, sys
for path in sys.argv[1:]:
    sys.path.insert(0, path.rpartition("/")[0])
    runpy.run_path(path, run_name="imported")
    print(path)
"""


def test_all_scripts_find_what_they_import() -> None:
    pytest.importorskip("torch")
    files = [path for folder in (SCRIPTS, STUDIES) for path in sorted(folder.glob("*.py"))]
    paths = [path.as_posix() for path in files if path.name not in FOREIGN]
    command = [sys.executable, "-c", IMPORT_ALL, *paths]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout.split("\n")[:-1] == paths


def test_overhead() -> None:
    printed = run_script(SCRIPTS / "overhead.py", "--rounds", "1", "--time", "0.1")
    assert "iterations per second inside" in printed


@pytest.mark.slow
def test_search_speed(tmp_path: Path) -> None:
    pytest.importorskip("torch")
    words = ("--sizes", "64", "--tasks", "1", "--json", str(tmp_path / "speed.json"))
    printed = run_script(SCRIPTS / "search_speed.py", *words)
    assert "64 px: path" in printed
    result = json.loads((tmp_path / "speed.json").read_text())
    assert all(value > 0 for value in result["sizes"]["64"]["ms"].values())


@pytest.mark.slow
def test_inference_speed(tmp_path: Path) -> None:
    pytest.importorskip("torch")
    words = ("--sizes", "64", "--model", "cbagan", "--json", str(tmp_path / "speed.json"))
    assert "| 64 px | cbagan |" in run_script(SCRIPTS / "inference_speed.py", *words)
    row = json.loads((tmp_path / "speed.json").read_text())["sizes"]["64"]["cbagan"]
    assert row.pop("memory") >= 0
    assert set(row) == {"first", "next", "of 64", "attach"}
    assert min(row.values()) > 0


@pytest.mark.slow
def test_calibrate(tmp_path: Path) -> None:
    pytest.importorskip("torch")
    tasks = tmp_path / "tasks.csv"
    tasks.write_text("map,start_x,start_y,goal_x,goal_y,family\nrooms,20,20,230,230,indoors\n")
    words = ["cbagan", "bundled:rooms", "--tasks", str(tasks), "--maps", "2"]
    printed = run_script(
        SCRIPTS / "calibrate.py", *words, "--probability", "0.6", "--json", str(tmp_path / "c.json")
    )
    result = json.loads((tmp_path / "c.json").read_text())
    assert "coverage" in printed
    assert set(result["files"]["families"]) == {"indoors"}
    assert result["maps"] == result["generated"]["tasks"] == 2 * len(result["families"])
    assert 0 <= result["threshold"] <= 1
    low, high = result["interval"]
    assert 0 < low < 0.6 < high < 1


@pytest.mark.slow
def test_startup_time() -> None:
    pytest.importorskip("torch")
    printed = run_script(SCRIPTS / "startup_time.py", str(ROOT), str(ROOT), "--runs", "1")
    rows = [line.split() for line in printed.splitlines()[1:]]
    assert [row[-4] for row in rows][-3:] == ["uniform", "corridor", "learned"]
    assert all(0.1 < float(row[-1]) < 10 for row in rows)


@pytest.mark.slow
def test_gallery(tmp_path: Path) -> None:
    pytest.importorskip("torch")
    run_script(SCRIPTS / "gallery.py", "--output", str(tmp_path / "regions.png"))
    assert cv2.imread(str(tmp_path / "regions.png")).std() > 10


@pytest.mark.slow
def test_training_speed() -> None:
    pytest.importorskip("torch")
    words = ("--batch-size", "1", "--size", "32", "--repeats", "1", "--device", "cpu")
    printed = run_script(SCRIPTS / "training_speed.py", *words)
    assert printed.count("ms a step") == 4
