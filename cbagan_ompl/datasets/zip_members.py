"""Members of a zip archive: stored or deflated, each within its own bytes of the archive.

The format is that of https://pkware.cachefly.net/webdocs/casestudies/APPNOTE.TXT.
"""

from __future__ import annotations

import os
import stat
import struct
import zlib
from collections.abc import Iterator
from typing import BinaryIO, NamedTuple

from ..errors import show
from .archive_limits import BLOCK, MAX_MEMBERS, ArchiveError, Member, check_growth

#: What the files begin with, empty ones included.
MAGIC = (b"PK\3\4", b"PK\5\6")

_END, _LOCATOR, _END_64 = (struct.Struct(layout) for layout in ("<4s4H2LH", "<4sLQL", "<4sQ2H2L4Q"))
_ENTRY, _LOCAL = struct.Struct("<4s6H3L5H2L"), struct.Struct("<4s5H3L2H")
_MAX_COMMENT = 2**16
_ENCRYPTED, _UTF_8, _STORED, _DEFLATED, _UNIX = 0x1, 0x800, 0, 8, 3
_WIDE = 0xFFFFFFFF


class _Entry(NamedTuple):
    """A member as the list at the end of the archive describes it."""

    offset: int
    name: bytes
    flags: int
    method: int
    checksum: int
    packed: int
    unpacked: int

    @property
    def text(self) -> str:
        try:
            return self.name.decode("utf-8" if self.flags & _UTF_8 else "cp437")
        except UnicodeDecodeError as error:
            raise ArchiveError(f"the name {show(self.name)} is not in UTF-8") from error


def read_zip(file: BinaryIO) -> Iterator[Member]:
    """Yield the members of a zip archive.

    Raises:
        ArchiveError: it is damaged or encrypted, holds others than files and folders, members that
            overlap or have other sizes than announced, or grows too much.
    """
    size = os.fstat(file.fileno()).st_size
    count, start, length = _find_list(file, size)
    entries = sorted(_parse_entries(_read(file, start, length), count))
    check_growth(sum(entry.unpacked for entry in entries), size)
    end = 0
    for entry in entries:
        if entry.offset < end:
            raise ArchiveError("members overlap")
        header = _LOCAL.unpack(_read(file, entry.offset, _LOCAL.size))
        name_length, extra_length = header[9:]
        begin = entry.offset + _LOCAL.size + name_length + extra_length
        end = begin + entry.packed
        name = _read(file, entry.offset + _LOCAL.size, name_length)
        if header[0] != b"PK\3\4" or name != entry.name or end > start:
            raise ArchiveError(f"the header of {show(entry.text)} does not fit to the list")
        file.seek(begin)
        yield Member(entry.text, entry.name.endswith(b"/"), _content(file, entry))


def _find_list(file: BinaryIO, size: int) -> tuple[int, int, int]:
    """Return the number of entries of the list, where it starts, and its length."""
    begin = max(0, size - _MAX_COMMENT - _END.size)
    tail = _read(file, begin, size - begin)
    at = tail.rfind(b"PK\5\6")
    if at < 0 or at + _END.size > len(tail):
        raise ArchiveError("it is truncated, get a complete copy")
    _, disk, first_disk, here, count, length, start, _ = _END.unpack_from(tail, at)
    if _WIDE in (length, start) or 0xFFFF in (here, count):
        if at < _LOCATOR.size:
            raise ArchiveError("its end makes no sense")
        mark, _, position, _ = _LOCATOR.unpack_from(tail, at - _LOCATOR.size)
        if mark == b"PK\6\7":
            wide = _END_64.unpack(_read(file, position, _END_64.size))
            mark, (disk, first_disk, here, count, length, start) = wide[0], wide[4:]
            if mark != b"PK\6\6":
                raise ArchiveError("its end makes no sense")
    if disk or first_disk or here != count or start + length > size:
        raise ArchiveError("its end makes no sense, or it comes in several parts")
    if count > MAX_MEMBERS or length > MAX_MEMBERS * 2**8:
        raise ArchiveError(f"it has more than {MAX_MEMBERS} members, or very long names")
    return count, start, length


