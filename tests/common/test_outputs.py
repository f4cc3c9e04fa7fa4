"""What may be written over: never an input, nobody else's file unless that is asked for."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest
from matplotlib.figure import Figure

from cbagan_ompl import ConfigError, __version__
from cbagan_ompl.common.figures import write_figure
from cbagan_ompl.common.outputs import MADE_BY, check_distinct, check_output, write_report

NOT_OURS = {
    "notes.md": b"# Notes on cbagan-ompl\n\ncbagan-ompl 0.2.0 plans paths.\n",
    "map.json": b'{"tool": "cbagan-ompl 0.2.0"}',
    "own.json": b'{"values": {"made_by": "cbagan-ompl 0.2.0"}}',
    "map.png": b"\x89PNG\r\n\x1a\n" + bytes(300),
    "photo.jpg": b"\xff\xd8\xff\xe0" + b"cbagan-ompl 0.2.0" + bytes(300),
    "empty.json": b"",
    "large.bin": bytes(10**6),
}


def test_what_does_not_exist_may_be_written(tmp_path: Path) -> None:
    check_output(None)
    check_output(str(tmp_path / "new.json"), ["bundled:maze", ""])
    (tmp_path / "link").symlink_to(tmp_path / "new.json")
    check_output(str(tmp_path / "link"), [str(tmp_path)])
    with pytest.raises(ConfigError, match="its folder does not exist"):
        check_output(str(tmp_path / "none" / "a.json"))


def test_two_outputs_of_one_file(tmp_path: Path) -> None:
    (tmp_path / "link").symlink_to(tmp_path / "a.csv")
    check_distinct(None, str(tmp_path / "a.csv"), None, str(tmp_path / "a.png"))
    with pytest.raises(ConfigError, match=r"cannot write .*link twice"):
        check_distinct(str(tmp_path / "a.csv"), None, str(tmp_path / "link"))


@pytest.mark.parametrize("name", NOT_OURS)
def test_files_of_others_need_force(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    path.write_bytes(NOT_OURS[name])
    with pytest.raises(ConfigError, match=r"not known to be written by cbagan-ompl.*--force"):
        check_output(str(path))
    check_output(str(path), force=True)
    assert path.read_bytes() == NOT_OURS[name]


@pytest.mark.parametrize("suffix", ["png", "pdf", "svg", "jpg", "eps", "ps"])
def test_our_figures_are_known(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"figure.{suffix}"
    figure = Figure()
    figure.subplots().plot([0, 1])
    for _ in range(2):
        check_output(str(path))
        write_figure(figure, path)
    check_output(str(path))
    assert os.listdir(tmp_path) == [path.name]


def test_our_reports_are_known(tmp_path: Path) -> None:
    path = str(tmp_path / "report.json")
    for values in ({}, {"long": "x" * 200_000}):
        write_report(path, values)
        check_output(path)
        assert json.loads(Path(path).read_text()) == {"made_by": MADE_BY, **values}
    assert __version__ in MADE_BY


def test_reports_of_other_versions_are_known(tmp_path: Path) -> None:
    path = tmp_path / "report.json"
    path.write_text('{"made_by": "cbagan-ompl 9.1.0", "a": 1}')
    check_output(str(path))


@pytest.mark.parametrize("force", [False, True])
def test_inputs_are_never_written_over(tmp_path: Path, force: bool) -> None:
    given = tmp_path / "map.png"
    given.write_bytes(b"x")
    (tmp_path / "folder").mkdir()
    os.link(given, tmp_path / "hard.png")
    (tmp_path / "soft.png").symlink_to(given)
    for name in ("map.png", "./map.png", "folder/../map.png", "hard.png", "soft.png"):
        with pytest.raises(ConfigError, match="it is what the command reads"):
            check_output(f"{tmp_path}/{name}", ["none", str(given)], force=force)


def test_folders_and_devices_are_no_outputs(tmp_path: Path) -> None:
    for path in (str(tmp_path), "/dev/null", "/dev/stdout"):
        with pytest.raises(ConfigError):
            check_output(path)
