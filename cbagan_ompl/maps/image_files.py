"""Image files of maps, heat maps and data sets: complete and of a bearable size, or not at all.

PNG, JPEG, BMP, PGM and PPM files are read. No length that a file announces is believed before it
has been compared with the file, and no memory is spent before the size is known to be allowed.
"""

from __future__ import annotations

from typing import Any, NamedTuple
from zlib import crc32

import cv2
import numpy as np
from numpy.typing import NDArray

from ..errors import CbaganOmplError, MapError
from .image_headers import (
    BrokenImageError,
    Header,
    damaged,
    essential_png,
    measure_bmp,
    measure_jpeg,
    measure_png,
    padded_jpeg,
    truncated,
)
from .netpbm import MAGIC, decode_netpbm
from .raw_map import MAX_PIXELS, MAX_SIDE, check_map_size

#: Suffixes of the files that :func:`decode_image` reads, in lower case.
SUFFIXES = (".png", ".jpg", ".jpeg", ".bmp", ".pgm", ".ppm")

#: Largest image file: three bytes for each pixel of the largest map, and a header.
MAX_IMAGE_BYTES = 3 * MAX_PIXELS + 2**16

# Most memory that decoding may take, in bytes: three for each pixel of the largest map.
_MAX_DECODED = 3 * MAX_PIXELS

_PNG, _JPEG = b"\x89PNG\r\n\x1a\n", b"\xff\xd8"

# Pixels that are looked up in a table at a time.
_BLOCK = 2**20


class Pixels(NamedTuple):
    """The pixels of an image file, as they are stored.

    Attributes:
        values: (H, W) for gray images, else (H, W, 3) or (H, W, 4): blue, green, red and alpha, as
            OpenCV has them.
        white: the brightest level, 255 or 65535 or the one that a PGM or PPM names.
    """

    values: NDArray[np.uint8 | np.uint16]
    white: int


class DecodedImage(NamedTuple):
    """The gray levels of an image file.

    Attributes:
        gray: (H, W), 0 (black) to ``white``; colour is weighted as in ITU-R BT.601 (0.299 red,
            0.587 green, 0.114 blue).
        white: the brightest gray level, 255 or 65535 or the one that a PGM or PPM names.
        opaque: (H, W), false where the image is transparent to any degree; None where the file
            has no alpha channel.
    """

    gray: NDArray[np.uint8 | np.uint16]
    white: int
    opaque: NDArray[np.bool_] | None

    def look_up(self, of_level: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Return ``of_level[gray]``, (H, W), without the indices of all pixels in memory."""
        result = np.empty(self.gray.shape, np.bool_)
        rows = max(1, _BLOCK // self.gray.shape[1])
        for first in range(0, len(self.gray), rows):
            result[first : first + rows] = of_level[self.gray[first : first + rows]]
        return result


def decode_image(
    data: bytes,
    name: str,
    error_class: type[CbaganOmplError] = MapError,
    size: tuple[int, int] | None = None,
) -> DecodedImage:
    """Decode an image file to gray levels; arguments and errors as for :func:`decode_pixels`."""
    pixels, white = decode_pixels(data, name, error_class, size)
    if pixels.ndim == 2:
        return DecodedImage(pixels, white, None)
    has_alpha = pixels.shape[2] == 4
    gray: Any = cv2.cvtColor(pixels, cv2.COLOR_BGRA2GRAY if has_alpha else cv2.COLOR_BGR2GRAY)
    return DecodedImage(gray, white, pixels[..., 3] == white if has_alpha else None)


def decode_pixels(
    data: bytes,
    name: str,
    error_class: type[CbaganOmplError] = MapError,
    size: tuple[int, int] | None = None,
    longest: int = MAX_SIDE,
) -> Pixels:
    """Decode an image file, recognised by its first bytes: the one way in for every image.

    Pixels are taken as stored: a rotation that the EXIF data ask for is not applied, nor are the
    profiles of a PNG. What follows the end of an image is not looked at.

    Args:
        data: the content of the file.
        name: what to call it in messages.
        error_class: what to raise.
        size: (width, height) that the image must have; None for any.
        longest: side in pixels that is allowed.

    Raises:
        CbaganOmplError: of that class; the file is empty, truncated, damaged, in none of the
            formats, of another size, or larger than
            :func:`cbagan_ompl.maps.raw_map.check_map_size` allows. All of that but some of the
            damages is found out before memory is spent on the pixels.
    """

    def check_size(width: int, height: int, needed: int) -> None:
        check_map_size(width, height, name, error_class, longest)
        if size is not None and (width, height) != size:
            raise error_class(
                f"{name}: {width} x {height} pixels, but {size[0]} x {size[1]} are expected"
            )
        if needed > _MAX_DECODED:
            raise error_class(
                f"{name}: decoding {width} x {height} pixels of this kind takes "
                f"{needed / 2**20:.0f} MiB, and {_MAX_DECODED / 2**20:.0f} are allowed; scale it "
                "down, or save it as a gray PNG with 8 bits"
            )

    try:
        if data[:2] in MAGIC:
            return Pixels(*decode_netpbm(data, check_size))
        header = _measure(data)
        check_size(header.width, header.height, header.needed)
        if not header.is_whole:
            raise truncated()
        if data.startswith(_PNG):
            data = essential_png(data)
        values = _decode_whole_jpeg(data) if data.startswith(_JPEG) else _decode(data)
        if values.shape[:2] != (header.height, header.width):
            raise damaged("its size is not the one that it announces")
    except BrokenImageError as error:
        raise error_class(f"{name}: {error}") from error
    return Pixels(values, 255 if values.dtype == np.uint8 else 65535)


def _measure(data: bytes) -> Header:
    if data.startswith(_PNG):
        return measure_png(data)
    if data.startswith(_JPEG):
        return measure_jpeg(data)
    if data.startswith(b"BM"):
        return measure_bmp(data)
    raise BrokenImageError(
        "the content is no PNG, JPEG, BMP, PGM or PPM image" if data else "the file is empty"
    )


def _decode_whole_jpeg(data: bytes) -> NDArray[np.uint8 | np.uint16]:
    """Decode a JPEG file; raise where the data of its pixels end before its pixels do."""
    checksum = crc32(_decode(data).data)  # of pixels that are not kept: they may be many
    values = _decode(padded_jpeg(data))
    if crc32(values.data) != checksum:
        raise truncated(" or damaged, its data end before its pixels do")
    return values


def _decode(data: bytes) -> NDArray[np.uint8 | np.uint16]:
    try:
        # None for damaged files, whatever the annotations of OpenCV say.
        values: Any = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)
    except Exception as error:  # cv2.error, and those of its Python bindings
        raise damaged(str(getattr(error, "err", error))) from error
    if values is None or values.dtype not in (np.uint8, np.uint16):
        raise damaged("OpenCV reads no pixels")
    if values.ndim == 3 and values.shape[2] not in (3, 4):
        raise damaged(f"it has {values.shape[2]} channels")
    return np.asarray(values)
