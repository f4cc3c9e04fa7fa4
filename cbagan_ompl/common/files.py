"""Reading and writing files whole, with this package's exceptions."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..errors import CbaganOmplError, ConfigError, MapError


def reason(error: BaseException) -> str:
    """Return what an error says, in the words of the system where it has some.

    Example:
        >>> reason(FileNotFoundError(2, "No such file or directory", "map.png"))
        'No such file or directory'
    """
    return str(getattr(error, "strerror", None) or error)


def read_bytes(path: Path, error_class: type[CbaganOmplError] = MapError) -> bytes:
    """Return the content of a file.

    Args:
        path: the file.
        error_class: what to raise.

    Raises:
        CbaganOmplError: of that class; it is missing, a folder, or may not be read.
    """
    try:
        return path.read_bytes()
    # A path with a NUL character is a ValueError.
    except (OSError, ValueError) as error:
        raise error_class(f"cannot read {path}: {reason(error)}") from error


def read_text(path: Path, error_class: type[CbaganOmplError] = MapError) -> str:
    """Return the content of a text file in UTF-8, with or without byte order mark.

    Args:
        path: the file.
        error_class: what to raise.

    Raises:
        CbaganOmplError: of that class; it cannot be read, or is no text.
    """
    try:
        return read_bytes(path, error_class).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise error_class(f"{path} is no text file in UTF-8: {error}") from error


def check_folder(path: str | None) -> None:
    """Raise if a file cannot be written for lack of its folder, before any work is done.

    Args:
        path: of the file; None when none is wanted.

    Raises:
        ConfigError: its folder does not exist.
    """
    if path is not None and not Path(path).parent.is_dir():
        raise ConfigError(f"cannot write {path}: its folder does not exist")


def make_folder(path: Path, error_class: type[CbaganOmplError] = ConfigError) -> None:
    """Make a folder and those above it, where they are missing.

    Args:
        path: of the folder.
        error_class: what to raise.

    Raises:
        CbaganOmplError: of that class; the folder cannot be made.
    """
    try:
        path.mkdir(parents=True, exist_ok=True)
    except (OSError, ValueError) as error:
        raise error_class(f"cannot make the folder {path}: {reason(error)}") from error


def write_atomically(
    path: str | os.PathLike[str],
    data: bytes | str,
    error_class: type[CbaganOmplError] = ConfigError,
) -> None:
    """Write a file whole or not at all: no reader, and no interruption, meets half of it.

    Args:
        path: of the file; its folder must exist.
        data: its content, text as UTF-8.
        error_class: what to raise.

    Raises:
        CbaganOmplError: of that class; the file cannot be written.
    """
    target = Path(path)
    temporary = target.with_name(f"{target.name}.tmp")
    try:
        temporary.write_bytes(data.encode("utf-8") if isinstance(data, str) else data)
        os.replace(temporary, target)
    except (OSError, ValueError) as error:
        raise error_class(f"cannot write {target}: {reason(error)}") from error


def write_json(path: str | os.PathLike[str], values: Mapping[str, Any]) -> None:
    """Write values as indented JSON.

    Raises:
        ConfigError: the file cannot be written.
    """
    write_atomically(path, json.dumps(values, indent=2) + "\n")
