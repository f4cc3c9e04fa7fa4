"""Image files that tests write, and what is drawn on them."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path

import cv2
import numpy as np

GRAYS = np.array([[0, 100, 127, 128], [200, 205, 254, 255]], dtype=np.uint8)
SHAPE = np.kron([[1, 0, 1], [1, 1, 0]], np.ones((16, 16))).astype(np.uint8) * 255


def write_image(path: Path, pixels: np.ndarray, *flags: int) -> Path:
    """Write pixels in the format that the suffix of the path names."""
    if path.suffix == ".ppm" and pixels.ndim == 2:
        pixels = pixels[..., None].repeat(3, axis=2)
    done, data = cv2.imencode(path.suffix, pixels, list(flags))
    assert done
    path.write_bytes(data.tobytes())
    return path


def png_header(width: int, height: int) -> bytes:
    """Return the first chunk of a PNG file."""
    chunk = b"IHDR" + struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n\0\0\0\r" + chunk + struct.pack(">I", zlib.crc32(chunk))


def png_chunk(kind: bytes, content: bytes = b"") -> bytes:
    """Return a chunk of a PNG file."""
    checksum = zlib.crc32(kind + content)
    return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", checksum)


def png_file(
    size: tuple[int, int],
    rows: bytes,
    *chunks: bytes,
    depth: int = 8,
    colour: int = 0,
    interlaced: bool = False,
) -> bytes:
    """Return a PNG file of (width, height).

    Args:
        size: as the header announces it.
        rows: each with the byte of its filter.
        chunks: between header and pixels.
        depth: bits of a value.
        colour: type of the pixels, 0 for gray.
        interlaced: as the header announces it.
    """
    header = struct.pack(">IIBBBBB", *size, depth, colour, 0, 0, interlaced)
    return b"".join(
        (
            b"\x89PNG\r\n\x1a\n",
            png_chunk(b"IHDR", header),
            *chunks,
            png_chunk(b"IDAT", zlib.compress(rows, 9)),
            png_chunk(b"IEND"),
        )
    )


def interlaced_rows(pixels: np.ndarray) -> bytes:
    """Return the rows of the seven passes of an interlaced gray PNG."""
    passes = ((0, 0, 8, 8), (4, 0, 8, 8), (0, 4, 4, 8), (2, 0, 4, 4), (0, 2, 2, 4), (1, 0, 2, 2))
    rows = b""
    for left, top, across, down in (*passes, (0, 1, 1, 2)):
        part = pixels[top::down, left::across]
        if part.size:
            rows += b"".join(b"\0" + row.tobytes() for row in part)
    return rows


def jpeg_frame(marker: int, width: int, height: int, components: int = 1) -> bytes:
    """Return the segment of a JPEG file that announces its size."""
    parts = b"".join(bytes((k + 1, 0x11, 0)) for k in range(components))
    sizes = struct.pack(">BHHB", 8, height, width, components)
    return bytes((0xFF, marker)) + struct.pack(">H", 8 + 3 * components) + sizes + parts
