"""What may be written over: never an input, and nobody else's file unless that is asked for."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from .. import __version__
from ..errors import ConfigError
from .files import check_folder, open_regular, write_json

#: What every file of ours says of itself, near its begin or its end.
MADE_BY = f"cbagan-ompl {__version__}"
# As it is written in JSON, PNG, PDF, SVG, PostScript, JPEG and Markdown files: the name alone would
# also be found in a text about this package.
_SIGNATURE = re.compile(
    rb'\A\{\s*"made_by": "cbagan-ompl |Software\0cbagan-ompl |/Creator \(cbagan-ompl '
    rb"|<dc:title>cbagan-ompl |%%Creator: cbagan-ompl |\xff\xfe\0.cbagan-ompl "
    rb"|Made by cbagan-ompl "
    # A table of a path has no place for a name: its first line stands for it.
    rb"|\Ax,y(,yaw)?,index\n",
    re.DOTALL,
)
_SEARCHED = 2**16


def check_output(
    path: str | None, inputs: Iterable[str | os.PathLike[str]] = (), *, force: bool = False
) -> None:
    """Raise if a file cannot be written, or would replace what it must not, before any work.

    Args:
        path: of the file; None when none is wanted.
        inputs: files that the command reads; others than files are passed over.
        force: whether files that are not ours may be replaced. Inputs never are.

    Raises:
        ConfigError: the folder does not exist, the file is an input, or it is not ours.
    """
    check_folder(path)
    if path is None or not os.path.exists(path):
        return
    for given in inputs:
        if os.path.exists(given) and os.path.samefile(given, path):
            raise ConfigError(f"cannot write {path}: it is what the command reads")
    if not force and not _is_ours(Path(path)):
        raise ConfigError(
            f"cannot write {path}: it exists, and is not known to be written by cbagan-ompl; "
            "choose another name, or say --force"
        )


def check_distinct(*paths: str | None) -> None:
    """Raise if two outputs of a command are one file.

    Args:
        *paths: of the files; None for those that are not wanted.

    Raises:
        ConfigError: two of them are the same.

    Example:
        >>> check_distinct("path.csv", None, None, "path.png")
    """
    seen = set()
    for path in filter(None, paths):
        file = os.path.realpath(path)
        if file in seen:
            raise ConfigError(f"cannot write {path} twice: give each output a name of its own")
        seen.add(file)


def write_report(path: str, values: Mapping[str, Any]) -> None:
    """Write values as JSON, with a first entry that says what wrote them.

    Raises:
        ConfigError: the file cannot be written.
    """
    write_json(path, {"made_by": MADE_BY, **values})


def _is_ours(path: Path) -> bool:
    with open_regular(path, ConfigError) as file:
        if _SIGNATURE.search(file.read(_SEARCHED)):
            return True
        file.seek(max(0, os.fstat(file.fileno()).st_size - _SEARCHED))
        return _SIGNATURE.search(file.read(_SEARCHED)) is not None
