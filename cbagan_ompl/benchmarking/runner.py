"""Running the tasks of a benchmark, each in a process of its own."""

from __future__ import annotations

import os
import signal
import sys
import tempfile
from collections.abc import Sequence
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import cast

from tqdm import tqdm

from ..common.files import reason
from ..common.parallel import fork_server, start_first, why_died
from ..common.signals import interrupts_held
from ..common.text import one_line
from ..errors import ConfigError, show
from ..planning.heatmap_sources import AUTO, LEARNED
from .worker import Job, UnwritableLogError, run_job

# Imported once, by the server from which the processes are forked.
_PRELOAD = ("cbagan_ompl.benchmarking.worker",)
# Torch takes a second to import, and the modules of this package import it only when needed.
_PRELOAD_LEARNED = ("cbagan_ompl.inference.predictor", "torch")

# An interrupt that another thread takes, or that comes just before a wait, does not end the wait.
_POLL_S = 0.5

# Seconds that a process has to end after SIGTERM.
_PATIENCE_S = 1.0

# Exit status of a process that could not write its log, or OMPL's.
_CANNOT_WRITE = 74  # EX_IOERR of sysexits.h

# Characters that are kept of the end of a crashed process' output.
_OUTPUT_KEPT = 4000


def run_jobs(jobs: Sequence[Job], processes: int, show_progress: bool = True) -> dict[str, str]:
    """Run jobs, several at a time; a crash of one, even an abort, does not affect the others.

    Args:
        jobs: the tasks.
        processes: number of tasks that run at a time.
        show_progress: show a progress bar with the remaining time.

    Returns:
        For each task that failed, by its name, the end of its output.

    Raises:
        KeyboardInterrupt: after an interrupt; the tasks that were running are terminated.
        ConfigError: processes or temporary files cannot be made, or a log cannot be written.
    """
    try:
        return _run_jobs(jobs, processes, show_progress)
    except BrokenPipeError:  # of our output
        raise
    except OSError as error:
        place = f"{error.filename}: " if error.filename else ""
        hint = ""
        if "AF_UNIX path too long" in str(error):  # of the sockets of multiprocessing
            folder = show(tempfile.gettempdir())
            hint = f": set TMPDIR to a folder with a shorter name than {folder}"
        raise ConfigError(f"cannot run the tasks: {place}{reason(error)}{hint}") from error


def _run_jobs(jobs: Sequence[Job], processes: int, show_progress: bool) -> dict[str, str]:
    waiting = list(reversed(jobs))
    running: dict[Connection, _RunningJob] = {}
    failures: dict[str, str] = {}
    rounds = sum(job.settings.runs for job in jobs)
    bar = tqdm(total=rounds, unit="round", disable=not (show_progress and jobs), dynamic_ncols=True)
    # Outermost: an interrupt is raised only when no process is left that uses the folder.
    with interrupts_held() as interrupted, bar, tempfile.TemporaryDirectory() as folder:
        try:
            while waiting or running:
                while waiting and len(running) < processes:
                    started = _RunningJob(waiting.pop(), Path(folder))
                    started.start(None if running else interrupted)
                    running[started.rounds] = started
                ready = cast("list[Connection]", wait([*running, interrupted], _POLL_S))
                if interrupted in ready:
                    raise KeyboardInterrupt
                for pipe in ready:
                    done = running[pipe].rounds_done()
                    bar.update(done)
                    if done == 0:
                        _finish(running.pop(pipe), failures, bar)
        finally:
            for unfinished in running.values():
                unfinished.process.terminate()
            for unfinished in running.values():
                # Where SIGTERM is ignored, as after "trap '' TERM", children ignore it as well.
                unfinished.process.join(_PATIENCE_S)
                unfinished.process.kill()
                unfinished.join()
    return failures


def _finish(ended: _RunningJob, failures: dict[str, str], bar: tqdm[None]) -> None:
    name = ended.job.task.name
    output = ended.join()
    bar.update(ended.rounds_left)
    if ended.process.exitcode == _CANNOT_WRITE:
        raise ConfigError(output)
    if output:
        failures[name] = output
        bar.write(f"task {name} failed: {one_line(output.splitlines()[-1])}", sys.stderr)


class _RunningJob:
    """A job in its process.

    Attributes:
        rounds: connection that is readable after each round of runs, and after the end of the
            process.
        rounds_left: rounds that have not been reported yet.
        process: the process.
    """

    def __init__(self, job: Job, folder: Path) -> None:
        learned = {LEARNED, AUTO} & job.settings.sources or job.settings.models
        context = fork_server([*_PRELOAD, *(_PRELOAD_LEARNED if learned else ())])
        self.job = job
        self.rounds_left = job.settings.runs
        self._output = folder / job.task.name
        self._output.touch()
        self.rounds, self._writer = context.Pipe(duplex=False)
        arguments = (job, self._writer, self._output)
        self.process = context.Process(target=_work, args=arguments, daemon=True)

    def start(self, interrupted: Connection | None) -> None:
        """Start the process; an interrupt is waited for with the first one only."""
        with self._writer:  # the process holds its own copy, whose end is the end of the pipe
            try:
                if interrupted is None:
                    self.process.start()
                else:
                    start_first(self.process, interrupted)
            except BrokenPipeError as error:
                raise _death() from error

    def rounds_done(self) -> int:
        """Return 1 for a round that is done, 0 when the process has ended."""
        try:
            self.rounds.recv_bytes()
        except EOFError:
            return 0
        self.rounds_left -= 1
        return 1

    def join(self) -> str:
        """Wait for the process; return the end of its output, nothing if it succeeded."""
        self.process.join()
        self.rounds.close()
        code = self.process.exitcode
        if not code:
            return ""
        for unfinished in self.job.log.parent.glob(f"{self.job.log.name}.*"):
            unfinished.unlink()
        output = self._output.read_text(encoding="utf-8", errors="replace")
        if code == _CANNOT_WRITE:
            return output.strip() or f"cannot write {self.job.log}"
        if not output and code == 1:  # it did not come to its work
            raise _death()
        end = f"ended by {signal.Signals(-code).name}" if code < 0 else ""
        return f"{output[-_OUTPUT_KEPT:]}\n{end}".strip() or f"exit status {code}"


def _death() -> ConfigError:
    """Return the error for a process that never came to its job."""
    return ConfigError(f"a process that runs a task has died, {why_died()}")


def _work(job: Job, rounds: Connection, output: Path) -> None:
    """Run a job in its process, with all output, tracebacks too, in a file."""
    with output.open("wb") as file:
        for stream in (1, 2):
            os.dup2(file.fileno(), stream)
    # OMPL's own logs lie there: they go with the folder, however this process ends.
    tempfile.tempdir = str(output.parent)
    try:
        run_job(job, lambda: rounds.send_bytes(b"."))
    except UnwritableLogError as error:
        print(error, flush=True)
    except OSError as error:
        print(f"{error.filename}: {reason(error)}", flush=True)
    else:
        return
    raise SystemExit(_CANNOT_WRITE)
