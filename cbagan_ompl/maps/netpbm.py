"""PGM and PPM files, plain and raw: gray levels or colours with any brightest level to 65535.

Not decoded by OpenCV, which scales some of the brightest levels other than 255 and some not.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from .image_headers import BrokenImageError, truncated

#: What the files begin with.
MAGIC = (b"P2", b"P3", b"P5", b"P6")

_GAP = rb"(?:\s|#[^\n]*\n)+"
_NUMBER = rb"(\d{1,99})"
_HEADER = re.compile(rb"P([2356])" + _GAP + _NUMBER + _GAP + _NUMBER + _GAP + _NUMBER + rb"\s")
# The header ends within so many bytes, comments included.
_MAX_HEADER = 2**16

# Bytes of a plain file that are split into numbers at a time, and the digits of a number.
_BLOCK, _MAX_DIGITS = 2**20, 32


def decode_netpbm(
    data: bytes, check_size: Callable[[int, int, int], None]
) -> tuple[NDArray[np.uint8 | np.uint16], int]:
    """Decode a PGM (P2, P5) or PPM (P3, P6) file.

    Args:
        data: the content of the file.
        check_size: raises for a width, a height and bytes of memory that are too many.

    Returns:
        The levels, (H, W) or (H, W, 3) blue, green and red as OpenCV has them, and the brightest
        level.

    Raises:
        BrokenImageError: truncated, or damaged.
    """
    header = _HEADER.match(data[:_MAX_HEADER])
    if header is None:
        kind = "PPM" if data[1:2] in (b"3", b"6") else "PGM"
        raise BrokenImageError(
            f"the {kind} header is incomplete, expected {data[:2].decode()}, width, height and "
            "the brightest level"
        )
    number, width, height, white = (int(digits) for digits in header.groups())
    channels, name = (1, "PGM") if number in (2, 5) else (3, "PPM")
    stored: Any = np.dtype(np.uint8 if white < 256 else ">u2")
    check_size(width, height, width * height * channels * stored.itemsize)
    if not (width and height and 0 < white < 65536):
        raise BrokenImageError(
            f"{width} x {height} pixels with levels up to {white} are no {name}; the sizes must be "
            "positive and the brightest level 1 to 65535"
        )
    count = width * height * channels
    levels: NDArray[Any]
    if number in (5, 6):
        # Two bytes a value, high byte first, from level 256; a last odd byte is not looked at.
        body = memoryview(data)[header.end() :]
        found = min(count, len(body) // stored.itemsize)
        levels = np.frombuffer(body, stored, count=found).astype(
            stored.newbyteorder("="), copy=False
        )
    else:
        levels = _read_numbers(data[header.end() :], count, white, name)
    if levels.size < count:
        raise truncated(
            f", {width} x {height} pixels are announced and {levels.size // channels} are there"
        )
    if levels.max() > white:
        raise BrokenImageError(f"the {name} holds levels outside 0 to {white}")
    if channels == 1:
        return levels.reshape(height, width), white
    colours: Any = cv2.cvtColor(levels.reshape(height, width, 3), cv2.COLOR_RGB2BGR)
    return colours, white


def _read_numbers(text: bytes, count: int, white: int, name: str) -> NDArray[np.uint8 | np.uint16]:
    """Return the first numbers of a text, not more than ``count``."""
    if b"#" in text:
        text = re.sub(rb"#[^\n]*", b"", text)
    levels: NDArray[Any] = np.empty(count, np.uint8 if white < 256 else np.uint16)
    space = re.compile(rb"\s")
    filled = at = 0
    while filled < count and at < len(text):
        after = space.search(text, at + _BLOCK)
        end = len(text) if after is None else after.start()
        words = text[at : min(end, at + _BLOCK + _MAX_DIGITS + 1)].split()[: count - filled]
        at = end
        try:
            if max(map(len, words), default=0) > _MAX_DIGITS:
                raise ValueError("a number has too many digits")
            numbers = np.array(words, dtype=np.int64)
        except Exception as error:  # NumPy raises several kinds
            raise BrokenImageError(
                f"the {name} holds something that is no number: {error}"
            ) from error
        if numbers.size and not (numbers.min() >= 0 and numbers.max() <= white):
            raise BrokenImageError(f"the {name} holds levels outside 0 to {white}")
        levels[filled : filled + len(numbers)] = numbers
        filled += len(numbers)
    return levels[:filled]
