"""The exceptions of cbagan_ompl, one class for each thing a user can get wrong, and its warning."""

from __future__ import annotations

from reprlib import Repr

# Characters of a message: beyond that its middle is left out.
_LONGEST_MESSAGE, _TAIL = 900, 300

# Integers with more bits are not written out: Python converts no very long ones to text.
_LONGEST_INTEGER = 128


class CbaganOmplError(Exception):
    """Root of every exception that this package raises on purpose.

    Args:
        message: what was wrong, with the value, and what to do. Long ones are shortened, and
            characters that a terminal would act on are written as escapes.

    Example:
        >>> from cbagan_ompl import GridMap
        >>> try:
        ...     GridMap.load("bundled:palace")
        ... except CbaganOmplError as error:
        ...     print(type(error).__name__, "-", str(error).split(";")[0])
        MapError - no map 'palace' is bundled
    """

    def __init__(self, message: object = "") -> None:
        super().__init__(_plain(str(message)))


class CbaganOmplWarning(UserWarning):
    """An input that is used as it is, though it is probably not what was meant.

    Args:
        message: what is odd, with the value, and what to do; it is shortened and escaped as that of
            a :class:`CbaganOmplError`.
    """

    def __init__(self, message: object = "") -> None:
        super().__init__(_plain(str(message)))


class MapError(CbaganOmplError):
    """A map, a map file or a task file that cannot be used."""


class TaskError(CbaganOmplError):
    """A start or goal that cannot be planned for on this map."""


class RobotError(CbaganOmplError):
    """A shape, a turning radius or a footprint file that is none, or does not fit the map."""


class HeatmapError(CbaganOmplError):
    """Values that are not a heat map of the grid that they came with."""


class ModelError(CbaganOmplError):
    """A file that is no exported model of this package, or does not match its record."""


class DatasetError(CbaganOmplError):
    """A training set that is missing, incomplete or malformed."""


class PlannerError(CbaganOmplError):
    """An unknown planner, or one that no hook of the installed OMPL reaches."""


class ConfigError(CbaganOmplError):
    """An option with a value that makes no sense, or an unknown option."""


class ClusterError(CbaganOmplError):
    """A cluster that cannot be reached, or whose workers cannot do the work."""


class MissingDependencyError(CbaganOmplError):
    """An optional package that the called function needs is not installed."""


def show(value: object) -> str:
    """Return a value as messages show it: like ``repr``, but short whatever the value is.

    Example:
        >>> show("maze.png"), len(show(list(range(10**6)))) < 100
        ("'maze.png'", True)
    """
    try:
        return _SHORT.repr(value)
    except Exception:  # a class that is called like one of Python's own, such as "int"
        return f"<{type(value).__name__}>"


class _Short(Repr):
    """A ``repr`` that takes little time and space, and raises nothing."""

    def __init__(self) -> None:
        super().__init__()
        self.maxlevel, self.maxstring, self.maxother = 3, 200, 200

    def repr_int(self, x: int, level: int) -> str:
        if x.bit_length() > _LONGEST_INTEGER:
            return f"<an integer of {x.bit_length()} bits>"
        return repr(x)

    def repr_bytes(self, x: bytes, level: int) -> str:
        return repr(x) if len(x) <= self.maxother else f"<{len(x)} bytes>"

    repr_bytearray = repr_bytes

    def repr_instance(self, x: object, level: int) -> str:
        try:
            return super().repr_instance(x, level)
        except Exception:  # whatever the class of the value does
            return f"<{type(x).__name__}>"


_SHORT = _Short()


def _plain(message: str) -> str:
    message = _shorten(message)
    if message.isprintable():
        return message
    # Escapes have up to ten characters each.
    return _shorten("".join(c if c.isprintable() or c == "\n" else _escape(c) for c in message))


def _shorten(text: str) -> str:
    if len(text) <= _LONGEST_MESSAGE:
        return text
    return f"{text[: _LONGEST_MESSAGE - _TAIL]} [...] {text[-_TAIL:]}"


def _escape(character: str) -> str:
    return ascii(character)[1:-1]
