"""Training runs and exports that are ended, run out of disk space, or lack a package."""

from __future__ import annotations

import json
import os
import resource
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from helpers.synthetic import TINY_PATCHES
from helpers.tiny_model import TINY, export_tiny_model
from helpers.training_set import write_training_set

pytest.importorskip("torch")

# Only against hanging: a busy machine may take long.
_PATIENCE_S = 120


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_training_set(tmp_path_factory.mktemp("data") / "tiny")


@pytest.fixture(scope="module")
def checkpoint(folder: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return export_tiny_model(folder, tmp_path_factory.mktemp("models")).parent / "run" / "best.pt"


def start(*words: str, prepare: Callable[[], None] | None = None) -> subprocess.Popen[str]:
    # Without byte code, which a limit on the size of files would cut off for every later process.
    return subprocess.Popen(
        [sys.executable, "-B", "-m", "cbagan_ompl.cli", *words],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        preexec_fn=prepare,
    )


def said_lines(said: str) -> list[str]:
    """Lines of standard error that stay: no progress bars."""
    lines = [line.rpartition("\r")[2] for line in said.splitlines()]
    return [line for line in lines if line.strip() and not line.lstrip().startswith("epoch")]


def members_of(session: int) -> list[int]:
    """Processes of a session that have not ended."""
    found = []
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            state, _, _, member_of = stat.read_text().rpartition(") ")[2].split()[:4]
        except OSError:
            continue
        if int(member_of) == session and state != "Z":
            found.append(int(stat.parent.name))
    return found


@pytest.mark.slow
@pytest.mark.usefixtures("interruptible")
@pytest.mark.parametrize(
    ("number", "status", "word"),
    [(signal.SIGTERM, 143, "terminated"), (signal.SIGINT, 130, "interrupted")],
)
def test_a_signal_ends_training_and_its_processes(
    tmp_path: Path, number: signal.Signals, status: int, word: str
) -> None:
    recipe, run = tmp_path / "recipe.json", tmp_path / "run"
    recipe.write_text(json.dumps(TINY_PATCHES.updated({"epochs": 10_000}).to_dict()))
    words = ["train", "--synthetic", "--size", "64", "--maps", "4", "--held-out", "1"]
    words += ["--jobs", "2", "--generators", "blocks,caves", "--config", str(recipe)]
    words += ["--device", "cpu", "--output", str(run)]
    for resume in (False, True):
        process = start(*words, *(["--resume"] if resume else []))
        epochs = 2 if resume else 1
        log, end = run / "log.jsonl", time.monotonic() + _PATIENCE_S
        before = len(log.read_text().splitlines()) if resume else 0
        while time.monotonic() < end and process.poll() is None:
            if log.exists() and len(log.read_text().splitlines()) >= before + epochs:
                break
            time.sleep(0.02)
        assert process.poll() is None, process.communicate()[1]
        process.send_signal(number)
        process.send_signal(number)  # as of impatient hands
        _, said = process.communicate(timeout=_PATIENCE_S)
        assert process.returncode == status
        assert said_lines(said) == [f"{word}; go on with the same command and --resume"]
        time.sleep(0.1)
        assert members_of(process.pid) == []
        assert {file.name for file in run.iterdir()} == {"last.pt", "best.pt", "log.jsonl"}


def limit_files(size: int) -> Callable[[], None]:
    """Return what makes writing beyond a size fail, like a full disk."""
    return lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))


@pytest.mark.slow
@pytest.mark.parametrize("options", [[], ["--tensorboard"]])
def test_a_full_disk_ends_training_with_one_message(
    folder: Path, tmp_path: Path, options: list[str]
) -> None:
    recipe, run = tmp_path / "recipe.json", tmp_path / "run"
    recipe.write_text(json.dumps(TINY.to_dict()))
    words = ["train", str(folder), "--config", str(recipe), "--device", "cpu"]
    words += ["--output", str(run), *options]
    # Less than the header of a log for TensorBoard, and than a checkpoint.
    process = start(*words, prepare=limit_files(20 if options else 10_000))
    _, said = process.communicate(timeout=_PATIENCE_S)
    assert process.returncode == 2, said
    assert len(said_lines(said)) == 1, said
    assert "cannot write" in said
    assert not [file for file in run.iterdir() if ".tmp" in file.name or ".pt" in file.name]
    process = start(*words, "--resume")
    assert process.wait(timeout=_PATIENCE_S) == 0
    assert len((run / "log.jsonl").read_text().splitlines()) == 2
    assert process.stderr is not None
    process.stderr.close()


@pytest.mark.slow
@pytest.mark.parametrize("size", [0, 1000, 50_000])
def test_a_full_disk_leaves_no_half_of_a_model(checkpoint: Path, tmp_path: Path, size: int) -> None:
    words = ["export", str(checkpoint), "--output", str(tmp_path / "model.pt")]
    process = start(*words, prepare=limit_files(size))
    _, said = process.communicate(timeout=_PATIENCE_S)
    assert process.returncode == 2, said
    assert len(said_lines(said)) == 1
    assert "cannot write" in said
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_without_torch_every_command_says_what_to_install(
    folder: Path, checkpoint: Path, tmp_path: Path
) -> None:
    (tmp_path / "torch.py").write_text("raise ImportError('there is no torch')")
    run = ["--output", str(tmp_path / "run")]
    for words in (
        ["train", str(folder), *run],
        ["train", "--synthetic", *run],
        ["export", str(checkpoint), "--output", str(tmp_path / "model.pt")],
        ["evaluate", "--dataset", str(folder)],
        ["plan", "bundled:rooms", "--start", "20,20", "--goal", "230,230"],
    ):
        done = subprocess.run(
            [sys.executable, "-m", "cbagan_ompl.cli", *words],
            capture_output=True,
            text=True,
            check=False,
            env={**os.environ, "PYTHONPATH": f"{tmp_path}:{os.environ.get('PYTHONPATH', '')}"},
        )
        assert done.returncode == 2, done.stderr
        assert "pip install -e '.[torch]'" in done.stderr
        assert len(done.stderr.splitlines()) == 1
    assert not (tmp_path / "run").exists()
