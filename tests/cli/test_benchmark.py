"""The command ``benchmark``."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import cv2
import numpy as np
import pytest
from helpers.benchmarks import Finished
from helpers.interrupting import interrupted

from cbagan_ompl import MapError
from cbagan_ompl.benchmarking.benchmark import Benchmark
from cbagan_ompl.benchmarking.logs import parse_log
from cbagan_ompl.benchmarking.tasks import select_tasks
from cbagan_ompl.cli import main
from cbagan_ompl.planning.compat import BOOST_PYTHON

# A planner that no hook reaches.
UNREACHED = "EITstar" if BOOST_PYTHON else "BITstar"
SUITES = Path(__file__).resolve().parents[2] / "benchmarks" / "suites"


@pytest.mark.slow
def test_resume_runs_only_what_is_missing(
    finished: Finished, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = shutil.copytree(finished.folder, tmp_path / "out")
    arguments = [*finished.arguments[:-1], str(folder)]
    first, second = sorted(folder.glob("logs/*.log"))
    before = first.stat().st_mtime_ns
    second.unlink()
    assert main([*arguments, "--resume"]) == 0
    assert first.stat().st_mtime_ns == before
    assert second.is_file()
    assert "2 tasks" in capsys.readouterr().out
    assert main(arguments) == 2
    assert "--resume" in capsys.readouterr().err
    assert main([*arguments, "--resume", "--runs", "4"]) == 2
    assert "other options" in capsys.readouterr().err


@pytest.mark.slow
@pytest.mark.usefixtures("interruptible")
def test_interrupt_keeps_finished_tasks(map_folder: Path, tmp_path: Path) -> None:
    folder = tmp_path / "out"
    words = ["benchmark", str(map_folder / "walls.png"), "--tasks-per-map", "30", "--runs", "2"]
    words += ["--time", "0.3", "--planners", "RRTstar", "--samplers", "uniform,corridor"]
    words += ["--jobs", "1", "--output", str(folder)]
    status, said = interrupted(words, lambda: any(folder.glob("logs/*.log")))
    assert status == 130, said
    assert "Traceback" not in said
    assert said.endswith("interrupted; go on with the same command and --resume\n")
    logs = list(folder.glob("logs/*"))
    assert 1 <= len(logs) < 30
    for log in logs:
        assert parse_log(log.read_text()).runs == 2


@pytest.mark.slow
def test_several_models_side_by_side(tmp_path: Path) -> None:
    pytest.importorskip("torch")
    from cbagan_ompl.inference.bundled_models import bundled_model

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
    assert select_tasks([str(path)], tasks_per_map=1, map_options=options).tasks[0].grid.free.all()
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
    assert set(settings["samplers"]) >= {
        *("uniform", "learned", "learned:adaptation=none", "corridor", "flat", "straight-line"),
    }
    assert settings["simplify"] == ["RRTConnect"]


def test_arguments_can_be_kept_in_a_file(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    suite = tmp_path / "suite.txt"
    suite.write_text("bundled:maze\n--runs=0\n")
    assert main(["benchmark", f"@{suite}", "--output", str(tmp_path / "out")]) == 2
    assert "runs is a whole number of at least 1" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--planners", "Magic"], "no planner 'Magic'"),
        (["--planners", UNREACHED], f"no hook reaches {UNREACHED}"),
        (["--samplers", "uniform,magic"], "no sampler 'magic'"),
        (["--samplers", "uniform,uniform"], "each once"),
        (["--runs", "0"], "runs is a whole number of at least 1"),
        (["--time", "-1"], "time must be above 0"),
        (["--range", "0"], "range must be above 0"),
        (["--seed", "-1"], "seed is a whole number of at least 0"),
        (["--jobs", "0"], "jobs is a whole number of at least 1"),
        (["--uniform-fraction", "0"], "uniform_fraction"),
        (["--tasks-per-map", "0"], "at least 1"),
        (["--radius", "-1"], "radius"),
        (["--within", "0"], "within"),
        (["--set", "RRT.magic=1"], "RRT has no parameter 'magic'"),
        (["--set", "RRT.range=far"], "setRange does not take 'far'"),
        (["--set", "RRT.range"], "PLANNER.parameter=value"),
        (["--set", "PRM.range=1"], "not among the planners"),
        (["--simplify", "PRM"], "simplify names 'PRM', which is not among the planners"),
        (["--samplers", "uniform,flat:magic=1"], "OPTION one of adaptation, sharpness"),
        (["--samplers", "uniform,flat:sharpness=-1"], "sampler 'flat:sharpness=-1': sharpness"),
        (["--samplers", "uniform,magic:sharpness=2"], "no sampler 'magic'"),
        (["--least-distance", "0"], "least distance must be above 0"),
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
