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
    done, data = cv2.imencode(path.suffix, pixels, list(flags))
    assert done
    path.write_bytes(data.tobytes())
    return path


def png_header(width: int, height: int) -> bytes:
    """Return the first chunk of a PNG file."""
    chunk = b"IHDR" + struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n\0\0\0\r" + chunk + struct.pack(">I", zlib.crc32(chunk))
