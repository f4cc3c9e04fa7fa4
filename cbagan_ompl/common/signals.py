"""Ctrl-C and SIGTERM: raised as exceptions, held back where nothing may be cut through."""

from __future__ import annotations

import signal
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from multiprocessing import Pipe
from multiprocessing.connection import Connection
from threading import current_thread, main_thread
from types import FrameType
from typing import Any

#: What ends a command: Ctrl-C in its terminal, and ``kill``.
ENDING = (signal.SIGINT, signal.SIGTERM)


class Terminated(KeyboardInterrupt):
    """SIGTERM came: like Ctrl-C, but the exit status tells the two apart."""


def raise_once(number: int, _: FrameType | None) -> None:
    """Raise the exception of a signal, and ignore whatever comes after it: a signal handler.

    What is cleaned up then takes less than the patience of whoever presses Ctrl-C twice.
    """
    for other in ENDING:
        signal.signal(other, signal.SIG_IGN)
    raise Terminated if number == signal.SIGTERM else KeyboardInterrupt


def handle_endings(handler: Callable[[int, FrameType | None], Any]) -> None:
    """Let a function handle Ctrl-C and SIGTERM, unless the process was told to ignore them.

    A shell tells its background jobs to ignore Ctrl-C, which is meant for those in front.
    """
    for number in ENDING:
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, handler)


@contextmanager
def interrupts_held() -> Iterator[Connection]:
    """Hold Ctrl-C and SIGTERM back until the end of the block.

    The yielded connection is ready to read once one of them has come. A wait for the connection may
    miss a signal that another thread takes, until the next one.

    A mask of signals would not do: it holds for one thread, and a signal that any other one
    takes, such as that of a progress bar, is raised in the main thread all the same.

    Signals that the process ignores, or leaves to the system, stay as they are.
    """
    came, sender = Pipe(duplex=False)
    with came, sender:
        if current_thread() is not main_thread():
            yield came  # only the main thread gets signals
            return
        caught: list[int] = []

        def hold(number: int, _: FrameType | None) -> None:
            caught.append(number)
            sender.send_bytes(b".")

        before = {number: signal.getsignal(number) for number in ENDING}
        before = {number: handler for number, handler in before.items() if callable(handler)}
        for number in before:
            signal.signal(number, hold)
        try:
            yield came
        finally:
            try:
                _restore(before, hold)
            except BaseException:  # of a handler that is back, for a signal that has just come
                _restore(before, hold)
                raise
            if caught:
                signal.raise_signal(caught[0])


def _restore(handlers: Mapping[signal.Signals, Any], holder: Callable[..., None]) -> None:
    """Set the handlers of signals that another function holds back."""
    for number, handler in handlers.items():
        if signal.getsignal(number) is holder:
            signal.signal(number, handler)
