"""What PNG, JPEG and BMP files say of themselves, and whether it is true.

Decoders believe sizes that a file announces, and spend memory on them; some give back the decoded
part of a truncated file. So every length is compared with the file before a decoder sees it.
"""

from __future__ import annotations

import re
import zlib
from collections.abc import Iterator
from typing import NamedTuple

# Chunks of a PNG, or segments of a JPEG, that are looked at, and scans of a JPEG.
_MAX_PARTS, _MAX_SCANS = 100_000, 100

# Bytes that may follow the pixels in the image data of a PNG.
_MAX_SURPLUS = 2**16
_BLOCK = 2**16

# By colour type of a PNG: values of a pixel, and possible bits of a value.
_PNG_TYPES = {
    0: (1, (1, 2, 4, 8, 16)),
    2: (3, (8, 16)),
    3: (1, (1, 2, 4, 8)),
    4: (2, (8, 16)),
    6: (4, (8, 16)),
}
# First column and row, and steps, of the passes of an interlaced PNG.
_ADAM7 = (
    (0, 0, 8, 8), (4, 0, 8, 8), (0, 4, 4, 8), (2, 0, 4, 4), (0, 2, 2, 4), (1, 0, 2, 2), (0, 1, 1, 2)
)  # fmt: skip

_JPEG_MARKER = re.compile(rb"\xff+([^\xff\0])")
# In the data of a scan FF 00 is a byte, and D0 to D7 are marks from which a decoder can go on.
_JPEG_SCAN_END = re.compile(rb"\xff[^\0\xd0-\xd7\xff]")
# Neither all ones, which fill up the last byte of a scan, nor the zeros that decoders fill in.
_PADDING = b"\x55"
_BASELINE, _PROGRESSIVE, _SCAN, _END = (0xC0, 0xC1), 0xC2, 0xDA, 0xD9

_BMP_HEADERS = (12, 40, 52, 56, 64, 108, 124)


class BrokenImageError(Exception):
    """An image file that cannot be decoded; says why, without the name of the file."""


class Header(NamedTuple):
    """What a file announces.

    Attributes:
        width: columns, at least 1.
        height: rows, at least 1.
        needed: bytes of memory that decoding takes.
        is_whole: whether the file reaches its end, as far as that is known before the pixels of a
            PNG are looked at.
    """

    width: int
    height: int
    needed: int
    is_whole: bool = True


def truncated(detail: str = "") -> BrokenImageError:
    """Return the error for a file that ends too early."""
    return BrokenImageError(f"the image is truncated{detail}, get a complete copy of the file")


def damaged(detail: str) -> BrokenImageError:
    """Return the error for a file that contradicts itself."""
    return BrokenImageError(f"the image is damaged or of a kind that cannot be decoded: {detail}")


def measure_png(data: bytes) -> Header:
    """Return what the header of a PNG file announces.

    Raises:
        BrokenImageError: it is cut off, or makes no sense.
    """
    width, height, _, _ = _png_header(data)
    depth, colour = data[24:26]
    channels = 4 if colour in (4, 6) or _has_transparency(data) else 1 if colour == 0 else 3
    return Header(width, height, width * height * channels * (2 if depth == 16 else 1))


def essential_png(data: bytes) -> bytes:
    """Return a PNG file without what decoding its pixels does not need.

    Profiles and texts may be compressed a thousandfold, and decoders inflate them.

    Raises:
        BrokenImageError: truncated or damaged; the data end before the pixels do, or long after.
    """
    width, height, bits, interlaced = _png_header(data)
    kept, pixels = [data[:8]], []
    for kind, start, end in _png_chunks(data):
        if kind not in (b"IHDR", b"PLTE", b"tRNS", b"IDAT", b"IEND"):
            if kind[:1].isupper():
                raise damaged(f"it has a chunk {kind.decode()}")
            continue
        if (kind == b"IHDR") != (start == 8):
            raise damaged("it does not begin with its header, or has two")
        if zlib.crc32(data[start + 4 : end - 4]) != int.from_bytes(data[end - 4 : end], "big"):
            raise damaged(f"the checksum of a chunk {kind.decode()} is wrong")
        kept.append(data[start:end])
        if kind == b"IDAT":
            pixels.append((start + 8, end - 4))
    _check_png_pixels(data, pixels, _png_pixel_bytes(width, height, bits, interlaced))
    return b"".join(kept)


