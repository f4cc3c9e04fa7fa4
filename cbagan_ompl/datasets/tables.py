"""Lists of files in CSV, as training sets and stored predictions have them."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterator, Sequence
from pathlib import Path

from ..common.files import read_text
from ..errors import DatasetError, show

#: Most lines of a list, characters of a line, and bytes of the file.
MAX_LINES, MAX_LINE, MAX_BYTES = 2**19, 2**14, 2**25


def read_table(path: Path, columns: Sequence[str]) -> list[tuple[str, ...]]:
    """Read some columns of a CSV file whose first line names them.

    Args:
        path: of the file.
        columns: their names; the file may have more of them.

    Returns:
        The cells of these columns, none of them empty, of each line that is not empty.

    Raises:
        DatasetError: the file cannot be read, has too many lines, a line that is too long, lacks a
            column, or has a line that lacks a cell.
    """
    text = read_text(path, DatasetError, MAX_BYTES)
    lines = text.count("\n") + text.count("\r")
    if lines > 2 * MAX_LINES:
        raise DatasetError(f"{path}: about {lines} lines, lists up to {MAX_LINES} lines are read")
    try:
        reader = csv.reader(_split_lines(text, path))
        header = next(reader, [])
        missing = sorted(set(columns) - set(header))
        if missing:
            raise DatasetError(
                f"{path}: column {', '.join(missing)} is missing; the columns are "
                f"{', '.join(columns)}"
            )
        places = [header.index(column) for column in columns]
        rows: list[tuple[str, ...]] = []
        for row in reader:
            if not row:
                continue
            if len(rows) == MAX_LINES:
                raise DatasetError(f"{path}: lists up to {MAX_LINES} lines are read")
            cells = tuple(row[place] for place in places if place < len(row))
            if len(cells) < len(columns) or not all(cells):
                raise DatasetError(f"{path}: line {show(row)} has an empty or missing cell")
            rows.append(cells)
    except csv.Error as error:
        raise DatasetError(f"{path}: cannot read the list ({error})") from error
    return rows


def _split_lines(text: str, path: Path) -> Iterator[str]:
    for line in re.finditer(r"[^\r\n]*(?:\r\n|\r|\n)|[^\r\n]+", text):
        if line.end() - line.start() > MAX_LINE:
            raise DatasetError(f"{path}: a line of more than {MAX_LINE} characters")
        yield line.group()
