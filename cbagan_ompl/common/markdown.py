"""Tables in Markdown."""

from __future__ import annotations

from collections.abc import Iterable, Sequence


def table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table, without a line break at its end.

    Args:
        header: of the columns.
        rows: cells as Markdown; line breaks in them become blanks, and "|" is escaped.

    Example:
        >>> print(table(["map", "cost"], [["maze", "12"]]))
        | map | cost |
        | --- | --- |
        | maze | 12 |
    """
    lines = [header, ["---"] * len(header), *rows]
    return "\n".join(f"| {' | '.join(map(_fit_cell, line))} |" for line in lines)


def _fit_cell(text: str) -> str:
    return " ".join(text.splitlines()).replace("|", "\\|")
