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

from ..errors import show
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
_IS_SPACE = np.isin(np.arange(256), list(b" \t\n\v\f\r"))


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
        begin, needed = header.end(), count * stored.itemsize
        # One blank ends the header, but in a file with lines of Windows two bytes do.
        if data[begin - 1 : begin + 1] == b"\r\n" and len(data) == begin + 1 + needed:
            begin += 1
        body = memoryview(data)[begin:]
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
    levels: NDArray[Any] = np.empty(count, np.uint8 if white < 256 else np.uint16)
    space = re.compile(rb"\s")
    filled, at, in_comment = 0, 0, False
    while filled < count and at < len(text):
        after = space.search(text, at + _BLOCK, at + _BLOCK + _MAX_DIGITS + 1)
        end = at + _BLOCK + _MAX_DIGITS + 1 if after is None else after.start()
        codes, in_comment = _blank_comments(np.frombuffer(text[at:end], np.uint8), in_comment)
        numbers = _parse_numbers(codes, count - filled, name)
        at = end
        if numbers.size and numbers.max() > white:
            raise BrokenImageError(f"the {name} holds levels outside 0 to {white}")
        levels[filled : filled + len(numbers)] = numbers
        filled += len(numbers)
    return levels[:filled]


def _blank_comments(codes: NDArray[np.uint8], in_comment: bool) -> tuple[NDArray[np.uint8], bool]:
    """Return a text with spaces in place of comments, and whether it ends in one.

    Args:
        codes: the text.
        in_comment: whether it begins in one.
    """
    is_hash = codes == ord("#")
    if not (in_comment or is_hash.any()):
        return codes, False
    places = np.arange(1, len(codes) + 1)
    last_hash = np.maximum.accumulate(np.where(is_hash, places, 0))
    last_line_end = np.maximum.accumulate(np.where(codes == ord("\n"), places, -int(in_comment)))
    is_comment = last_hash > last_line_end
    return np.where(is_comment, np.uint8(ord(" ")), codes), bool(is_comment[-1])


def _parse_numbers(codes: NDArray[np.uint8], count: int, name: str) -> NDArray[np.int64]:
    """Return the first numbers of a text, not more than ``count``.

    What is beyond 10^16 comes out too small, but beyond 10^16 as well. All numbers are
    computed at once: their last digits, then the tens of those that have some, and so on, in a
    fifth of the time that splitting the text into words takes.
    """
    digits = codes - np.uint8(ord("0"))
    is_digit = digits < 10
    steps = np.diff(is_digit.view(np.int8), prepend=0, append=0)
    ends = np.flatnonzero(steps == -1)[:count]
    lengths = ends - np.flatnonzero(steps == 1)[:count]
    # What follows the last number that is wanted is not looked at.
    used = slice(int(ends[-1]) + 1 if len(ends) == count else None)
    is_odd = ~(is_digit[used] | _IS_SPACE[codes[used]])
    if is_odd.any():
        odd = codes[int(is_odd.argmax()) :][:20].tobytes()
        raise BrokenImageError(f"the {name} holds something that is no number: {show(odd)}")
    longest = int(lengths.max(initial=0))
    if longest > _MAX_DIGITS:
        raise BrokenImageError(f"the {name} holds a number with too many digits, {longest}")
    numbers: NDArray[np.int64] = digits[ends - 1].astype(np.int64)
    for place in range(1, longest):
        longer = np.flatnonzero(lengths > place)
        numbers[longer] += digits[ends[longer] - 1 - place] * np.int64(10 ** min(place, 16))
    return numbers
