"""Files of heat maps: images and NumPy arrays, checked before they are decoded."""

from __future__ import annotations

from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.lib import format as npy_format
from numpy.typing import NDArray

from ..common.files import open_regular, read_bytes, reason
from ..errors import HeatmapError, show
from ..maps.image_files import decode_pixels
from .colour_pictures import has_colours, read_green_region

# Bytes in which a header of a NumPy file must fit: that of a 2-D array of numbers takes 128.
_LONGEST_HEADER = 4096

# Bytes per pixel that an image file may have: more than plain text takes for a gray level, and room
# for what cameras and editors add.
_MOST_BYTES_PER_PIXEL, _OVERHEAD = 16, 2**22


def read_heatmap_values(path: Path, shape: tuple[int, int]) -> NDArray[Any]:
    """Return the values in the file of a heat map, an array of numbers of the shape.

    Args:
        path: a ``.npy`` file, told by its suffix, or an image.
        shape: of the grid, (rows, columns).

    Raises:
        HeatmapError: the file cannot be read, or its content is none of these, damaged, or of
            another shape.
    """
    if path.suffix.lower() == ".npy":
        return _read_array(path, shape)
    height, width = shape
    data = read_bytes(path, HeatmapError, _MOST_BYTES_PER_PIXEL * height * width + _OVERHEAD)
    name = f"cannot read the heat map {path}"
    pixels, white = decode_pixels(data, name, HeatmapError, (width, height))
    if has_colours(pixels):
        return read_green_region(pixels, white, str(path))
    gray = pixels if pixels.ndim == 2 else pixels[..., 0]
    if white in (255, 65535):  # the full range of a type of its own
        return gray.astype(np.uint8) if white == 255 else gray
    return gray / np.float32(white)


def _read_array(path: Path, shape: tuple[int, int]) -> NDArray[Any]:
    """Read a NumPy file: the header first, which says how much there is to read."""
    with open_regular(path, HeatmapError) as file:
        try:
            head = BytesIO(file.read(_LONGEST_HEADER))
            found, is_fortran, dtype = _parse_header(head)
        except Exception as error:  # NumPy parses the header as Python
            raise HeatmapError(
                f"{path} is no NumPy array: {show(reason(error)[:200])}; write it with numpy.save"
            ) from error
        _check_shape(path, found, shape)
        if dtype.hasobject or dtype.kind not in "buif":
            raise HeatmapError(f"{path}: a heat map holds real numbers, not {show(str(dtype))}")
        size = shape[0] * shape[1] * dtype.itemsize
        file.seek(head.tell())
        data = file.read(size)
    if len(data) < size:
        raise HeatmapError(
            f"{path}: the array is truncated, {size} bytes are announced and {len(data)} are there"
        )
    return np.frombuffer(data, dtype).reshape(shape, order="F" if is_fortran else "C")


def _parse_header(head: BytesIO) -> tuple[tuple[int, ...], bool, np.dtype[Any]]:
    """Return shape, order and type of a NumPy file; the position is then that of the data."""
    version = npy_format.read_magic(head)
    read = npy_format.read_array_header_1_0
    if version != (1, 0):  # 2.0 has a longer field for the length, 3.0 another encoding of names
        read = npy_format.read_array_header_2_0
    header: tuple[tuple[int, ...], bool, np.dtype[Any]] = read(head)
    return header


def _check_shape(path: Path, found: tuple[int, ...], shape: tuple[int, int]) -> None:
    if found != shape:
        raise HeatmapError(
            f"{path}: the map has shape {shape} (rows, columns), this heat map {show(found)}"
        )
