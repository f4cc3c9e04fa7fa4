"""What an archive may hold, and how large it may be once unpacked."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

from ..errors import show

#: Most files and folders in an archive, and bytes in all of them together.
MAX_MEMBERS, MAX_TOTAL = 2**17, 2**31

#: An archive may grow to so many times its size, beyond so many bytes that are not counted.
MAX_RATIO, FREE_BYTES = 200, 2**24

#: Most characters of a name and of each of its parts, bytes in UTF-8, and folders on the way.
_MAX_NAME, _MAX_PART, _MAX_DEPTH = 1024, 255, 32

#: Bytes that are held in memory at a time.
BLOCK = 2**16


class ArchiveError(Exception):
    """An archive that is not unpacked; says why, without the name of the archive."""


class Member(NamedTuple):
    """A file or folder in an archive.

    Attributes:
        name: as it is stored.
        is_folder: whether it is a folder.
        blocks: the content of a file, to be read before the next member is.
    """

    name: str
    is_folder: bool
    blocks: Iterable[bytes] = ()


def check_name(name: str) -> tuple[str, ...]:
    """Return the parts of a member's name, none for the folder that all are in.

    Raises:
        ArchiveError: it is absolute, leads upwards, has a NUL character or is too long.
    """
    if len(name) > _MAX_NAME:
        raise ArchiveError(f"the name {show(name)} has more than {_MAX_NAME} characters")
    parts = tuple(part for part in name.split("/") if part not in ("", "."))
    if name.startswith("/") or ".." in parts or "\0" in name:
        raise ArchiveError(f"the name {show(name)} leads out of the folder, or is none")
    try:
        longest = max((len(part.encode()) for part in parts), default=0)
    except UnicodeEncodeError as error:
        raise ArchiveError(f"the name {show(name)} is no text") from error
    if longest > _MAX_PART or len(parts) > _MAX_DEPTH:
        raise ArchiveError(
            f"the name {show(name)} has a part of more than {_MAX_PART} bytes, or more than "
            f"{_MAX_DEPTH} parts"
        )
    return parts


def check_growth(unpacked: int, packed: int) -> None:
    """Raise if an archive grows too much.

    Args:
        unpacked: bytes that have come out of it, or will.
        packed: bytes of the archive that they came from.

    Raises:
        ArchiveError: there are more than :data:`MAX_TOTAL`, or more than :data:`MAX_RATIO` for
            each byte of the archive.
    """
    if unpacked > MAX_TOTAL:
        raise ArchiveError(f"it holds more than {MAX_TOTAL / 2**30:g} GiB")
    if unpacked > FREE_BYTES + MAX_RATIO * packed:
        raise ArchiveError(f"it grows to more than {MAX_RATIO} times its size")
