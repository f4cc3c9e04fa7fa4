"""Making a heat map in a thread of its own, while a planner plans."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor, wait
from threading import Lock
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
        make: makes it; called in a thread of its own, which ends with it.

    Example:
        >>> from cbagan_ompl import GridMap
        >>> grid = GridMap.load("bundled:rooms")
        >>> prediction = Prediction(lambda: Heatmap.uniform(grid))
        >>> prediction.future.result().grid is grid
        True
    """

    def __init__(self, make: Callable[[], Heatmap]) -> None:
        self._began = perf_counter()
        self._seconds: float | None = None
        pool = ThreadPoolExecutor(1, thread_name_prefix="cbagan-ompl-heatmap")
        self.future: Future[Heatmap] = pool.submit(self._run, make)
        pool.shutdown(wait=False)  # the thread ends when it has nothing more to do

    def seconds(self) -> float:
        """Return how long it took, or has taken so far."""
        return perf_counter() - self._began if self._seconds is None else self._seconds

    def wait(self) -> None:
        """Wait until the thread has come to its end: what it does cannot be interrupted."""
        wait([self.future])

    def _run(self, make: Callable[[], Heatmap]) -> Heatmap:
        try:
            with _quick_turns:
                return make()
        finally:
            self._seconds = perf_counter() - self._began
