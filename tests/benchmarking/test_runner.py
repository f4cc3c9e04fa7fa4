"""Tasks in processes of their own: interrupts, crashes, what is imported."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from multiprocessing.context import ForkServerProcess
from pathlib import Path
from typing import Any

import pytest

from cbagan_ompl import GridMap, Task
from cbagan_ompl.benchmarking.runner import run_jobs
from cbagan_ompl.benchmarking.settings import Settings
from cbagan_ompl.benchmarking.tasks import BenchmarkTask
from cbagan_ompl.benchmarking.worker import Job
from cbagan_ompl.planning.workspace import Workspace


@pytest.mark.usefixtures("interruptible")
def test_an_interrupt_while_a_process_starts_leaves_none(
    two_walls: GridMap, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    settings = Settings(("RRTstar",), ("uniform",), runs=99)
    tasks = [BenchmarkTask(Workspace(two_walls), i, Task((10, 10), (240, 240))) for i in range(3)]
    jobs = [Job(task, settings, tmp_path / f"{task.name}.log") for task in tasks]
    start, started = ForkServerProcess.start, []

    def start_and_interrupt(process: ForkServerProcess) -> None:
        start(process)
        started.append(process)
        if len(started) == 2:
            # In another thread, as a mask of the main one would make it come.
            pool.submit(signal.raise_signal, signal.SIGINT).result()

    monkeypatch.setattr(ForkServerProcess, "start", start_and_interrupt)
    with ThreadPoolExecutor(1) as pool, pytest.raises(KeyboardInterrupt):
        run_jobs(jobs, 2, show_progress=False)
    assert [process.exitcode for process in started] == [-signal.SIGTERM] * 2
    assert not list(tmp_path.iterdir())
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


class Aborting(BenchmarkTask):
    """Ends the process that it is sent to."""

    def __reduce__(self) -> Any:
        return os.abort, ()


def test_crashes_are_reported_with_their_task(two_walls: GridMap, tmp_path: Path) -> None:
    good = Settings(("RRT",), ("uniform", "corridor"), runs=1, time=0.2, range=20)
    bad = Settings(("Magic",), ("uniform",), runs=1)
    tasks = [
        kind(Workspace(two_walls), number, Task((10, 10), (240, 240)))
        for number, kind in enumerate((Aborting, BenchmarkTask, BenchmarkTask))
    ]
    jobs = [
        Job(task, settings, tmp_path / f"{task.name}.log")
        for task, settings in zip(tasks, (good, bad, good), strict=True)
    ]
    failures = run_jobs(jobs, 2, show_progress=False)
    assert set(failures) == {"two_walls_0", "two_walls_1"}
    assert failures["two_walls_0"] == "ended by SIGABRT"
    assert "PlannerError: there is no planner 'Magic'" in failures["two_walls_1"].splitlines()[-1]
    assert [path.name for path in tmp_path.iterdir()] == ["two_walls_2.log"]


# Ends the process that the task is sent to with a status that says whether torch is there.
TELLING = """
from pathlib import Path
import numpy as np
from cbagan_ompl import GridMap, Task
from cbagan_ompl.benchmarking.runner import run_jobs
from cbagan_ompl.benchmarking.tasks import BenchmarkTask
from cbagan_ompl.benchmarking.settings import Settings
from cbagan_ompl.benchmarking.worker import Job
from cbagan_ompl.planning.workspace import Workspace

class Telling(BenchmarkTask):
    def __reduce__(self):
        return eval, ("__import__('os')._exit(3 if 'torch' in __import__('sys').modules else 4)",)

task = Telling(Workspace(GridMap(np.ones((9, 9), bool))), 0, Task((1, 1), (8, 8)))
settings = Settings(("RRT",), ("uniform", "mine"), models={"mine": "mine.pt"})
print(run_jobs([Job(task, settings, Path("x.log"))], 1, show_progress=False))
"""


def test_torch_is_imported_before_the_tasks_and_not_by_each() -> None:
    pytest.importorskip("torch")
    done = subprocess.run([sys.executable, "-c", TELLING], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "exit status 3" in done.stdout
