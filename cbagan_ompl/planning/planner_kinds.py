"""What kind of thing a planner or a setup is: geometric, of ``ompl.control``, or Python's own.

Control planners have the names of geometric ones, so the module of a class tells them apart.
"""

from __future__ import annotations

from typing import Any

from .compat import planner_names

#: What the name of a control planner begins with, as in ``"control.RRT"``.
CONTROL_PREFIX = "control."


def plans_controls(value: Any) -> bool:
    """Return whether a planner or a setup is of ``ompl.control``."""
    return _control_class(value) is not None


def is_control_setup(value: Any) -> bool:
    """Return whether a value is an ``ompl.control.SimpleSetup``."""
    return _control_class(value) == "SimpleSetup"


def is_written_in_python(planner: Any) -> bool:
    """Return whether a planner is a Python subclass of ``ob.Planner`` itself."""
    geometric = any(".geometric" in kind.__module__ for kind in _ompl_classes(planner))
    return not geometric and not plans_controls(planner)


def class_name(planner: Any) -> str:
    """Return OMPL's name of the class of a planner, also for Python subclasses of it.

    Names of control planners begin with :data:`CONTROL_PREFIX`.
    """
    control = _control_class(planner)
    if control is not None:
        return CONTROL_PREFIX + control
    names = planner_names()
    return next(
        (kind.__name__ for kind in type(planner).__mro__ if kind.__name__ in names),
        type(planner).__name__,
    )


def _control_class(value: Any) -> str | None:
    """Return the name of the class of ``ompl.control`` that a value is of; None for others."""
    return next(
        (kind.__name__ for kind in _ompl_classes(value) if ".control" in kind.__module__), None
    )


def _ompl_classes(value: Any) -> list[type]:
    return [kind for kind in type(value).__mro__ if kind.__module__.split(".")[0] == "ompl"]
