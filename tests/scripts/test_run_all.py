"""The command that makes the result files."""

from __future__ import annotations

import re
from pathlib import Path

from helpers.scripts import run_script

ROOT = Path(__file__).resolve().parents[2]
RUN_ALL = ROOT / "benchmarks" / "run_all.py"


def test_commands_are_listed_for_the_files_that_are_there(tmp_path: Path) -> None:
    maps = tmp_path / "maps" / "png"
    maps.mkdir(parents=True)
    for name in ("b", "a"):
        (maps / f"{name}.png").touch()
    words = ["--maps", str(maps.parent), "--output", str(tmp_path / "out"), "--list"]
    (command,) = run_script(RUN_ALL, *words, "--only", "real_maps").splitlines()
    files = [str(maps / f"{name}.png") for name in ("a", "b")]
    assert " ".join(files) in command
    assert str(maps.parent / "tasks.csv") in command
    assert "real_maps.args" in command
    assert len(run_script(RUN_ALL, *words).splitlines()) > 10


def test_every_result_file_has_its_command() -> None:
    listed = (ROOT / "benchmarks" / "README.md").read_text()
    for path in (ROOT / "benchmarks" / "results").glob("*.json"):
        name = re.sub(r"_ompl_[0-9.]+$", "", path.stem)
        assert name in listed or f"{name.split('_')[0]}_*" in listed, path.name
