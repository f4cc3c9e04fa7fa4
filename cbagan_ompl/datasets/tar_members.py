"""Members of a tar archive: the formats of POSIX (ustar, pax) and GNU, plain or packed."""

from __future__ import annotations

import bz2
import lzma
import re
import zlib
from collections.abc import Callable, Iterator
from typing import Any, BinaryIO

from ..errors import show
from .archive_limits import BLOCK, ArchiveError, Member, check_growth

_RECORD = 512
# Types of members: files, folders; and records that say more of the next member, or of all.
_FILES, _FOLDER = (b"0", b"\0"), b"5"
_LONG_NAME, _LONG_LINK, _PAX, _PAX_GLOBAL = b"L", b"K", b"x", b"g"
_OTHERS = {b"1": "a hard link", b"2": "a symbolic link", b"S": "a sparse file"}

_TRUNCATED = "it is truncated, get a complete copy"

# Longest record of that kind, and most of them in a row.
_MAX_EXTENSION, _MAX_EXTENSIONS = 2**20, 8

# Packed streams in a row, and memory that unpacking one of xz may take, in bytes.
_MAX_STREAMS, _MAX_XZ_MEMORY = 2**17, 2**27


def read_tar(file: BinaryIO) -> Iterator[Member]:
    """Yield the members of a tar archive.

    Raises:
        ArchiveError: it is damaged, holds others than files and folders, or grows too much.
    """
    stream = _Stream(file)
    while (described := _describe_next(stream)) is not None:
        kind, name, size = described
        is_folder = kind == _FOLDER or (kind in _FILES and name.endswith("/"))
        if kind not in _FILES and not is_folder:
            what = _OTHERS.get(kind, f"a member of type {show(kind.decode('latin-1'))}")
            raise ArchiveError(f"{show(name)} is {what}; only files and folders are unpacked")
        if is_folder:
            size = 0  # whatever is announced, nothing follows
        blocks = stream.blocks(size)
        yield Member(name, is_folder, blocks)
        for _ in blocks:  # what nobody has read
            pass
        stream.read(-size % _RECORD)


