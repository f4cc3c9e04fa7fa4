"""Work in several processes, which an interrupt neither hits nor leaves behind.

An :class:`Executor` says where calls run: in processes of this machine (:class:`LocalExecutor`), or
on the workers of a cluster (:class:`.cluster.ClusterExecutor`).
"""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Callable, Generator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import closing
from dataclasses import dataclass
from multiprocessing import (
    active_children,
    current_process,
    forkserver,
    get_context,
    resource_tracker,
)
from multiprocessing.connection import Connection
from multiprocessing.context import ForkServerContext
from multiprocessing.process import BaseProcess
from pathlib import Path
from threading import Thread
from typing import Any, Protocol, TypeVar

from tqdm import tqdm

from ..errors import DatasetError
from .signals import interrupts_held

T = TypeVar("T")

# Seconds between two looks for an interrupt, and that a process has to start after one.
_POLL_S, _PATIENCE_S = 0.05, 0.3


def fork_server(preload: Sequence[str] = ()) -> ForkServerContext:
    """Return what makes processes that are forked from a clean server.

    OMPL, OpenCV and torch have threads, which a fork does not survive. Neither the server nor its
    processes hear the interrupt of a terminal, which is for all processes that it started: they
    end with the one that made them. To be called and used with
    :func:`.signals.interrupts_held`.

    Args:
        preload: modules that the server imports, where it is not there yet.
    """
    if getattr(current_process(), "_inheriting", False):
        # A new process imports the script that started it, which must not start processes then.
        # It dies without a traceback; why_died tells the process that waits for it.
        os._exit(1)
    context = get_context("forkserver")
    context.set_forkserver_preload(list(preload))
    resource_tracker.ensure_running()  # lets interrupts in again, so it must be there before
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        forkserver.ensure_running()  # whose processes inherit the mask
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
    return context


def why_died() -> str:
    """Return why a process has probably died before its work was done."""
    try:
        script = Path(str(sys.modules["__main__"].__file__)).read_text("utf-8", "replace")
    except (OSError, AttributeError, ValueError):  # an interactive session
        script = "__name__"
    if "__name__" in script:
        return "perhaps for lack of memory"
    return (
        f"since {sys.argv[0]} starts it, and each process imports that script again: put what it "
        'does into a function, and call that under `if __name__ == "__main__":`'
    )


def prepare_worker() -> None:
    """Let SIGTERM end this process at work, but not while it sends a result: an initializer.

    Of half a result the process that reads it would wait for the rest without end.
    """
    signal.signal(signal.SIGTERM, _end_unless_sending)


def run_call(work: Callable[..., T], *arguments: Any) -> T:
    """Return the result of a call in a process that :func:`prepare_worker` has prepared."""
    _state.is_working = True
    if _state.is_ending:
        os._exit(1)
    try:
        return work(*arguments)
    finally:
        _state.is_working = False


class _WorkerState:
    """What the signal handler of a worker process needs to know."""

    is_working = is_ending = False


_state = _WorkerState()


def _end_unless_sending(*_: object) -> None:
    _state.is_ending = True
    if _state.is_working:
        os._exit(1)


def start_first(process: BaseProcess, interrupted: Connection) -> None:
    """Start the first process of a server, without waiting for the server after an interrupt.

    It answers once it has imported everything, which takes seconds for torch.

    Args:
        process: of :func:`fork_server`; no other one of this server is running.
        interrupted: from :func:`.signals.interrupts_held`.

    Raises:
        KeyboardInterrupt: an interrupt came first; the server is ended.
    """
    errors: list[BaseException] = []

    def start() -> None:
        try:
            process.start()
        except BaseException as error:
            errors.append(error)

    thread = Thread(target=start, daemon=True)
    thread.start()
    while thread.is_alive() and not interrupted.poll():
        thread.join(_POLL_S)
    thread.join(_PATIENCE_S)
    if thread.is_alive():
        server = getattr(forkserver.ensure_running, "__self__", None)
        pid = getattr(server, "_forkserver_pid", None)
        if pid:
            os.kill(pid, signal.SIGKILL)
        raise KeyboardInterrupt
    if errors:
        raise errors[0]


class ProcessDied(Exception):  # noqa: N818 - it is no error of the call's own
    """The process of a call has died; a call may raise it for a process that it started.

    Args:
        reason: how it ended.
    """


@dataclass(frozen=True)
class ProcessDeath:
    """What comes in place of a result where the process of a call has died.

    Attributes:
        reason: how it ended.
    """

    reason: str


