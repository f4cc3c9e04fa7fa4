"""Keeping exceptions and signals inside OMPL's callbacks, where leaving would abort the process."""

from __future__ import annotations

import signal
from collections.abc import Callable
from types import TracebackType
from typing import Any

from ..common.signals import ENDING, Terminated


class InterruptGuard:
    """A context for calls of OMPL that no exception may cut through.

    While OMPL's Benchmark watches a planner from a second thread, an exception that leaves a
    callback ends the process. The guard keeps the first one, an interrupt included, until its end
    and raises it there. To be used in the main thread.
    """

    def __init__(self) -> None:
        self._error: BaseException | None = None

    @property
    def tripped(self) -> bool:
        """Whether an exception waits; callbacks should then bring OMPL to its end."""
        return self._error is not None

    def wrap(self, callback: Callable[..., None]) -> Callable[..., None]:
        """Return the callback with its exceptions kept, and not called any more after the first."""

        def guarded(*arguments: Any) -> None:
            if self._error is None:
                try:
                    callback(*arguments)
                except BaseException as error:
                    self._error = error

        return guarded

    def __enter__(self) -> InterruptGuard:
        before = {number: signal.getsignal(number) for number in ENDING}
        # Signals that the process ignores, or leaves to the system, stay as they are.
        self._before = {number: kept for number, kept in before.items() if callable(kept)}
        for number in self._before:
            signal.signal(number, self._interrupt)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)
        # Forgotten first: callbacks know the guard, and the exception knows what they work for.
        kept, self._error = self._error, None
        try:
            if error is None and kept is not None:
                raise kept
        finally:
            del kept

    def _interrupt(self, number: int, _: object) -> None:
        ended = Terminated() if number == signal.SIGTERM else KeyboardInterrupt()
        self._error = self._error or ended
