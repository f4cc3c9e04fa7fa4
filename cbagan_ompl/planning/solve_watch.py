"""Watching the solves of setups and planners."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import Any


class SolveWatch:
    """Knows whether a setup or a planner is in the middle of its ``solve``.

    Objects that take no attributes, as planners of OMPL 2.0, cannot be watched.

    Args:
        target: a setup or a planner.
        check: called before each solve.
    """

    def __init__(self, target: Any, check: Callable[[], None]) -> None:
        self._calls: list[None] = []
        self._target: Any = target
        self._watched: Any = _watch_calls(target.solve, check, self._calls)
        try:
            target.solve = self._watched
        except AttributeError:
            self.release()

    @property
    def is_solving(self) -> bool:
        """Whether a solve has begun and not returned."""
        return bool(self._calls)

    def references_to(self, target: Any) -> int:
        """Return how many references of this watch to a target there are."""
        # One of its own, and that of the method that it has replaced.
        return 2 if self._target is target else 0

    def release(self) -> None:
        """Give the target its own ``solve`` back and let go of it."""
        attributes = getattr(self._target, "__dict__", {})
        if self._watched is not None and attributes.get("solve") is self._watched:
            del self._target.solve
        self._target = self._watched = None


def _watch_calls(
    function: Callable[..., Any], check: Callable[[], None], calls: list[None]
) -> Callable[..., Any]:
    """Return a function with a list that is as long as there are calls of it in progress."""

    @wraps(function)
    def watched(*arguments: Any, **options: Any) -> Any:
        check()
        calls.append(None)
        try:
            return function(*arguments, **options)
        finally:
            calls.pop()

    return watched