def _png_header(data: bytes) -> tuple[int, int, int, bool]:
    """Return width, height, bits of a pixel, and whether the file is interlaced."""
    if len(data) < 33:
        raise truncated()
    width, height = int.from_bytes(data[16:20], "big"), int.from_bytes(data[20:24], "big")
    depth, colour, compression, filtering, interlace = data[24:29]
    channels, depths = _PNG_TYPES.get(colour, (0, ()))
    if (
        data[8:16] != b"\0\0\0\rIHDR"
        or depth not in depths
        or (compression, filtering, interlace) not in ((0, 0, 0), (0, 0, 1))
        or not (width and height)
    ):
        raise damaged("the header makes no sense")
    return width, height, channels * depth, interlace == 1


def _has_transparency(data: bytes) -> bool:
    try:
        return any(kind == b"tRNS" for kind, _, _ in _png_chunks(data))
    except BrokenImageError:  # raised again when the chunks are read
        return False


def _png_chunks(data: bytes) -> Iterator[tuple[bytes, int, int]]:
    """Yield kind, start and end of the chunks up to the last one; what follows does not count."""
    start = 8
    for _ in range(_MAX_PARTS):
        if start + 12 > len(data):
            raise truncated()
        length, kind = int.from_bytes(data[start : start + 4], "big"), data[start + 4 : start + 8]
        if not kind.isalpha():
            raise damaged("a chunk has no name")
        end = start + 12 + length
        if end > len(data):
            raise truncated(f" (a chunk of {length} bytes reaches beyond its end)")
        yield kind, start, end
        if kind == b"IEND":
            return
        start = end
    raise damaged(f"it has more than {_MAX_PARTS} chunks")


