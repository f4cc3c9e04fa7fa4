"""The lines of OMPL's benchmark logs: what is taken from them, and what is refused."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence

from ..errors import ConfigError, show

#: What stands before and after a text of several lines.
BLOCK_BEGIN, BLOCK_END = "<<<|", "|>>>"

#: Largest log that is read, in bytes: that of all runs on one task.
MAX_LOG_BYTES = 2**24

# Limits of memory: lines, points in time of all runs, values of all of them.
_MAX_LINES, _MAX_POINTS, _MAX_VALUES = 100_000, 400_000, 3_000_000

#: Types of properties, which become those of columns. OMPL uses no others.
TYPES = ("BOOLEAN", "DOUBLE", "ENUM", "INTEGER", "REAL", "TEXT", "VARCHAR")

# Names of properties with their types.
_PROPERTY = re.compile(f"[A-Za-z][A-Za-z0-9_ %.-]{{0,99}} ({'|'.join(TYPES)})")

# Columns that every table of this kind has.
_RESERVED = {
    *("id", "experimentid", "plannerid", "runid", "name", "totaltime", "timelimit", "memorylimit"),
    *("runcount", "version", "hostname", "cpuinfo", "date", "seed", "setup"),
}

#: Numbers as C++ writes them, with up to 309 digits: pattern of finite ones, and of values, which
#: may also be infinite, no number or missing.
FINITE = r"[+-]?[0-9]{1,320}(?:\.[0-9]{0,320})?(?:[eE][+-]?[0-9]{1,3})?"
NUMBER = re.compile(rf"{FINITE}|[+-]?inf|[+-]?nan|")


class LogLines:
    """The lines of a log, read one after the other.

    Its methods raise ValueError for lines of another form.

    Attributes:
        number: of the line that was read last.

    Args:
        text: of the log.

    Raises:
        ConfigError: the text is too long.
    """

    def __init__(self, text: str) -> None:
        if len(text) > MAX_LOG_BYTES or text.count("\n") > _MAX_LINES:
            raise ConfigError(
                f"no benchmark log of OMPL: it has more than {MAX_LOG_BYTES / 2**20:g} MiB or "
                f"{_MAX_LINES} lines"
            )
        self._lines = text.splitlines()
        self._values = self._points = 0
        self.number = 0

    def next(self) -> str:
        """Return the next line."""
        if self.number == len(self._lines):
            raise ValueError("the text ends here")
        self.number += 1
        return self._lines[self.number - 1]

    def end(self) -> None:
        """Raise if anything but empty lines follows."""
        if any(self._lines[self.number :]):
            raise ValueError("text follows the last planner")

    def match(self, pattern: str, default: str | None = None) -> str:
        """Return what the pattern's group matches in the next line, or ``default`` if none does."""
        found = re.fullmatch(pattern, self.next())
        if found:
            return found[1]
        self.number -= 1
        if default is None:
            raise ValueError(f"expected {pattern!r}")
        return default

    def block(self) -> str:
        """Return the text of an optional block of lines."""
        if not self.match(f"({re.escape(BLOCK_BEGIN)})", ""):
            return ""
        return "\n".join(iter(self.next, BLOCK_END))

    def several(self, count_pattern: str, default: str | None = None) -> tuple[str, ...]:
        """Return as many lines as the next line announces."""
        return tuple(self.next() for _ in range(int(self.match(count_pattern, default))))

    def properties(self, count_pattern: str, default: str | None = None) -> tuple[str, ...]:
        """Return the names of properties, as many as the next line announces."""
        names = self.several(count_pattern, default)
        check_names(names)
        return names

    def points(self, row: str, names: Sequence[str]) -> tuple[dict[str, str], ...]:
        """Return the points in time of a row, each ``value,value,`` before a semicolon."""
        *points, rest = row.split(";")
        self._points += len(points)
        if rest or self._points > _MAX_POINTS:
            raise ValueError(f"more than {_MAX_POINTS} points, or none that end with a semicolon")
        return tuple(self.values(point, names, ",") for point in points)

    def values(self, row: str, names: Sequence[str], separator: str) -> dict[str, str]:
        """Return the numbers of a row by name; each is empty, or a number as OMPL writes it."""
        *values, rest = row.split(separator)
        self._values += len(values)
        if rest or len(values) != len(names) or self._values > _MAX_VALUES:
            raise ValueError(f"expected {len(names)} values, each before {separator!r}")
        for value in values:
            if not NUMBER.fullmatch(value):
                raise ValueError(f"{show(value)} is no number")
        return dict(zip(names, values, strict=True))


def check_names(names: Iterable[str]) -> None:
    """Raise ValueError unless the names of properties are such that a table can have them."""
    seen = set(_RESERVED)
    for name in names:
        if not _PROPERTY.fullmatch(name):
            raise ValueError(f"{show(name)} is no name of a property with its type")
        column = re.sub("[ _.%-]", "", name.rpartition(" ")[0]).lower()
        if column in seen:
            raise ValueError(f"the property {show(name)} is there twice, or is called like another")
        seen.add(column)