def _parse_entries(data: bytes, count: int) -> Iterator[_Entry]:
    at = 0
    for _ in range(count):
        if at + _ENTRY.size > len(data):
            raise ArchiveError("the list of its members is truncated")
        fields = _ENTRY.unpack_from(data, at)
        mark, made_by, _, flags, method, _, _, checksum, packed, unpacked = fields[:10]
        name_length, extra_length, comment_length, _, _, attributes, offset = fields[10:]
        at += _ENTRY.size
        name = data[at : at + name_length]
        extra = data[at + name_length : at + name_length + extra_length]
        at += name_length + extra_length + comment_length
        if mark != b"PK\1\2" or at > len(data):
            raise ArchiveError("the list of its members makes no sense")
        unpacked, packed, offset = _widen((unpacked, packed, offset), extra)
        entry = _Entry(offset, name, flags, method, checksum, packed, unpacked)
        kind = stat.S_IFMT(attributes >> 16) if made_by >> 8 == _UNIX else 0
        if kind not in (0, stat.S_IFREG, stat.S_IFDIR):
            raise ArchiveError(
                f"{show(entry.text)} is a link or a device; only files and folders are unpacked"
            )
        if flags & _ENCRYPTED:
            raise ArchiveError(f"{show(entry.text)} is encrypted")
        if method not in (_STORED, _DEFLATED) or (method == _STORED and packed != unpacked):
            raise ArchiveError(
                f"{show(entry.text)} is packed by method {method}, or has sizes that make no sense"
            )
        yield entry


def _widen(values: tuple[int, ...], extra: bytes) -> tuple[int, ...]:
    """Return sizes and offset, those that do not fit in four bytes from the extra field 1."""
    if _WIDE not in values:
        return values
    at = 0
    while at + 4 <= len(extra):
        kind, length = struct.unpack_from("<2H", extra, at)
        field = extra[at + 4 : at + 4 + length]
        if kind == 1 and len(field) >= 8 * values.count(_WIDE):
            wide = iter(struct.unpack(f"<{len(field) // 8}Q", field[: len(field) // 8 * 8]))
            return tuple(next(wide) if value == _WIDE else value for value in values)
        at += 4 + length
    raise ArchiveError("a member has sizes that make no sense")


def _content(file: BinaryIO, entry: _Entry) -> Iterator[bytes]:
    """Yield the content of a member, and raise unless it is what the list announces."""
    checksum = found = 0
    for block in _inflate(file, entry):
        found += len(block)
        if found > entry.unpacked:
            break
        checksum = zlib.crc32(block, checksum)
        yield block
    if found != entry.unpacked or checksum != entry.checksum:
        raise ArchiveError(f"{show(entry.text)} is damaged, or has another size than announced")


def _inflate(file: BinaryIO, entry: _Entry) -> Iterator[bytes]:
    inflate = zlib.decompressobj(-15)
    missing = entry.packed
    while missing:
        block = file.read(min(missing, BLOCK))
        if not block:
            raise ArchiveError("it is truncated, get a complete copy")
        missing -= len(block)
        if entry.method == _STORED:
            yield block
        while block and entry.method == _DEFLATED and not inflate.eof:
            try:
                unpacked = inflate.decompress(block, BLOCK)
            except zlib.error as error:
                raise ArchiveError(f"{show(entry.text)} is damaged ({error})") from error
            yield unpacked
            block = inflate.unconsumed_tail
    if entry.method == _DEFLATED and not inflate.eof:
        yield inflate.flush()


def _read(file: BinaryIO, start: int, length: int) -> bytes:
    """Return bytes of the archive, all of them."""
    if start + length > os.fstat(file.fileno()).st_size:
        raise ArchiveError("it is truncated, or a position in it makes no sense")
    file.seek(start)
    return file.read(length)
