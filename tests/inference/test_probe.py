from __future__ import annotations

import io
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

torch = pytest.importorskip("torch")

from cbagan_ompl import ModelError
from cbagan_ompl.inference import probe
from cbagan_ompl.inference.predictor import load_model

_FIRST = b"    height = torch.size(free, 2)\n"


def insert_code(model: Path, path: Path, code: bytes) -> Path:
    """Write the model with other code at the begin of its forward function, unlisted."""
    with zipfile.ZipFile(io.BytesIO(model.read_bytes())) as old, zipfile.ZipFile(path, "w") as new:
        for name in old.namelist():
            content = old.read(name)
            if name.endswith(".py"):
                content = content.replace(_FIRST, _FIRST + code)
            new.writestr(name, content)
    return path


@pytest.fixture(autouse=True)
def nothing_tried(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CBAGAN_OMPL_TRIED_MODELS", "")


LOOP = b"""\
    sum = torch.zeros([1], dtype=None, layout=None, device=None)
    for i in range(9000000000):
      sum = torch.add(sum, 1)
    print(sum)
"""
SPACE = b"""\
    space = torch.zeros([100000, 100000], dtype=None, layout=None, device=None)
    print(torch.size(space, 0))
"""


@pytest.mark.slow
@pytest.mark.parametrize(
    ("code", "message"),
    [
        (b"    deep = " + b"(" * 200_000 + b"1" + b")" * 200_000 + b"\n", "ended by SIGSEGV"),
        (LOOP, "more than 2 s for one prediction"),
        (SPACE, "not enough memory"),
        (b"    wrong = torch.nothing(1)\n", "RuntimeError"),
    ],
)
def test_code_that_crashes_hangs_or_takes_memory(
    exported: Path, tmp_path: Path, code: bytes, message: str
) -> None:
    path = insert_code(exported, tmp_path / "model.pt", code)
    with pytest.raises(ModelError, match=message):
        load_model(path)
    assert [file.name for file in tmp_path.iterdir()] == ["model.pt"], "no memory dump is left"


def test_unlisted_models_are_tried_once_for_each_content(
    exported: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shutil.copy(exported, tmp_path / "model.pt")
    load_model(tmp_path / "model.pt")
    monkeypatch.setattr(subprocess, "run", None)
    load_model(tmp_path / "model.pt")
    load_model(exported)  # a manifest lists it


def test_a_process_that_cannot_be_started(
    exported: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shutil.copy(exported, tmp_path / "model.pt")
    monkeypatch.setattr(sys, "executable", str(tmp_path / "none"))
    with pytest.raises(ModelError, match="that cannot be started"):
        load_model(tmp_path / "model.pt")


def test_modules_of_the_working_directory_are_not_loaded(
    exported: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shutil.copy(exported, tmp_path / "model.pt")
    (tmp_path / "torch.py").write_text("raise SystemExit('of somebody else')")
    monkeypatch.chdir(tmp_path)
    load_model("model.pt")


def test_what_is_no_model_at_all() -> None:
    with pytest.raises(ModelError, match="torch cannot load the model"):
        probe.try_model("model.pt", b"text", probe.Kind.REGION, 32)
