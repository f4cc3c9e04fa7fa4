"""Unpacking of downloaded archives: regular files and folders, in one folder, within limits.

The archive formats are read here and in :mod:`.tar_members` and :mod:`.zip_members`, not by
``tarfile`` and ``zipfile``: what these two extract has led out of the folder, never ended, or cost
more than a limit would have allowed (CVE-2025-4517, CVE-2025-8194). Nothing is extracted by its
mode, owner or link.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

from ..common.files import open_regular, reason
from ..errors import DatasetError, show
from ..maps.image_files import SUFFIXES
from .archive_limits import MAX_MEMBERS, ArchiveError, Member, check_name
from .tar_members import read_tar
from .zip_members import MAGIC, read_zip

# Of the files of a set; others are not written.
_SUFFIXES = (".csv", *SUFFIXES)


def unpack(path: Path, folder: Path) -> None:
    """Unpack the lists and images of an archive: .tar, perhaps in gzip, bzip2 or xz, or .zip.

    Args:
        path: of the archive.
        folder: new or empty, that the files are written into; made if missing.

    Raises:
        DatasetError: it is no such archive, damaged, or encrypted; it holds a link, a device, a
            sparse file, a name that leads out of the folder, is too long, or is there twice; it
            is larger than the limits of :mod:`.archive_limits`; or a file cannot be written.
    """
    with open_regular(path, DatasetError) as file:
        try:
            _write_members(_members(file), folder)
        except ArchiveError as error:
            raise DatasetError(
                f"{path}: neither a folder nor an archive that can be unpacked: {error}; "
                "if you trust it, unpack it yourself, and give the folder"
            ) from error
        except OSError as error:
            raise DatasetError(f"cannot unpack {path}: {reason(error)}") from error


def _members(file: BinaryIO) -> Iterator[Member]:
    start = file.read(4)
    file.seek(0)
    return read_zip(file) if start in MAGIC else read_tar(file)


def _write_members(members: Iterator[Member], folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    seen: dict[tuple[str, ...], bool] = {(): True}
    for count, member in enumerate(members, 1):
        if count > MAX_MEMBERS:
            raise ArchiveError(f"it has more than {MAX_MEMBERS} members")
        parts = check_name(member.name)
        if member.is_folder:
            continue  # made when something is to lie in it
        if parts in seen:
            raise ArchiveError(f"the name {show(member.name)} is there twice, or none")
        seen[parts] = False
        if not parts[-1].lower().endswith(_SUFFIXES):
            continue
        for depth in range(1, len(parts)):
            _add_folder(parts[:depth], folder, seen)
        # Every folder on the way is one that was made here, so nothing leads outside.
        with folder.joinpath(*parts).open("xb") as target:
            for block in member.blocks:
                target.write(block)


def _add_folder(parts: tuple[str, ...], folder: Path, seen: dict[tuple[str, ...], bool]) -> None:
    if parts not in seen:
        seen[parts] = True
        folder.joinpath(*parts).mkdir()
    elif not seen[parts]:
        raise ArchiveError(f"{show('/'.join(parts))} is a file and a folder")
