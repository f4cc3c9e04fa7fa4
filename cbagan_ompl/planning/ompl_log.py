"""How much OMPL's log says."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from threading import Lock
from typing import Any

from ompl import util as ou

_log_lock = Lock()
# The level before the first open block, followed by those of the open blocks.
_log_levels: list[Any] = []


@contextmanager
def log_level(level: Any) -> Iterator[None]:
    """Let OMPL's log say no more than a level for the duration of a block.

    The level is one for the whole process. While several blocks are open, in several threads, the
    quietest of them counts; the last one to end restores what was set before the first one.
    """
    with _log_lock:
        if not _log_levels:
            _log_levels.append(ou.getLogLevel())
        _log_levels.append(level)
        ou.setLogLevel(max(_log_levels, key=_quietness))
    try:
        yield
    finally:
        with _log_lock:
            _log_levels.remove(level)
            ou.setLogLevel(max(_log_levels, key=_quietness))
            if len(_log_levels) == 1:
                _log_levels.clear()


def _quietness(level: Any) -> int:
    return int(getattr(level, "value", level))
