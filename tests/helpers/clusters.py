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

from distributed import Client

from helpers.interrupting import processes_of

# Only against hanging: a busy machine may take long.
_PATIENCE_S = 60

_LOCAL = ("--host", "127.0.0.1", "--no-dashboard")


@dataclass
class Cluster:
    """What runs; all of its processes are in one session each.

    Attributes:
        folder: of the scheduler's file, and of the workers' own files.
        address: of the scheduler.
        workers: the processes of the workers.
        scheduler: the process of the scheduler.
    """

    folder: Path
    address: str
    workers: list[subprocess.Popen[bytes]]
    scheduler: subprocess.Popen[bytes]

    @property
    def file(self) -> Path:
        """File with the address of the scheduler."""
        return self.folder / "scheduler.json"

    @property
    def processes(self) -> list[subprocess.Popen[bytes]]:
        """All that were started, the scheduler last."""
        return [*self.workers, self.scheduler]

    def left(self) -> list[int]:
        """Processes that run, those that others have started too."""
        return [pid for process in self.processes for pid in processes_of(process.pid)]

    def start_worker(self, python_path: str = "", *options: str) -> None:
        """Start a worker of one thread, which is not started again when it dies."""
        words = ["worker", self.address, *_LOCAL, "--no-nanny", "--nthreads", "1"]
        words += ["--name", str(len(self.workers)), "--local-directory", str(self.folder)]
        paths = [python_path, *sys.path]  # the helpers of the tests too
        environment = {"PYTHONPATH": os.pathsep.join(filter(None, paths))}
        self.workers.append(_start([*words, *options], environment))

    def wait_for_workers(self, count: int) -> None:
        """Wait until so many workers can take calls."""
        if count:
            with Client(self.address, set_as_default=False) as client:
                client.wait_for_workers(count, timeout=_PATIENCE_S)

    def kill_worker(self, number: int) -> None:
        """End a worker without a word, as a machine that fails."""
        self.workers[number].send_signal(signal.SIGKILL)


@contextmanager
def cluster_of(folder: Path, workers: int) -> Iterator[Cluster]:
    """A scheduler that lets a call be repeated once, and workers; fails if a process stays."""
    file = folder / "scheduler.json"
    words = ["scheduler", *_LOCAL, "--port", "0", "--scheduler-file", str(file)]
    scheduler = _start(words, {"DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES": "1"})
    cluster = Cluster(folder, "", [], scheduler)
    try:
        end = time.monotonic() + _PATIENCE_S
        while not (file.exists() and file.read_text()) and time.monotonic() < end:
            assert scheduler.poll() is None
            time.sleep(0.02)
        cluster.address = json.loads(file.read_text())["address"]
        for _ in range(workers):
            cluster.start_worker()
        cluster.wait_for_workers(workers)
        yield cluster
        for process in cluster.processes:
            process.kill()  # what they started must end all the same
            process.wait(_PATIENCE_S)
        end = time.monotonic() + _PATIENCE_S
        while (left := cluster.left()) and time.monotonic() < end:
            time.sleep(0.02)
        assert not left, "processes of the workers stay"
    finally:
        for pid in cluster.left():
            os.kill(pid, signal.SIGKILL)
        for process in cluster.processes:
            process.wait()


def _start(words: list[str], environment: Mapping[str, str]) -> subprocess.Popen[bytes]:
    return subprocess.Popen(
        [sys.executable, "-m", "dask", *words],
        env={**os.environ, **environment},
        cwd="/",  # where no module lies that would be found first
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