def _png_pixel_bytes(width: int, height: int, bits: int, interlaced: bool) -> int:
    """Return the length of all rows, each with the byte that names its filter."""
    total = 0
    for left, top, across, down in _ADAM7 if interlaced else ((0, 0, 1, 1),):
        columns, rows = -(-max(width - left, 0) // across), -(-max(height - top, 0) // down)
        if columns:
            total += rows * (1 + (columns * bits + 7) // 8)
    return total


def _check_png_pixels(data: bytes, pieces: list[tuple[int, int]], expected: int) -> None:
    """Inflate the pixels, without keeping them, and raise unless there are as many as expected."""
    inflate = zlib.decompressobj()
    surplus = 0
    view = memoryview(data)
    try:
        for start, end in pieces:
            for at in range(start, end, _BLOCK):
                block: bytes | memoryview = view[at : min(at + _BLOCK, end)]
                while len(block) and expected > 0:
                    expected -= len(inflate.decompress(block, 2**20))
                    block = inflate.unconsumed_tail
                surplus += len(block)
                if surplus > _MAX_SURPLUS:
                    raise damaged("it has more data than pixels")
        if expected > 0:
            expected -= len(inflate.flush())
    except zlib.error as error:
        raise damaged(str(error)) from error
    if expected > 0:
        raise truncated(f" ({expected} bytes of pixels are missing)")


def measure_jpeg(data: bytes) -> Header:
    """Return what a JPEG file announces.

    Raises:
        BrokenImageError: the segments make no sense.
    """
    frame: tuple[int, int, int, int] | None = None
    marker = scans = 0
    for marker, start, end in _jpeg_segments(data):
        # C0 to CF are frames, but for C4, C8 and CC, which are tables.
        if 0xC0 <= marker <= 0xCF and marker not in (0xC4, 0xC8, 0xCC):
            if frame is not None:
                raise damaged("it has two frames")
            frame = _jpeg_frame(marker, data[start:end])
        scans += marker == _SCAN
    if frame is None:
        raise truncated()
    width, height, components, kind = frame
    if scans > _MAX_SCANS:
        raise damaged(f"it has more than {_MAX_SCANS} scans")
    # Every block of 8 x 8 pixels takes at least one bit.
    is_whole = marker == _END and scans > 0 and len(data) * 512 >= width * height
    # With several scans the coefficients of the whole image are kept, two bytes each.
    several = kind == _PROGRESSIVE or scans > 1
    return Header(width, height, width * height * components * (3 if several else 1), is_whole)


def padded_jpeg(data: bytes) -> bytes:
    """Return a JPEG file with a byte more where the data of its pixels end.

    Decoders fill in what is missing there, without an error. Where nothing is missing they skip
    the byte, so that a file whose pixels are others with it was truncated or damaged. Only what
    follows the last mark from which a decoder can go on is tried: more padding would make the
    decoder complain of files that are whole.

    Args:
        data: a file that :func:`measure_jpeg` has found whole.
    """
    end = next(at for marker, at, _ in _jpeg_segments(data) if marker == _END)
    mark = data.rindex(b"\xff", 0, end)
    while data[mark - 1] == 0xFF:  # fill bytes
        mark -= 1
    return data[:mark] + _PADDING + data[mark:]


def _jpeg_segments(data: bytes) -> Iterator[tuple[int, int, int]]:
    """Yield marker, and begin and end of its segment, as far as the file reaches.

    The last marker is that of the end of the image.
    """
    at = 2
    for _ in range(_MAX_PARTS):
        found = _JPEG_MARKER.match(data, at)
        if found is None:
            return
        at, marker = found.end(), found[1][0]
        if marker == _END:
            yield marker, at, at
            return
        if marker == 0x01 or 0xD0 <= marker <= 0xD7:  # stand alone, without a length
            continue
        end = at + int.from_bytes(data[at : at + 2], "big")
        if end > len(data):
            return
        if end < at + 2 or marker == 0xD8:
            raise damaged("its segments make no sense")
        yield marker, at, end
        at = end
        if marker == _SCAN:
            following = _JPEG_SCAN_END.search(data, at)
            if following is None:
                return
            at = following.start()


def _jpeg_frame(marker: int, segment: bytes) -> tuple[int, int, int, int]:
    """Return width, height, components and kind of a frame."""
    if len(segment) < 8 or len(segment) != 8 + 3 * segment[7]:
        raise damaged("the frame makes no sense")
    height, width = int.from_bytes(segment[3:5], "big"), int.from_bytes(segment[5:7], "big")
    if marker not in (*_BASELINE, _PROGRESSIVE):
        raise damaged("it is neither baseline nor progressive")
    if not (width and height and 1 <= segment[7] <= 4):
        raise damaged("the frame has no pixels")
    return width, height, segment[7], marker


def measure_bmp(data: bytes) -> Header:
    """Return what the header of a BMP file announces.

    Raises:
        BrokenImageError: it is cut off, or makes no sense.
    """

    def number(start: int, length: int) -> int:
        return int.from_bytes(data[start : start + length], "little", signed=length == 4)

    start, header = number(10, 4), number(14, 4)
    if len(data) < 26:
        raise truncated()
    if header == 12:
        width, height, depth = number(18, 2), number(20, 2), number(24, 2)
        compression = length = 0
    else:
        width, height, depth = number(18, 4), abs(number(22, 4)), number(28, 2)
        compression, length = number(30, 4), number(34, 4)
    if (
        header not in _BMP_HEADERS
        or depth not in (1, 4, 8, 16, 24, 32)
        or compression not in (0, 1, 2, 3)
        or length < 0
        or not 14 + header <= start
        or not (width > 0 and height)
    ):
        raise damaged("the header makes no sense")
    if compression in (0, 3):  # rows of plain pixels, each filled up to four bytes
        length = (width * depth + 31) // 32 * 4 * height
    channels = 4 if depth == 32 else 3
    return Header(width, height, width * height * channels, len(data) >= start + length)
