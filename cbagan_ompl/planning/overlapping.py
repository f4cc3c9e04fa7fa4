"""Making a heat map in a thread of its own, while a planner plans."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from concurrent.futures import Future
from threading import Lock, Thread
from time import perf_counter

from ..sampling.heatmap import Heatmap

# Seconds that a thread of Python may go on while another one waits.
_TURN_S = 5e-4


def can_overlap() -> bool:
    """Return whether a second thread has a processor core of its own.

    Where it has none, planner and network would take turns, and both come later.
    """
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0)) > 1
    return (os.cpu_count() or 1) > 1


class _QuickTurns:
    """A block during which the threads of Python take shorter turns.

    OMPL's planner gives the interpreter to another thread only when its turn is over, 5 ms unless
    set, and a prediction asks for it a dozen times. While several blocks are open, in several
    threads, the last one to end restores what was set before the first one.
    """

    def __init__(self) -> None:
        self._lock = Lock()
        self._open = 0
        self._before = 0.0

    def __enter__(self) -> None:
        with self._lock:
            if self._open == 0:
                self._before = sys.getswitchinterval()
                sys.setswitchinterval(min(self._before, _TURN_S))
            self._open += 1

    def __exit__(self, *_: object) -> None:
        with self._lock:
            self._open -= 1
            if self._open == 0:
                sys.setswitchinterval(self._before)


_quick_turns = _QuickTurns()


class Prediction:
    """A heat map in the making.

    Attributes:
        future: of the heat map.

    Args:
        make: makes it; called in a thread of its own, which :meth:`start` begins and which ends
            with it.

    Example:
        >>> from cbagan_ompl import GridMap
        >>> grid = GridMap.load("bundled:rooms")
        >>> prediction = Prediction(lambda: Heatmap.uniform(grid))
        >>> prediction.start()
        >>> prediction.future.result().grid is grid
        True
    """

    def __init__(self, make: Callable[[], Heatmap]) -> None:
        self.future: Future[Heatmap] = Future()
        self._make = make
        self._thread = Thread(target=self._run, name="cbagan-ompl-heatmap")
        self._began = perf_counter()
        self._seconds: float | None = None

    def start(self) -> None:
        """Begin to make it."""
        self._began = perf_counter()
        self._thread.start()

    def seconds(self) -> float:
        """Return how long it took, or has taken so far."""
        return perf_counter() - self._began if self._seconds is None else self._seconds

    def wait(self) -> None:
        """Wait until the thread has come to its end: what it does cannot be interrupted."""
        if self._thread.is_alive():
            self._thread.join()

    def _run(self) -> None:
        with _quick_turns:
            try:
                heatmap = self._make()
            except BaseException as error:  # which whoever waits for it raises
                self._seconds = perf_counter() - self._began
                self.future.set_exception(error)
            else:
                self._seconds = perf_counter() - self._began
                self.future.set_result(heatmap)
