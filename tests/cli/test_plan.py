from __future__ import annotations

import json
import os
import shlex
import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest

from cbagan_ompl import GridMap, Heatmap, tasks_of
from cbagan_ompl.cli import main

MAP = "bundled:walls_with_gaps"
QUICK = ["plan", MAP, "--sampler", "corridor", "--planner", "RRT", "--time", "5", "--range", "20"]


def test_plan_writes_figure_and_json(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    figure, report = tmp_path / "plan.png", tmp_path / "plan.json"
    status = main([*QUICK, "--seed", "1", "--output", str(figure), "--json", str(report)])
    printed = capsys.readouterr()
    assert status == 0
    assert printed.err == ""
    assert str(figure) in printed.out
    values = json.loads(report.read_text())
    assert values["solved"] is True
    assert values["sampler"] == "corridor"
    assert f"{values['cost']:.6g}" in printed.out
    grid = GridMap.load(MAP)
    assert grid.path_is_free(values["path"])
    task = tasks_of(MAP, grid)[0]
    np.testing.assert_array_equal(values["start"], task.start)
    image = cv2.imread(str(figure))
    assert min(image.shape[:2]) > 500


def test_auto_says_what_it_took(capsys: pytest.CaptureFixture[str]) -> None:
    assert (
        main(["plan", "bundled:maze", "--planner", "RRT", "--sampler", "auto", "--seed", "1"]) < 2
    )
    printed = capsys.readouterr().out
    assert "\nsampler        corridor, hook" in printed


def test_learned_is_the_default(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["plan", MAP, "--time", "0.5", "--range", "20", "--seed", "1"]) == 0
    assert "learned, hook" in capsys.readouterr().out


def test_start_and_goal_and_seed(tmp_path: Path) -> None:
    grid = GridMap.load(MAP)
    (x0, y0), (x1, y1) = (task := tasks_of(MAP, grid)[1]).start, task.goal
    reports = []
    for name in ("one.json", "two.json"):
        endpoints = ["--start", f"{x0},{y0}", "--goal", f"{x1},{y1}", "--seed", "7"]
        assert main([*QUICK, *endpoints, "--json", str(tmp_path / name)]) == 0
        reports.append(json.loads((tmp_path / name).read_text()))
    assert reports[0]["path"] == reports[1]["path"]
    assert main([*QUICK, "--task", "1", "--seed", "7", "--json", str(tmp_path / "three.json")]) == 0
    assert json.loads((tmp_path / "three.json").read_text())["path"] == reports[0]["path"]


def test_negative_coordinates(tmp_path: Path) -> None:
    cv2.imwrite(str(tmp_path / "hall.png"), np.full((40, 60), 254, np.uint8))
    (tmp_path / "hall.yaml").write_text(
        "image: hall.png\nresolution: 0.1\norigin: [-3, -2, 0]\nnegate: 0\n"
        "occupied_thresh: 0.65\nfree_thresh: 0.25\n"
    )
    arguments = ["plan", str(tmp_path / "hall.yaml"), "--sampler", "corridor", "--planner", "RRT"]
    report = tmp_path / "plan.json"
    endpoints = ["--start", "-2.5,-1.5", "--goal", "-1,.5"]
    assert main([*arguments, *endpoints, "--json", str(report)]) == 0
    assert json.loads(report.read_text())["start"] == [-2.5, -1.5]


def test_snap_is_printed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    report = tmp_path / "plan.json"
    grid = GridMap.load(MAP)
    task = tasks_of(MAP, grid)[0]
    row, column = np.argwhere(~grid.free)[100]
    words = [*QUICK, "--start", f"{column}.5,{row}.5", "--goal", "{},{}".format(*task.goal)]
    assert main(words) == 2
    assert "is in an obstacle" in capsys.readouterr().err
    assert main([*words, "--snap", "30", "--json", str(report)]) == 0
    values = json.loads(report.read_text())
    move = values["snapped"]["start"]
    assert move["given"] == [column + 0.5, row + 0.5]
    line = f"start moved    by {move['distance']:.4g}, from {column}.5,{row}.5 to "
    assert line in capsys.readouterr().out
    assert grid.is_free(values["start"])


@pytest.mark.parametrize(
    ("sampler", "kind"),
    [("corridor", " from the corridor, "), ("straight-line", " from the straight line, ")],
)
def test_samples_are_called_by_where_they_are_from(
    sampler: str, kind: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    report = tmp_path / "plan.json"
    words = ["plan", MAP, "--sampler", sampler, "--planner", "RRT", "--range", "20"]
    main([*words, "--json", str(report)])
    printed = capsys.readouterr().out
    assert kind in printed
    assert "learned" not in printed
    assert json.loads(report.read_text())["sample_counts"].keys() == {"learned", "uniform"}


def test_uniform_has_samples_of_ompl(capsys: pytest.CaptureFixture[str]) -> None:
    main(["plan", MAP, "--sampler", "uniform", "--planner", "RRT", "--range", "20"])
    printed = capsys.readouterr().out
    assert "samples        OMPL's own" in printed
    assert "learned" not in printed


def test_csv(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    table, report = tmp_path / "path.csv", tmp_path / "plan.json"
    assert main([*QUICK, "--csv", str(table), "--json", str(report)]) == 0
    lines = table.read_text().splitlines()
    assert lines[0] == "x,y,index"
    path = json.loads(report.read_text())["path"]
    assert [[float(x) for x in line.split(",")[:2]] for line in lines[1:]] == path
    assert main([*QUICK, "--csv", str(table)]) == 0, "ours"
    table.write_text("time,voltage\n0,1\n")
    assert main([*QUICK, "--csv", str(table)]) == 2
    assert "say --force" in capsys.readouterr().err
    assert main([*QUICK, "--csv", "missing/path.csv"]) == 2


def test_warnings_are_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    cv2.imwrite(str(tmp_path / "hall.pgm"), np.full((40, 60), 205, np.uint8))
    (tmp_path / "hall.yaml").write_text(
        "image: hall.pgm\nresolution: 1\norigin: [0, 0, 0]\nnegate: 0\n"
        "occupied_thresh: 0.65\nfree_thresh: 0.25\n"
    )
    words = ["plan", str(tmp_path / "hall.yaml"), "--sampler", "corridor", "--planner", "RRT"]
    words += ["--start", "5,5", "--goal", "50,30"]
    assert main(words) == 0
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("cbagan-ompl plan: warning: ")
    assert "100% of the pixels have the gray level 205" in line
    assert main([*words, "--unknown-is-free"]) == 0
    assert capsys.readouterr().err == ""


def test_heatmap_file(tmp_path: Path) -> None:
    grid = GridMap.load(MAP)
    task = tasks_of(MAP, grid)[0]
    np.save(tmp_path / "heat.npy", Heatmap.corridor(grid, task.start, task.goal).values)
    arguments = ["plan", MAP, "--heatmap", str(tmp_path / "heat.npy"), "--planner", "RRT"]
    report = tmp_path / "plan.json"
    assert main([*arguments, "--time", "5", "--json", str(report)]) == 0
    assert json.loads(report.read_text())["sampler"] == "heatmap"


def test_unsolved_is_status_1(capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["plan", MAP, "--sampler", "uniform", "--iterations", "3", "--seed", "1"]
    assert main(arguments) == 1
    assert "solved         no" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["plan", "missing.png"], "missing.png"),
        (["plan", "bundled:nothing"], "walls_with_gaps"),
        (["plan", MAP, "--task", "99"], "tasks 0 to 3, there is no task 99"),
        (["plan", MAP, "--task", "-1"], "there is no task -1"),
        (["plan", MAP, "--start", "20,20"], "both --start and --goal"),
        (["plan", MAP, "--task", "0", "--start", "1,1", "--goal", "2,2"], "--task alone"),
        (["plan", MAP, "--planner", "Magic"], "no planner 'Magic'"),
        (["plan", MAP, "--sampler", "magic"], "no sampler 'magic'"),
        (["plan", MAP, "--heatmap", "missing.npy"], "missing.npy"),
        (["plan", MAP, "--model", "missing.pt"], "missing.pt"),
        (["plan", MAP, "--threshold", "7"], "threshold"),
        ([*QUICK, "--output", "plan.xyz"], "suffix"),
        ([*QUICK, "--output", "missing/plan.png"], "missing/plan.png"),
        ([*QUICK, "--json", "missing/plan.json"], "missing/plan.json"),
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
    assert main(arguments) == 2
    printed = capsys.readouterr()
    assert message in printed.err
    assert "Traceback" not in printed.err


@pytest.mark.parametrize(
    "arguments", [["plan", MAP, "--start", "1;2"], ["plan"], [], ["plan", MAP, "--bogus"]]
)
def test_usage_errors_are_status_2(
    arguments: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as exit_:
        main(arguments)
    assert exit_.value.code == 2
    assert "usage: cbagan-ompl" in capsys.readouterr().err


@pytest.mark.parametrize("command", ["plan", "train", "export"])
def test_help(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as exit_:
        main([command, "--help"])
    assert exit_.value.code == 0
    assert len(capsys.readouterr().out) > 500


def test_reader_that_goes_away() -> None:
    command = [sys.executable, "-m", "cbagan_ompl.cli", *QUICK]
    pipeline = f"{shlex.join(command)} | true; exit ${{PIPESTATUS[0]}}"
    done = subprocess.run(
        ["bash", "-c", pipeline], capture_output=True, text=True, timeout=60, check=False
    )
    assert done.returncode in (0, 141)
    assert done.stderr == ""


@pytest.mark.parametrize(
    "words",
    [
        ["plan", "bundled:maze"],
        ["dataset", "import", "set"],
        ["train", "set", "--output", "run"],
        ["export", "best.pt", "--output", "model.pt"],
        ["evaluate", "--dataset", "set"],
    ],
)
def test_json_without_its_folder_is_an_error_before_the_work(
    words: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "none" / "x.json"
    assert main([*words, "--json", str(path)]) == 2
    assert f"cannot write {path}: its folder does not exist" in capsys.readouterr().err


@pytest.mark.parametrize("backend", ["module://matplotlib_inline.backend_inline", "no such"])
def test_any_backend_in_the_environment(tmp_path: Path, backend: str) -> None:
    """A notebook exports one that its subprocesses cannot load."""
    figure = tmp_path / "plan.png"
    command = [sys.executable, "-m", "cbagan_ompl.cli", *QUICK, "--output", str(figure)]
    done = subprocess.run(
        command, env={**os.environ, "MPLBACKEND": backend}, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    assert figure.stat().st_size > 0


def test_no_figure_no_matplotlib() -> None:
    code = (
        "import sys; from cbagan_ompl.cli import main;"
        f"status = main({QUICK!r}); sys.exit(status or 'matplotlib' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", code], capture_output=True).returncode == 0


def test_no_tree(tmp_path: Path) -> None:
    sizes = []
    for words in ([], ["--no-tree"]):
        path = tmp_path / "plan.svg"
        assert main([*QUICK, "--seed", "0", "--output", str(path), *words]) == 0
        sizes.append(path.stat().st_size)
    assert sizes[1] < sizes[0]


@pytest.mark.parametrize("suffix", ["png", "pdf", "svg", "jpg"])
def test_only_figures_of_our_own_are_replaced(
    tmp_path: Path, suffix: str, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / f"plan.{suffix}"
    path.write_bytes(b"somebody's holiday")
    assert main([*QUICK, "--output", str(path)]) == 2
    assert "say --force" in capsys.readouterr().err
    assert path.read_bytes() == b"somebody's holiday"
    assert main([*QUICK, "--output", str(path), "--force"]) == 0
    assert main([*QUICK, "--output", str(path)]) == 0, "ours"


def test_each_output_is_a_file_of_its_own(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "plan"
    assert main([*QUICK, "--json", str(path), "--csv", str(path)]) == 2
    assert "twice: give each output a name of its own" in capsys.readouterr().err
    assert not path.exists()


def test_no_input_is_replaced(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "map.png"
    cv2.imwrite(str(path), np.full((40, 40), 255, np.uint8))
    before = path.read_bytes()
    words = ["plan", str(path), "--start", "5,5", "--goal", "35,35", "--sampler", "uniform"]
    for option in ("--output", "--json"):
        for force in ([], ["--force"]):
            assert main([*words, option, str(path), *force]) == 2
            assert "it is what the command reads" in capsys.readouterr().err
    assert path.read_bytes() == before


def test_what_a_map_names_is_an_input(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    image, scenes = tmp_path / "pixels.png", tmp_path / "cells.map.scen"
    cv2.imwrite(str(image), np.full((40, 40), 255, np.uint8))
    (tmp_path / "hall.yaml").write_text(
        "image: pixels.png\nresolution: 1\norigin: [0, 0, 0]\nnegate: 0\n"
        "occupied_thresh: 0.65\nfree_thresh: 0.2\n"
    )
    (tmp_path / "cells.map").write_text("type octile\nheight 9\nwidth 9\nmap\n" + "." * 9 + "\n")
    scenes.write_text("version 1\n")
    for name, path in (("hall.yaml", image), ("cells.map", scenes)):
        before = path.read_bytes()
        words = ["plan", str(tmp_path / name), "--start", "5,5", "--goal", "35,35"]
        for option in ["--json", *(["--output"] if path == image else [])]:
            assert main([*words, option, str(path), "--force"]) == 2
            assert "it is what the command reads" in capsys.readouterr().err
        assert path.read_bytes() == before


def test_reports_are_replaced_by_reports_alone(tmp_path: Path) -> None:
    path = tmp_path / "plan.json"
    path.write_text('{"mine": 1}')
    assert main([*QUICK, "--json", str(path)]) == 2
    path.unlink()
    for _ in range(2):
        assert main([*QUICK, "--json", str(path)]) == 0
    assert json.loads(path.read_text())["made_by"].startswith("cbagan-ompl ")


def test_our_own_errors_have_a_status_of_their_own(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    import cbagan_ompl.planning.plan

    def broken(*_: object, **__: object) -> None:
        raise ZeroDivisionError("by zero")

    monkeypatch.setattr(cbagan_ompl.planning.plan, "plan", broken)
    assert main(QUICK) == 70
    said = capsys.readouterr().err
    assert "an error of cbagan-ompl itself: ZeroDivisionError: by zero" in said
    assert "Traceback" not in said
    assert main([*QUICK, "--debug"]) == 70
    assert "Traceback" in capsys.readouterr().err
