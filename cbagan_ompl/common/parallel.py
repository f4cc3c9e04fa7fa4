"""Work in several processes, which an interrupt neither hits nor leaves behind."""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
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
from typing import Any, TypeVar

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


def run_all(
    work: Callable[..., T],
    arguments: Sequence[tuple[Any, ...]],
    processes: int,
    unit: str,
    progress: bool = True,
) -> list[T]:
    """Return the results of ``work(*args)`` for each of the arguments, in their order.

    Args:
        work: a function of a module.
        arguments: of each call.
        processes: at a time.
        unit: what the progress bar counts.
        progress: show the progress bar.

    Raises:
        KeyboardInterrupt: after an interrupt; calls that have begun are given up.
        DatasetError: a process has died.
        Exception: what a call raised.
    """
    results: dict[int, T] = {}
    others = set(active_children())
    with interrupts_held():
        context = fork_server()
    with ProcessPoolExecutor(processes, context, prepare_worker) as pool:
        try:
            with interrupts_held():  # submitting starts the processes
                positions = {
                    pool.submit(run_call, work, *args): i for i, args in enumerate(arguments)
                }
            done = as_completed(positions)
            for future in tqdm(done, total=len(positions), unit=f" {unit}", disable=not progress):
                results[positions[future]] = future.result()
        except BrokenProcessPool as error:
            raise DatasetError(
                f"a process that worked on the {unit} has died, {why_died()}"
            ) from error
        except BaseException:
            for child in set(active_children()) - others:
                child.terminate()
            pool.shutdown(cancel_futures=True)
            raise
    return [results[i] for i in range(len(arguments))]
