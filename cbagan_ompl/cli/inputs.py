"""The files that a command reads, which none may write over."""

from __future__ import annotations

import argparse

# Names under which commands keep them, but for maps.
_ARGUMENTS = (
    "heatmap",
    "footprint",
    "model",
    "checkpoint",
    "dataset",
    "path",
    "config",
    "inception",
    "start_from",
)


def input_files(args: argparse.Namespace) -> list[str]:
    """Return the files that a command reads, those that a map names among them.

    Args:
        args: the parsed arguments of the command.
    """
    files: list[str] = []
    for name in _ARGUMENTS:
        given = getattr(args, name, None)
        values = given if isinstance(given, list) else [given]
        files += (value for value in values if isinstance(value, str))
    path = getattr(args, "map", None)
    if path is not None:
        from ..maps.loading import map_files
        from ..maps.tasks import task_files

        files += map(str, (*map_files(path), *task_files(path)))
    return files
