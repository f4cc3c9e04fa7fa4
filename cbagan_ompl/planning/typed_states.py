"""States that come from OMPL, with the Python type that they have."""

from __future__ import annotations

from typing import Any

from .compat import KEPT_STATES, new_state, typed_state


class TypedStates:
    """States of a space that come from OMPL, seen with the type that they have.

    nanobind keeps one Python object for each address. While a program keeps a state of a planner
    that is gone, in a list or in the traceback of an error, and OMPL puts a state of another space
    at its address, the bindings hand out the kept object, whose type is the old one. The address
    is right: OMPL copies such a state to one of ours and back.

    Args:
        space: of the states.
    """

    def __init__(self, space: Any) -> None:
        self._space = space
        self._handle = new_state(space)
        self._own = typed_state(self._handle)
        #: The class of the states.
        self.type: type = type(self._own)

    def readable(self, state: Any) -> Any:
        """Return a state, or a copy of it where its type is wrong."""
        if type(state) is self.type or not isinstance(state, KEPT_STATES):
            return state
        self._space.copyState(self._own, state)
        return self._own

    def replace(self, state: Any, changed: Any) -> None:
        """Set a state to one that :meth:`readable` has returned for it."""
        if changed is not state:
            self._space.copyState(state, changed)