class Executor(Protocol):
    """Where calls run: in processes of this machine, or on the workers of a cluster."""

    def completed(
        self,
        work: Callable[..., T],
        calls: Mapping[str, tuple[Any, ...]],
        shared: tuple[Any, ...] = (),
    ) -> Generator[tuple[str, T | ProcessDeath], None, None]:
        """Yield the results of ``work(*shared, *args)``, in the order in which they are done.

        What a call returns must not depend on where it runs: it gets its seed, and no path of a
        file that only one machine has. Closing the generator gives up the calls that have begun.

        Args:
            work: a function of a module.
            calls: the arguments of each call, by its name.
            shared: first arguments of all calls, sent to each machine once.

        Yields:
            The name of a call, and what it returned.

        Raises:
            BrokenProcessPool: a process has died, and nobody can tell which call it had.
            ClusterError: the cluster cannot do the work.
            Exception: what a call raised.
        """


@dataclass(frozen=True)
class LocalExecutor:
    """Processes of this machine.

    Attributes:
        processes: at a time.

    Example:
        >>> executor = LocalExecutor(processes=2)
        >>> run_all(pow, {"square": (3, 2), "cube": (3, 3)}, executor, "powers", progress=False)
        [9, 27]
    """

    processes: int

    def completed(
        self,
        work: Callable[..., T],
        calls: Mapping[str, tuple[Any, ...]],
        shared: tuple[Any, ...] = (),
    ) -> Generator[tuple[str, T | ProcessDeath], None, None]:
        """Yield the results of calls, see :meth:`Executor.completed`."""
        others = set(active_children())
        with interrupts_held():
            context = fork_server()
        with ProcessPoolExecutor(self.processes, context, prepare_worker) as pool:
            try:
                with interrupts_held():  # submitting starts the processes
                    names = {
                        pool.submit(run_call, work, *shared, *arguments): name
                        for name, arguments in calls.items()
                    }
                for future in as_completed(names):
                    name = names.pop(future)  # a result that has been used is not kept
                    try:
                        result: T | ProcessDeath = future.result()
                    except ProcessDied as death:
                        result = ProcessDeath(str(death))
                    del future
                    yield name, result
            except BrokenProcessPool:
                raise
            except BaseException:
                for child in set(active_children()) - others:
                    child.terminate()
                pool.shutdown(cancel_futures=True)
                raise


def run_each(
    work: Callable[..., T],
    calls: Mapping[str, tuple[Any, ...]],
    executor: Executor,
    finished: Callable[[str, T], object],
    unit: str,
    progress: bool = True,
    shared: tuple[Any, ...] = (),
) -> None:
    """Run calls, and hand over each result as soon as it is there.

    Args:
        work: a function of a module.
        calls: the arguments of each call, by its name.
        executor: where they run.
        finished: gets the name of a call and its result, in this process.
        unit: what the progress bar counts.
        progress: show the progress bar.
        shared: first arguments of all calls, sent to each machine once.

    Raises:
        KeyboardInterrupt: after an interrupt; calls that have begun are given up.
        DatasetError: the processes of some calls have died; the others are done, if the executor
            can tell them apart.
        ClusterError: the cluster cannot do the work.
        Exception: what a call raised.
    """
    deaths = {}
    try:
        with closing(executor.completed(work, calls, shared)) as done:
            for name, result in tqdm(done, total=len(calls), unit=f" {unit}", disable=not progress):
                if isinstance(result, ProcessDeath):
                    deaths[name] = result.reason
                else:
                    finished(name, result)
    except BrokenProcessPool as error:
        raise DatasetError(f"a process that worked on the {unit} has died, {why_died()}") from error
    if deaths:
        said = "; ".join(f"{name}: {reason}" for name, reason in sorted(deaths.items()))
        raise DatasetError(
            f"{len(deaths)} of {len(calls)} {unit} are missing, since the processes that worked on "
            f"them died ({said})"
        )


def run_all(
    work: Callable[..., T],
    calls: Mapping[str, tuple[Any, ...]],
    executor: Executor,
    unit: str,
    progress: bool = True,
    shared: tuple[Any, ...] = (),
) -> list[T]:
    """Return the results of calls in their order; arguments and errors as for :func:`run_each`."""
    results: dict[str, T] = {}
    run_each(work, calls, executor, results.__setitem__, unit, progress, shared)
    return [results[name] for name in calls]
