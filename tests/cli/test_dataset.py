from __future__ import annotations

import json
import signal
import tarfile
from pathlib import Path

import pytest
from helpers.interrupting import after, ended, interrupted
from helpers.training_set import assert_same_files, generate_small_set, write_training_set

from cbagan_ompl.cli import main


def test_generate_import_and_noise_commands(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["dataset", "generate", "--output", str(tmp_path / "set"), "--maps", "2"]
    words += [
        "--tasks",
        "2",
        "--runs",
        "2",
        "--generators",
        "ellipses,tl_shapes",
        "--split",
        "task",
    ]
    assert main(words) == 0
    assert "4 tasks written" in capsys.readouterr().out
    report = tmp_path / "noise.json"
    words = ["dataset", "noise", str(tmp_path / "set"), "--runs", "2", "--json", str(report)]
    assert main(words) == 0
    assert json.loads(report.read_text())["tasks"] == 1
    for more, message in (
        (("--tasks", "7"), "from 1 to 1, got 7"),
        (("--tasks", "1", "--seed", "-1"), "seed is a whole number of at least 0, got -1"),
        (("--runs", "0"), "runs is a whole number of at least 1, got 0"),
        (("--json", str(tmp_path / "none" / "x.json")), "its folder does not exist"),
    ):
        assert main([*words, *more]) == 2
        assert message in capsys.readouterr().err


def test_label_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["dataset", "label", "bundled:rooms", "--output", str(tmp_path / "set")]
    words += ["--size", "64", "--tasks", "4", "--label", "rrt", "--runs", "2"]
    report = tmp_path / "set.json"
    assert main([*words, "--json", str(report)]) == 0
    assert "4 tasks written" in capsys.readouterr().out
    values = json.loads(report.read_text())
    assert (values["maps"], values["side"], values["test_tasks"]) == (1, 64, 1)
    assert main(words) == 2
    assert "go on with it (--resume)" in capsys.readouterr().err
    twice = ["dataset", "label", *["bundled:rooms"] * 2, "--output", str(tmp_path / "twice")]
    assert main(twice) == 2
    assert "a map is given twice" in capsys.readouterr().err


def test_archives(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = generate_small_set(tmp_path / "small")
    archive = tmp_path / "small.tar.gz"
    with tarfile.open(archive, "w:gz") as tar:
        tar.add(folder, "inner/small")
    assert main(["dataset", "import", str(archive), "--json", str(tmp_path / "set.json")]) == 0
    assert "labels that connect start and goal (8):  100.00%" in capsys.readouterr().out
    values = json.loads((tmp_path / "set.json").read_text())
    assert (values["maps"], values["blocked_ends"], values["repeated_tasks"]) == (6, 0, 0)


def test_a_split_needs_a_copy(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    root = write_training_set(tmp_path / "set")
    words = ["dataset", "import", str(root), "--split", "task"]
    assert main(words) == 2
    assert "give --output as well" in capsys.readouterr().err
    assert main([*words, "--output", str(tmp_path / "copy"), "--seed", "-1"]) == 2
    assert "seed is a whole number of at least 0, got -1" in capsys.readouterr().err
    assert not (tmp_path / "copy").exists()


@pytest.mark.slow
@pytest.mark.usefixtures("interruptible")
def test_an_interrupt_says_how_to_continue(tmp_path: Path) -> None:
    words = ["dataset", "generate", "--output", str(tmp_path), "--maps", "500", "--runs", "5"]
    status, said = interrupted(words, lambda: any(tmp_path.glob("tasks/*.csv")))
    assert status == 130, said
    assert "--resume" in said
    assert "Traceback" not in said


@pytest.mark.usefixtures("interruptible")
@pytest.mark.parametrize(("number", "status"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
@pytest.mark.parametrize("jobs", ["1", "3"])
def test_signals_leave_no_process_of_generate_which_goes_on(
    tmp_path: Path, number: int, status: int, jobs: str
) -> None:
    words = ["dataset", "generate", "--maps", "12", "--tasks", "2", "--generators", "blocks"]
    words += ["--runs", "25", "--jobs", jobs, "--output"]
    root = tmp_path / "set"
    ended_with, said = ended([*words, str(root)], lambda: any(root.glob("tasks/*.csv")), number)
    assert ended_with == status, said
    assert said.splitlines()[-1].endswith("go on with the same command and --resume"), said
    assert "Traceback" not in said
    assert not list(root.rglob("*.tmp"))
    assert not (root / "train.csv").exists()
    assert main([*words, str(root), "--resume"]) == 0
    assert main([*words, str(tmp_path / "again")]) == 0
    assert_same_files(root, tmp_path / "again")


@pytest.mark.usefixtures("interruptible")
@pytest.mark.parametrize(("number", "status"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
@pytest.mark.parametrize("delay", [0.2, 0.6, 1.0, 1.5, 4.0])
def test_signals_at_any_time_leave_no_process_of_noise(
    tmp_path: Path, number: int, status: int, delay: float
) -> None:
    root = write_training_set(tmp_path / "set")
    words = ["dataset", "noise", str(root), "--runs", "100000", "--jobs", "2"]
    ended_with, said = ended(words, after(delay), number)
    assert ended_with == status, said
    assert said.splitlines()[-1] in ("interrupted", "terminated")
    assert "Traceback" not in said
