"""A Dask scheduler with workers, each a process of this machine."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from helpers.interrupting import processes_of

# Only against hanging: a busy machine may take long.
_PATIENCE_S = 120

_LOCAL = ("--host", "127.0.0.1", "--no-dashboard")


@dataclass
class Cluster:
    """What runs; all of its processes are in one session each.

    Attributes:
        folder: of the scheduler's file, and of the workers' own files.
        address: of the scheduler.
        workers: the processes of the workers.
    """

    folder: Path
    address: str
    workers: list[subprocess.Popen[bytes]]

    @property
    def file(self) -> Path:
        """File with the address of the scheduler."""
        return self.folder / "scheduler.json"

    def start_worker(self, python_path: str = "", *options: str) -> None:
        """Start a worker of one thread, which is not started again when it dies."""
        words = ["worker", self.address, *_LOCAL, "--no-nanny", "--nthreads", "1"]
        words += ["--name", str(len(self.workers)), "--local-directory", str(self.folder)]
        paths = [python_path, os.environ.get("PYTHONPATH", "")]
        environment = {"PYTHONPATH": os.pathsep.join(filter(None, paths))}
        self.workers.append(_start([*words, *options], environment))

    def kill_worker(self, number: int) -> None:
        """End a worker without a word, as a machine that fails."""
        self.workers[number].send_signal(signal.SIGKILL)


@contextmanager
def cluster_of(folder: Path, workers: int) -> Iterator[Cluster]:
    """A scheduler that lets a call be repeated once, and workers; fails if a process stays."""
    file = folder / "scheduler.json"
    words = ["scheduler", *_LOCAL, "--port", "0", "--scheduler-file", str(file)]
    scheduler = _start(words, {"DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES": "1"})
    processes = [scheduler]
    try:
        end = time.monotonic() + _PATIENCE_S
        while not (file.exists() and file.read_text()) and time.monotonic() < end:
            assert scheduler.poll() is None
            time.sleep(0.02)
        cluster = Cluster(folder, json.loads(file.read_text())["address"], [])
        for _ in range(workers):
            cluster.start_worker()
        processes = [*cluster.workers, scheduler]
        yield cluster
        processes = [*cluster.workers, scheduler]
        for process in processes:
            process.terminate()
        for process in processes:
            process.wait(_PATIENCE_S)
        end = time.monotonic() + _PATIENCE_S
        while (left := _left(processes)) and time.monotonic() < end:
            time.sleep(0.02)
        assert not left, "processes of the workers stay"
    finally:
        for pid in _left(processes):
            os.kill(pid, signal.SIGKILL)
        for process in processes:
            process.wait()


def _start(words: list[str], environment: Mapping[str, str]) -> subprocess.Popen[bytes]:
    return subprocess.Popen(
        [sys.executable, "-m", "dask", *words],
        env={**os.environ, **environment},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )


def _left(processes: list[subprocess.Popen[bytes]]) -> list[int]:
    return [pid for process in processes for pid in processes_of(process.pid)]
