from __future__ import annotations

import json
import tarfile
from pathlib import Path

import pytest
from helpers.interrupting import interrupted
from helpers.training_set import generate_small_set, write_training_set

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
        (("--tasks", "1", "--seed", "-1"), "seed must be at least 0, got -1"),
        (("--runs", "0"), "runs and range must be positive, got 0"),
        (("--json", str(tmp_path / "none" / "x.json")), "its folder does not exist"),
    ):
        assert main([*words, *more]) == 2
        assert message in capsys.readouterr().err


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
    assert "seed must be at least 0, got -1" in capsys.readouterr().err
    assert not (tmp_path / "copy").exists()


@pytest.mark.slow
@pytest.mark.usefixtures("interruptible")
def test_an_interrupt_says_how_to_continue(tmp_path: Path) -> None:
    words = ["dataset", "generate", "--output", str(tmp_path), "--maps", "500", "--runs", "5"]
    status, said = interrupted(words, lambda: any(tmp_path.glob("tasks/*.csv")))
    assert status == 130, said
    assert "--resume" in said
    assert "Traceback" not in said
