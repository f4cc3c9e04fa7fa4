"""Running the tasks of a benchmark, each in a process of its own."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Sequence
from multiprocessing.connection import Connection, wait
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import cast

from tqdm import tqdm

from ..common.parallel import fork_server, interrupts_held
from .settings import LEARNED
from .worker import Job, run_job

# Imported once, by the server that the processes are forked from.
_PRELOAD = ("cbagan_ompl.benchmarking.worker",)
# Torch takes a second, and our modules import it only once it is needed.
_PRELOAD_LEARNED = ("cbagan_ompl.inference.predictor", "torch")

# An interrupt that another thread took, or that came just before a wait, does not end the wait.
_LOOK_AGAIN_S = 0.5

# Characters of the end of a crashed process' output.
_LAST_WORDS = 4000


def run_jobs(jobs: Sequence[Job], processes: int, show_progress: bool = True) -> dict[str, str]:
    """Run jobs, several at a time; a crash of one, even an abort, leaves the others alone.

    Args:
        jobs: the tasks.
        processes: how many run at a time.
        show_progress: draw a progress bar with the time left.

    Returns:
        For each task that failed, by its name, the end of what it said.

    Raises:
        KeyboardInterrupt: after an interrupt; the tasks that were running are given up.
    """
    waiting = list(reversed(jobs))
    running: dict[Connection, _Running] = {}
    failures: dict[str, str] = {}
    rounds = sum(job.settings.runs for job in jobs)
    bar = tqdm(total=rounds, unit="round", disable=not show_progress, dynamic_ncols=True)
    # Outermost: an interrupt is raised once no process is left that would use the folder.
    with interrupts_held() as interrupted, bar, TemporaryDirectory() as folder:
        try:
            while waiting or running:
                while waiting and len(running) < processes:
                    started = _Running(waiting.pop(), Path(folder))
                    running[started.rounds] = started
                ready = cast("list[Connection]", wait([*running, interrupted], _LOOK_AGAIN_S))
                if interrupted in ready:
                    break
                for pipe in ready:
                    done = running[pipe].rounds_done()
                    bar.update(done)
                    if done == 0:
                        _end(running.pop(pipe), failures, bar)
        finally:
            for given_up in running.values():
                given_up.process.terminate()
            for given_up in running.values():
                given_up.last_words()
    return failures


def _end(ended: _Running, failures: dict[str, str], bar: tqdm[None]) -> None:
    name = ended.job.task.name
    words = ended.last_words()
    bar.update(ended.rounds_left)
    if words:
        failures[name] = words
        bar.write(f"task {name} failed: {words.splitlines()[-1]}", sys.stderr)


class _Running:
    """A job in its process.

    Attributes:
        rounds: has something to read after each round of runs, and when the process is over.
    """

    def __init__(self, job: Job, folder: Path) -> None:
        learned = LEARNED in job.settings.samplers or job.settings.models
        context = fork_server([*_PRELOAD, *(_PRELOAD_LEARNED if learned else ())])
        self.job = job
        self.rounds_left = job.settings.runs
        self._output = folder / job.task.name
        self._output.touch()
        self.rounds, writer = context.Pipe(duplex=False)
        self.process = context.Process(target=_work, args=(job, writer, self._output), daemon=True)
        self.process.start()
        writer.close()  # the process has its own copy: with that one the pipe ends

    def rounds_done(self) -> int:
        """One when a round is done, none when the process is over."""
        try:
            self.rounds.recv_bytes()
        except EOFError:
            return 0
        self.rounds_left -= 1
        return 1

    def last_words(self) -> str:
        """Wait for the end; what a process that failed has said, empty for one that did not."""
        self.process.join()
        self.rounds.close()
        code = self.process.exitcode
        if not code:
            return ""
        self.job.draft.unlink(missing_ok=True)
        output = self._output.read_text(encoding="utf-8", errors="replace")
        end = f"ended by {signal.Signals(-code).name}" if code < 0 else ""
        return f"{output[-_LAST_WORDS:]}\n{end}".strip() or f"exit status {code}"


def _work(job: Job, rounds: Connection, output: Path) -> None:
    """What the process does; a traceback goes to its output as well."""
    with output.open("wb") as file:
        for stream in (1, 2):
            os.dup2(file.fileno(), stream)
    run_job(job, lambda: rounds.send_bytes(b"."))
