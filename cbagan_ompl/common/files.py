"""Reading and writing files whole, with this package's exceptions."""

from __future__ import annotations

import json
import os
import stat
from collections.abc import Mapping
from pathlib import Path
from typing import Any, BinaryIO

from ..errors import CbaganOmplError, ConfigError, MapError, show


def reason(error: BaseException) -> str:
    """Return what an error says, in the words of the system where it has some.

    Example:
        >>> reason(FileNotFoundError(2, "No such file or directory", "map.png"))
        'No such file or directory'
    """
    return str(getattr(error, "strerror", None) or error)


#: Largest file that is read whole unless its reader says otherwise, in bytes.
MAX_BYTES = 2**30

#: Largest text file that is parsed line by line or as a tree, in bytes.
MAX_TEXT_BYTES = 2**26


def as_path(path: str | os.PathLike[str], error_class: type[CbaganOmplError] = ConfigError) -> Path:
    """Return a path as a :class:`~pathlib.Path`.

    Raises:
        CbaganOmplError: of the class that is given; it is none.
    """
    try:
        return Path(path)
    except Exception as error:  # whatever the class of the value raises
        raise error_class(f"a path is a text or a pathlib.Path, got {show(path)}") from error


def read_bytes(
    path: Path, error_class: type[CbaganOmplError] = MapError, limit: int = MAX_BYTES
) -> bytes:
    """Return the content of a regular file: the one way in for every file that is read whole.

    Args:
        path: the file.
        error_class: what to raise.
        limit: most bytes that are read.

    Raises:
        CbaganOmplError: of that class; it is missing, a folder, a device or a pipe, larger than
            ``limit``, or may not be read.
    """
    with open_regular(path, error_class) as file:
        size = os.fstat(file.fileno()).st_size
        try:
            data = file.read(limit + 1) if size <= limit else b""
        except OSError as error:
            raise error_class(f"cannot read {path}: {reason(error)}") from error
    # Some files, such as those of the kernel, say that they are empty and are not.
    if max(size, len(data)) > limit:
        raise error_class(
            f"cannot read {path}: it has more than the {limit / 2**20:g} MiB that a file of this "
            "kind may have"
        )
    return data


def open_regular(path: Path, error_class: type[CbaganOmplError] = MapError) -> BinaryIO:
    """Open a regular file for reading; arguments and errors as for :func:`read_bytes`."""
    try:
        # Without waiting: a pipe that nobody writes to would be waited for without end.
        descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
    # A path with a NUL character is a ValueError.
    except (OSError, ValueError) as error:
        raise error_class(f"cannot read {path}: {reason(error)}") from error
    mode = os.fstat(descriptor).st_mode
    if not stat.S_ISREG(mode):
        os.close(descriptor)
        kind = "a folder" if stat.S_ISDIR(mode) else "a device or a pipe"
        raise error_class(f"cannot read {path}: it is {kind}, not a file")
    return os.fdopen(descriptor, "rb")


def read_text(
    path: Path, error_class: type[CbaganOmplError] = MapError, limit: int = MAX_TEXT_BYTES
) -> str:
    """Return the content of a text file in UTF-8, with or without byte order mark.

    Args:
        path: the file.
        error_class: what to raise.
        limit: most bytes that are read.

    Raises:
        CbaganOmplError: of that class; it cannot be read (see :func:`read_bytes`), or is no text.
    """
    try:
        return read_bytes(path, error_class, limit).decode("utf-8-sig")
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
    """Write a file whole or not at all, whoever reads it or interrupts this.

    Args:
        path: of the file; its folder must exist. Where it is a link, what it points to is written.
        data: its content, text as UTF-8.
        error_class: what to raise.

    Raises:
        CbaganOmplError: of that class; the file cannot be written, or is a folder, device or pipe.
    """
    encoded = data.encode("utf-8") if isinstance(data, str) else data
    try:
        target = Path(os.path.realpath(path))
        if target.exists() and not target.is_file():
            # A device would be replaced by a file, for all who use it.
            kind = "a folder" if target.is_dir() else "a device or a pipe"
            raise error_class(f"cannot write {path}: it is {kind}, not a file")
        # A name that is short, and nobody else's.
        temporary = target.with_name(f".{os.urandom(8).hex()}.tmp")
        try:
            with temporary.open("xb") as file:
                file.write(encoded)
            os.replace(temporary, target)
        except BaseException:
            temporary.unlink(missing_ok=True)
            raise
    except (OSError, ValueError) as error:
        raise error_class(f"cannot write {path}: {reason(error)}") from error


def write_json(path: str | os.PathLike[str], values: Mapping[str, Any]) -> None:
    """Write values as indented JSON.

    Raises:
        ConfigError: the file cannot be written.
    """
    write_atomically(path, json.dumps(values, indent=2) + "\n")
