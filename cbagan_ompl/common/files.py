"""Reading files whole, with this package's exceptions."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from ..errors import ConfigError, MapError


def read_bytes(path: Path) -> bytes:
    """The content of a map or task file.

    Raises:
        MapError: it is missing, a folder, or may not be read.
    """
    try:
        return path.read_bytes()
    # A path with a NUL character is a ValueError.
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise MapError(f"cannot read {path}: {reason}") from error


def read_text(path: Path) -> str:
    """The content of a text file in UTF-8, with or without byte order mark.

    Raises:
        MapError: it cannot be read, or is no text.
    """
    try:
        return read_bytes(path).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise MapError(f"{path} is no text file in UTF-8: {error}") from error


def check_folder(path: str | None) -> None:
    """Refuse a file that cannot be written for lack of its folder, before any work is done.

    Args:
        path: of the file; None when none is wanted.

    Raises:
        ConfigError: its folder does not exist.
    """
    if path is not None and not Path(path).parent.is_dir():
        raise ConfigError(f"cannot write {path}: its folder does not exist")


def write_json(path: str, values: dict[str, Any]) -> None:
    """Write values as indented JSON.

    Raises:
        ConfigError: the file cannot be written.
    """
    try:
        Path(path).write_text(json.dumps(values, indent=2) + "\n", encoding="utf-8")
    except OSError as error:
        raise ConfigError(f"cannot write {path}: {error.strerror or error}") from error