def _describe_next(stream: _Stream) -> tuple[bytes, str, int] | None:
    """Return type, name and size of the next member; None at the end."""
    extension: dict[str, Any] = {}
    for _ in range(_MAX_EXTENSIONS):
        header = stream.read(_RECORD, may_end=True)
        if not header.strip(b"\0"):  # the end, which some writers leave out
            return None
        kind, name, size = _parse_header(header)
        if kind not in (_LONG_NAME, _LONG_LINK, _PAX, _PAX_GLOBAL):
            return kind, extension.get("path", name), extension.get("size", size)
        if size > _MAX_EXTENSION:
            break
        text = stream.read(-(-size // _RECORD) * _RECORD)[:size]
        if kind == _LONG_NAME:
            extension["path"] = _decode_name(text.rstrip(b"\0"))
        elif kind == _PAX:
            extension |= _parse_pax(text)
        elif kind == _PAX_GLOBAL:
            _parse_pax(text)  # raises for sparse files; dates and comments do not matter
    raise ArchiveError("the description of a member is too long")


def _parse_header(header: bytes) -> tuple[bytes, str, int]:
    """Return type, name and size of a member."""
    checksum = _parse_number(header[148:156])
    if checksum != sum(header[:148]) + 8 * 32 + sum(header[156:]):
        raise ArchiveError("it has a header that is none")
    name = header[:100].partition(b"\0")[0]
    prefix = header[345:500].partition(b"\0")[0]
    if header[257:263] == b"ustar\0" and prefix:
        name = prefix + b"/" + name
    return header[156:157], _decode_name(name), _parse_number(header[124:136])


def _parse_number(field: bytes) -> int:
    """Return a number in octal digits, or in bytes behind 0x80 (GNU)."""
    if field[0] == 0x80:
        return int.from_bytes(field[1:], "big")
    digits = re.fullmatch(rb"[ \0]*([0-7]*)[ \0]*", field)
    if digits is None:  # 0xFF begins a negative number
        raise ArchiveError("a member has a size or checksum that is negative or none")
    return int(digits[1] or b"0", 8)


def _parse_pax(text: bytes) -> dict[str, Any]:
    """Return what an extended header says of path and size: lines "length key=value"."""
    found: dict[str, Any] = {}
    at = 0
    while at < len(text):
        match = re.compile(rb"(\d{1,6}) ([^=\n]{1,200})=").match(text, at)
        end = at + int(match[1]) if match is not None else 0
        if match is None or end <= match.end() or text[end - 1 : end] != b"\n":
            raise ArchiveError("an extended header makes no sense")
        value = text[match.end() : end - 1]
        if match[2].startswith(b"GNU.sparse."):
            raise ArchiveError("it holds a sparse file")
        if match[2] == b"path":
            found["path"] = _decode_name(value)
        elif match[2] == b"size":
            if re.fullmatch(rb"\d{1,20}", value) is None:
                raise ArchiveError("a member has a size that is negative or none")
            found["size"] = int(value)
        at = end
    return found


def _decode_name(name: bytes) -> str:
    try:
        return name.decode()
    except UnicodeDecodeError as error:
        raise ArchiveError(f"the name {show(name)} is not in UTF-8") from error


class _Stream:
    """The bytes of a tar archive, unpacked while they are read, and counted."""

    def __init__(self, file: BinaryIO) -> None:
        self._file = file
        start = file.read(6)
        file.seek(0)
        self._make: Callable[[], Any] | None = None
        if start.startswith(b"\x1f\x8b"):
            self._make = _Inflate
        elif start.startswith(b"BZh"):
            self._make = bz2.BZ2Decompressor
        elif start == b"\xfd7zXZ\0":
            self._make = lambda: lzma.LZMADecompressor(lzma.FORMAT_XZ, memlimit=_MAX_XZ_MEMORY)
        self._unpacker: Any = self._make() if self._make is not None else None
        self._streams = 1
        self._packed = self._unpacked = 0

    def read(self, size: int, may_end: bool = False) -> bytes:
        """Return so many bytes; none at the end of the archive, if it may end here."""
        return b"".join(self.blocks(size, may_end))

    def blocks(self, size: int, may_end: bool = False) -> Iterator[bytes]:
        """Yield so many bytes in parts."""
        missing = size
        while missing:
            block = self._unpack(min(missing, BLOCK))
            if not block:
                if may_end and missing == size:
                    return
                raise ArchiveError(_TRUNCATED)
            missing -= len(block)
            self._unpacked += len(block)
            check_growth(self._unpacked, self._packed)
            yield block

    def _unpack(self, most: int) -> bytes:
        """Return at least one byte and at most so many; none at the end."""
        if self._unpacker is None:
            return self._read_packed(most)
        try:
            return self._unpack_stream(most)
        except (zlib.error, lzma.LZMAError, OSError, EOFError, ValueError) as error:
            raise ArchiveError(f"it is damaged ({error})") from error

    def _unpack_stream(self, most: int) -> bytes:
        while True:
            if self._unpacker.eof:  # another stream may follow, or zeros that fill up a tape
                rest = self._unpacker.unused_data.lstrip(b"\0") or self._read_packed(BLOCK).lstrip(
                    b"\0"
                )
                if not rest:
                    return b""
                self._streams += 1
                if self._streams > _MAX_STREAMS:
                    raise ArchiveError("it is packed in too many parts")
                assert self._make is not None
                self._unpacker = self._make()
                block = self._unpacker.decompress(rest, most)
            else:
                packed = self._read_packed(BLOCK) if self._unpacker.needs_input else b""
                if not packed and self._unpacker.needs_input:
                    raise ArchiveError(_TRUNCATED)
                block = self._unpacker.decompress(packed, most)
            if block:
                return bytes(block)

    def _read_packed(self, most: int) -> bytes:
        block = self._file.read(most)
        self._packed += len(block)
        return block


class _Inflate:
    """A stream of gzip, with the methods of :class:`bz2.BZ2Decompressor`."""

    def __init__(self) -> None:
        self._inflate = zlib.decompressobj(wbits=31)

    @property
    def eof(self) -> bool:
        return self._inflate.eof

    @property
    def unused_data(self) -> bytes:
        return self._inflate.unused_data

    @property
    def needs_input(self) -> bool:
        return not (self._inflate.unconsumed_tail or self._inflate.eof)

    def decompress(self, data: bytes, most: int) -> bytes:
        return self._inflate.decompress(self._inflate.unconsumed_tail + data, most)
