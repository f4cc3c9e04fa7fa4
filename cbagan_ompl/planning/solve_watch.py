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
        check: called at the beginning of each solve.
        after: called after each solve that has returned.
    """

    def __init__(self, target: Any, check: Callable[[], None], after: Callable[[], None]) -> None:
        self._calls: set[object] = set()
        self._count = 0
        self._target: Any = target
        self._watched: Any = self._watch_calls(target.solve, check, after)
        try:
            target.solve = self._watched
        except AttributeError:
            self.release()

    @property
    def is_solving(self) -> bool:
        """Whether a solve has begun and not returned."""
        return bool(self._calls)

    @property
    def has_solved(self) -> bool:
        """Whether a solve has begun at all."""
        return self._count > 0

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
        self, function: Callable[..., Any], check: Callable[[], None], after: Callable[[], None]
    ) -> Callable[..., Any]:
        @wraps(function)
        def watched(*arguments: Any, **options: Any) -> Any:
            call = object()
            try:
                self._calls.add(call)
                check()
                self._count += 1
                result = function(*arguments, **options)
            finally:
                self._calls.discard(call)
            after()
            return result

        return watched
