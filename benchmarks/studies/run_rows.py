"""The runs of a study in a file, so that a study that was interrupted goes on where it was."""

from __future__ import annotations

import json
from os import PathLike
from pathlib import Path
from typing import Any


class RunRows:
    """The runs that have ended, each a line of JSON with a key of its own.

    Attributes:
        rows: of all runs, in the order in which they ended.
        keys: of these runs.

    Args:
        path: of the file; it is made with the first run.
    """

    def __init__(self, path: str | PathLike[str]) -> None:
        self._path = Path(path)
        lines = self._path.read_text().splitlines() if self._path.exists() else []
        self.rows: list[dict[str, Any]] = [json.loads(line) for line in lines]
        self.keys = {tuple(row["key"]) for row in self.rows}

    def add(self, key: tuple[Any, ...], values: dict[str, Any]) -> None:
        """Write a run down.

        Args:
            key: of the run.
            values: what was measured.
        """
        self.rows.append({"key": key, **values})
        self.keys.add(key)
        with self._path.open("a") as file:
            file.write(json.dumps(self.rows[-1]) + "\n")
