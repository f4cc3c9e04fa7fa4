"""Image files of maps: PNG, JPEG, BMP and PGM files as gray levels, complete or not at all."""

from __future__ import annotations

import re
from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from ..errors import MapError
from .raw_map import check_map_size

#: Suffixes of the files that :func:`decode_image` reads, in lower case.
SUFFIXES = (".png", ".jpg", ".jpeg", ".bmp", ".pgm")


class DecodedImage(NamedTuple):
    """The gray levels of an image file.

    Attributes:
        gray: (H, W), 0 (black) to ``white``; colour is weighted as in ITU-R BT.601 (0.299 red,
            0.587 green, 0.114 blue).
        white: the brightest gray level, 255 or 65535 or the one that a PGM names.
        opaque: (H, W), false where the image is transparent to any degree; None where the file
            has no alpha channel.
    """

    gray: NDArray[np.uint16]
    white: int
    opaque: NDArray[np.bool_] | None


def decode_image(data: bytes, name: str) -> DecodedImage:
    """Decode an image file, recognised by its first bytes.

    Pixels are taken as stored: a rotation that the EXIF data ask for is not applied.

    Args:
        data: the content of the file.
        name: what to call it in messages.

    Raises:
        MapError: empty, truncated, damaged, none of the four formats, or longer on a side than
            :data:`cbagan_ompl.maps.raw_map.MAX_SIDE` (found out before it is decoded).
    """
    if not data:
        raise MapError(f"{name}: the file is empty")
    if data[:2] in (b"P2", b"P5"):
        return _decode_pgm(data, name)
    # OpenCV may give back the decoded part of a truncated file, the rest of it gray, so whether
    # the file is whole is checked before.
    if data.startswith(b"\x89PNG\r\n\x1a\n"):
        size, whole = _measure_png(data)
    elif data.startswith(b"\xff\xd8"):
        size, whole = _measure_jpeg(data)
    elif data.startswith(b"BM"):
        size, whole = _measure_bmp(data)
    else:
        raise MapError(f"{name}: the content is no PNG, JPEG, BMP or PGM image")
    check_map_size(*size, name)
    if not whole:
        raise MapError(f"{name}: the image is truncated, get a complete copy of the file")
    try:
        # None for damaged files, whatever the annotations of OpenCV say.
        pixels: Any = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)
    except cv2.error as error:
        raise MapError(f"{name}: the image cannot be decoded: {error.err}") from error
    if pixels is None or pixels.dtype not in (np.uint8, np.uint16):
        raise MapError(f"{name}: the image is damaged or of a kind that OpenCV cannot decode")
    white = 255 if pixels.dtype == np.uint8 else 65535
    if pixels.ndim == 2:
        return DecodedImage(pixels.astype(np.uint16), white, None)
    opaque = pixels[..., 3] == white if pixels.shape[2] == 4 else None
    colours = np.ascontiguousarray(pixels[..., :3])
    return DecodedImage(cv2.cvtColor(colours, cv2.COLOR_BGR2GRAY).astype(np.uint16), white, opaque)


# Each of the next three returns (width, height) as the header gives them, (0, 0) if it is cut off,
# and whether the file reaches its end.


def _measure_png(data: bytes) -> tuple[tuple[int, int], bool]:
    width, height = int.from_bytes(data[16:20], "big"), int.from_bytes(data[20:24], "big")
    return (width, height), b"IEND\xaeB`\x82" in data[-64:]


def _measure_jpeg(data: bytes) -> tuple[tuple[int, int], bool]:
    width = height = 0
    at = 2
    while at + 9 <= len(data) and data[at] == 0xFF:
        marker = data[at + 1]
        # SOF0 to SOF15 hold the size; C4, C8 and CC are other tables.
        if 0xC0 <= marker <= 0xCF and marker not in (0xC4, 0xC8, 0xCC):
            height = int.from_bytes(data[at + 5 : at + 7], "big")
            width = int.from_bytes(data[at + 7 : at + 9], "big")
        if marker == 0xDA:  # the image data, in which an end mark cannot occur by chance
            return (width, height), b"\xff\xd9" in data[at:]
        # A marker may be preceded by any number of fill bytes FF.
        at += 1 if marker == 0xFF else 2 + int.from_bytes(data[at + 2 : at + 4], "big")
    return (width, height), False


def _measure_bmp(data: bytes) -> tuple[tuple[int, int], bool]:
    def number(start: int, length: int) -> int:
        return int.from_bytes(data[start : start + length], "little", signed=length == 4)

    start, header = number(10, 4), number(14, 4)
    if header == 12:
        width, height, depth, compression, length = (
            number(18, 2),
            number(20, 2),
            number(24, 2),
            0,
            0,
        )
    else:
        width, height, depth = number(18, 4), abs(number(22, 4)), number(28, 2)
        compression, length = number(30, 4), number(34, 4)
    if compression in (0, 3):  # rows of plain pixels, each filled up to four bytes
        length = (width * depth + 31) // 32 * 4 * height
    return (width, height), len(data) >= max(start, 26) + length


def _decode_pgm(data: bytes, name: str) -> DecodedImage:
    """Decode a PGM, plain (P2) or raw (P5), with comments and any brightest level to 65535.

    Not by OpenCV, which scales some of the brightest levels other than 255 and some not.
    """
    gap = rb"(?:\s|#[^\n]*\n)+"
    header = re.match(
        rb"P([25])" + gap + rb"(\d{1,99})" + gap + rb"(\d{1,99})" + gap + rb"(\d{1,99})\s", data
    )
    if header is None:
        raise MapError(
            f"{name}: the PGM header is incomplete, expected P5 or P2, width, height and the "
            "brightest gray level"
        )
    kind, width, height, white = (int(number) for number in header.groups())
    check_map_size(width, height, name)
    if not (width and height and 0 < white < 65536):
        raise MapError(
            f"{name}: {width} x {height} pixels with gray levels up to {white} are no PGM; the "
            "sizes must be positive and the brightest level 1 to 65535"
        )
    body = data[header.end() :]
    if kind == 5:
        # Two bytes a pixel, high byte first, from level 256; a last odd byte is not looked at.
        stored = np.dtype(np.uint8 if white < 256 else ">u2")
        levels = np.frombuffer(body, stored, count=len(body) // stored.itemsize)
    else:
        try:
            levels = np.array(re.sub(rb"#[^\n]*", b"", body).split(), dtype=np.int64)
        except (ValueError, OverflowError) as error:
            raise MapError(f"{name}: the PGM holds something that is no number: {error}") from error
    if levels.size < width * height:
        raise MapError(
            f"{name}: the image is truncated, {width} x {height} pixels are announced and "
            f"{levels.size} are there"
        )
    levels = levels[: width * height]
    if levels.min() < 0 or levels.max() > white:
        raise MapError(f"{name}: the PGM holds gray levels outside 0 to {white}")
    return DecodedImage(levels.astype(np.uint16).reshape(height, width), white, None)
