"""Damaged and crafted models: a clear error, at little cost, and the process lives on."""

from __future__ import annotations

import json
import os
import shutil
import zipfile
from collections.abc import Callable
from pathlib import Path

import pytest
from helpers.attacks import assert_refused, run_commands
from helpers.damaged_archives import damaged_members
from helpers.damaged_models import load_in_one_process
from helpers.fuzzing import mutations

torch = pytest.importorskip("torch")

from cbagan_ompl import ModelError
from cbagan_ompl.inference.model_files import RECORD_NAME, read_record
from cbagan_ompl.inference.predictor import load_model


@pytest.mark.slow
def test_no_damage_ends_the_process(exported: Path, tmp_path: Path) -> None:
    valid = exported.read_bytes()
    damaged = [*mutations([valid], 200, seed=1), *damaged_members(valid, 400, seed=2)]
    outcomes = load_in_one_process([valid, *damaged], ".pt", tmp_path)
    assert outcomes["loaded"] >= 1, "the model itself"
    assert outcomes["refused"] > 300
    assert outcomes["loaded"] < 200


def with_record(content: bytes) -> Callable[[Path], object]:
    def write(path: Path) -> None:
        with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as file:
            file.writestr(f"model/extra/{RECORD_NAME}", content)

    return write


def with_size(size: object) -> Callable[[Path], object]:
    record = {"schema": 1, "name": "x", "parameters": 1, "working_size": size}
    return with_record(json.dumps(record).encode())


def without_utf8_name(path: Path) -> None:
    with_record(b"{}")(path)
    path.write_bytes(path.read_bytes().replace(b"model/extra", b"mod\xffl/extra"))


ATTACKS: dict[str, tuple[Callable[[Path], object], str]] = {
    "bomb": (with_record(bytes(2**30)), "its members expand to"),
    "long": (with_record(bytes(2**23)), "more than"),
    "deep": (with_record(b"[" * 200_000), "is damaged"),
    "integer": (with_record(b'{"schema": ' + b"9" * 5000 + b"}"), "is damaged"),
    "large": (with_size(6000), "working_size 6000, the most is 1024"),
    "huge": (with_size(10**30), "working_size 10000"),
    "text": (with_size("256"), "lacks working_size"),
    "bytes": (with_record(b"\xff\xfe\xfd"), "is damaged"),
    "name": (without_utf8_name, ""),
    "sparse": (lambda path: os.truncate(path, 2**40), "MiB that a file of this kind"),
    "zeros": (lambda path: path.unlink() or path.symlink_to("/dev/zero"), "a device or a pipe"),
    "pipe": (lambda path: path.unlink() or os.mkfifo(path), "a device or a pipe"),
}


def test_crafted_files_are_refused_at_little_cost(tmp_path: Path) -> None:
    commands = []
    for name, (craft, _) in ATTACKS.items():
        path = tmp_path / f"{name}.pt"
        path.touch()
        craft(path)
        commands.append(
            ["plan", "bundled:rooms", "--start", "20,20", "--goal", "9,9", "--model", str(path)]
        )
    for outcome, (_, message) in zip(
        run_commands(commands, ["torch"]), ATTACKS.values(), strict=True
    ):
        assert_refused(outcome)
        assert message in outcome.said


@pytest.mark.parametrize(
    "manifest", ["text", "[" * 100_000, '{"name": "a web app"}', '{"default": 1, "files": {}}']
)
def test_a_foreign_manifest_does_not_block_a_model(
    exported: Path, tmp_path: Path, manifest: str
) -> None:
    shutil.copy(exported, tmp_path / "tiny.pt")
    (tmp_path / "manifest.json").write_text(manifest)
    assert load_model(tmp_path / "tiny.pt").record["name"] == "tiny"


def test_names_of_models(exported: Path, tmp_path: Path) -> None:
    for name in ("a" * 300, f"{tmp_path}/a\0b"):
        with pytest.raises(ModelError):
            read_record(Path(name))
