"""The zip archives that torch writes, checked by their directory before anything in them is read.

torch believes what an archive says of itself: it allocates what a member claims, compares no
checksums, and reads past the end of members that are too short. So nothing reaches torch that this
module and :mod:`.tensor_pickles` have not checked.
"""

from __future__ import annotations

import io
import zipfile
from collections.abc import Mapping

#: Most bytes that compressed members may have beyond the size of the file. Weights are stored as
#: they are; the code of a network and its record take some ten kilobytes.
MAX_EXPANSION = 2**24

# Most members: two or three for each weight of a network.
_MAX_MEMBERS = 20_000

_ENTRY, _HEADER = b"PK\x01\x02", b"PK\x03\x04"
_HEADER_BYTES = 30
_ENCRYPTED = 1


class Archive:
    """The members of an archive by their names, without the folder that all of them are in.

    Attributes:
        sizes: of the members, in bytes.

    Args:
        data: the content of the file.

    Raises:
        ValueError: the archive is damaged, or of a form that torch does not write.
        Exception: of other types; :mod:`zipfile` lets many through.
    """

    def __init__(self, data: bytes) -> None:
        # Before a Python object is made for each of them.
        if data.count(_ENTRY) > _MAX_MEMBERS:
            raise ValueError(f"it has more than {_MAX_MEMBERS} members")
        self._file = zipfile.ZipFile(io.BytesIO(data))
        members = sorted(self._file.infolist(), key=lambda member: member.header_offset)
        _check_layout(members, data, self._file.start_dir)
        folders = {member.filename.partition("/")[0] for member in members}
        self._members = {member.filename.partition("/")[2]: member for member in members}
        # Without regard to case, like the reader in torch.
        if len(folders) != 1 or len({name.casefold() for name in self._members}) != len(members):
            raise ValueError("its members are not in one folder, or two have the same name")
        self.sizes = {name: member.file_size for name, member in self._members.items()}

    def read(self, name: str, limit: int = MAX_EXPANSION) -> bytes:
        """Return the content of a member, whose size and checksum agree with the directory.

        Args:
            name: without the folder.
            limit: most bytes that it may have.

        Raises:
            ValueError: the content is damaged, or larger.
            Exception: of other types.
        """
        if self.sizes[name] > limit:
            raise ValueError(f"{name} has more than {limit} bytes")
        content = self._file.read(self._members[name])
        if len(content) != self.sizes[name]:
            raise ValueError(f"{name} is cut short")
        return content


def _check_layout(members: list[zipfile.ZipInfo], data: bytes, end: int) -> None:
    """Raise if members overlap, expand, or cannot be read.

    Args:
        members: in the order of their places.
        data: the content of the file.
        end: of the last member.
    """
    if not members or members[0].header_offset != 0 or not data.startswith(_HEADER):
        raise ValueError("its members are not where its directory says")
    for member in members:
        if member.flag_bits & _ENCRYPTED:
            raise ValueError("a member is encrypted")
        if member.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
            raise ValueError(f"a member is compressed by method {member.compress_type}")
        if member.compress_type == zipfile.ZIP_STORED and member.compress_size != member.file_size:
            raise ValueError("a stored member has two sizes")
    begins = [member.header_offset for member in members[1:]] + [end]
    for member, limit in zip(members, begins, strict=True):
        if member.header_offset + _HEADER_BYTES + member.compress_size > limit:
            raise ValueError("members overlap")
    total = sum(member.file_size for member in members)
    if total > len(data) + MAX_EXPANSION:
        raise ValueError(f"its members expand to {total} bytes")


def pack(members: Mapping[str, bytes]) -> bytes:
    """Return an archive of members that have been checked, in the form that torch reads."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as file:
        for name, content in members.items():
            file.writestr(zipfile.ZipInfo(f"archive/{name}"), content)
    return buffer.getvalue()
