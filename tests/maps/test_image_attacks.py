"""Image files that lie about their size, or cost far more than they weigh."""

from __future__ import annotations

import io
import struct
import zlib
from pathlib import Path

import cv2
import numpy as np
import pytest
from helpers.attacks import assert_refused, run_commands
from helpers.fuzzing import mutations, read_all
from helpers.images import (
    SHAPE,
    interlaced_rows,
    jpeg_frame,
    png_chunk,
    png_file,
    png_header,
)

from cbagan_ompl import DatasetError, GridMap, HeatmapError
from cbagan_ompl.errors import MapError
from cbagan_ompl.maps.image_files import decode_image, decode_pixels


def _encode(suffix: str, pixels: np.ndarray, *flags: int) -> bytes:
    return cv2.imencode(suffix, pixels, list(flags))[1].tobytes()


def _jpeg_with(segments: bytes) -> bytes:
    """Return a JPEG file with more segments behind its begin."""
    data = _encode(".jpg", SHAPE)
    return data[:2] + segments + data[2:]


def _inflating_chunk(kind: bytes, before: bytes, megabytes: int) -> bytes:
    packer = zlib.compressobj(9)
    packed = b"".join(packer.compress(bytes(2**20)) for _ in range(megabytes)) + packer.flush()
    return png_chunk(kind, before + packed)


_WHITE_ROWS = b"\0\xff\xff\xff" * 3

#: Files that must be refused at once, and what the message says.
ATTACKS = {
    "idat-of-4-gb": (
        png_header(8, 8) + b"\xff\xff\xff\xf0IDAT" + bytes(18), "truncated.*reaches beyond its end"
    ),
    "chunk-before-pixels-of-4-gb": (
        png_header(8, 8) + b"\xff\xff\xff\xf0zTXt" + bytes(18), "truncated.*reaches beyond its end"
    ),
    "no-pixels": (
        png_header(4096, 4096) + png_chunk(b"IDAT", zlib.compress(b"")) + png_chunk(b"IEND"),
        "bytes of pixels are missing",
    ),
    "no-pixels-of-16-bits-and-alpha": (
        png_file((4096, 4096), b"\0", depth=16, colour=6), "bytes of pixels are missing"
    ),
    "one-bit-32000": (png_file((32000, 32000), b"\0" * 10**6, depth=1), "scale it down"),
    "16-bits-and-alpha-8192": (png_file((8192, 8192), b"\0", depth=16, colour=6), "takes 512 MiB"),
    "16-bits-and-colour-8192": (png_file((8192, 8192), b"", depth=16, colour=2), "takes 384 MiB"),
    "16-bits-transparent-8192": (
        png_file((8192, 8192), b"", png_chunk(b"tEXt", bytes(9000)), png_chunk(b"tRNS", b"\0\0"),
                 depth=16),
        "takes 512 MiB",
    ),
    "pixels-that-never-end": (
        png_file((3, 3), _WHITE_ROWS + bytes(2**27)), "more data than pixels"
    ),
    "many-chunks": (
        png_header(8, 8) + png_chunk(b"tIME") * 300_000, "more than 100000 chunks"
    ),
    "unknown-critical-chunk": (png_file((3, 3), _WHITE_ROWS, png_chunk(b"CgBI")), "chunk CgBI"),
    "two-headers": (png_file((3, 3), _WHITE_ROWS, png_header(9000, 9000)[8:]), "has two"),
    "no-depth": (png_file((3, 3), _WHITE_ROWS, depth=3), "makes no sense"),
    "no-width": (png_file((0, 3), b""), "makes no sense"),
    "wrong-checksum": (
        png_file((3, 3), _WHITE_ROWS).replace(struct.pack(">I", zlib.crc32(b"IEND")), b"abcd"),
        "checksum",
    ),
    "jpeg-parameterless-markers": (
        # A reader that takes a length from behind FF 01 finds the small frame, OpenCV the large.
        b"\xff\xd8\xff\x01" + jpeg_frame(0xC0, 40_000, 40_000, 3) + jpeg_frame(0xC0, 8, 8)
        + b"\xff\xd9",
        "two frames",
    ),
    "jpeg-hidden-frame": (
        b"\xff\xd8\xff\x01\xff\xd0" + jpeg_frame(0xC0, 40_000, 40_000, 3) + b"\xff\xd9",
        "scale it down",
    ),
    "jpeg-two-frames": (_jpeg_with(jpeg_frame(0xC0, 8, 8)), "two frames"),
    "jpeg-short": (
        b"\xff\xd8" + jpeg_frame(0xC0, 8192, 8192, 1) + b"\xff\xda\0\x08\1\1\0\0\x3f\0\xff\xd9",
        "truncated",
    ),
    "jpeg-progressive": (
        b"\xff\xd8" + jpeg_frame(0xC2, 8192, 8192, 3) + bytes(10) + b"\xff\xd9", "takes 576 MiB"
    ),
    "jpeg-scans": (
        b"\xff\xd8" + jpeg_frame(0xC2, 8, 8) + b"\xff\xda\0\x08\1\1\0\0\x3f\0" * 200 + b"\xff\xd9",
        "more than 100 scans",
    ),
    "jpeg-fill": (b"\xff\xd8" + b"\xff" * 10**7, "truncated"),
    "jpeg-fill-in-scan": (
        b"\xff\xd8" + jpeg_frame(0xC0, 8, 8) + b"\xff\xda\0\x08\1\1\0\0\x3f\0" + b"\xff" * 10**7
        + b"\0",
        "truncated",
    ),
    "jpeg-markers": (b"\xff\xd8" + b"\xff\x01" * 10**7, "truncated"),
    "jpeg-lossless": (b"\xff\xd8" + jpeg_frame(0xC3, 8, 8) + b"\xff\xd9", "neither baseline"),
    "bmp-negative": (
        struct.pack("<2sIHHIIiiHHII", b"BM", 0, 0, 0, 54, 40, -8, 8, 1, 24, 0, 0), "no sense"
    ),
    "bmp-height": (
        struct.pack("<2sIHHIIiiHHII", b"BM", 0, 0, 0, 54, 40, 8, -(2**31), 1, 24, 0, 0),
        "scale it down",
    ),
    "bmp-start": (
        struct.pack("<2sIHHIIiiHHII", b"BM", 0, 0, 0, 2**31 - 1, 40, 8, 8, 1, 24, 0, 0)
        + bytes(192),
        "truncated",
    ),
    "pgm-spaces": (b"P5" + b" " * 10**7, "header is incomplete"),
    "pgm-comments": (b"P5" + b"#\n" * 10**7, "header is incomplete"),
    "pgm-numbers": (b"P2 1 1 255\nx" + b"1 " * 10**7, "no number"),
    "pgm-long-number": (b"P2 1 1 255\n" + b"1" * 10**7, "too many digits"),
    "pgm-digits": (b"P2 " + b"9" * 10**7, "header is incomplete"),
    "ppm-large": (b"P6 8192 8192 65535\n", "takes 384 MiB"),
}  # fmt: skip


@pytest.mark.parametrize("name", ATTACKS)
def test_attacks_are_refused_with_a_reason(name: str) -> None:
    data, message = ATTACKS[name]
    with pytest.raises(MapError, match=f"some file: .*{message}"):
        decode_image(data, "some file")
    for error_class in (DatasetError, HeatmapError):
        with pytest.raises(error_class):
            decode_pixels(data, "some file", error_class)


def test_attacks_cost_little(tmp_path: Path) -> None:
    commands = []
    for name, (data, _) in ATTACKS.items():
        (tmp_path / f"{name}.png").write_bytes(data)
        commands.append(["plan", str(tmp_path / f"{name}.png"), "--start", "1,1", "--goal", "2,2"])
    (tmp_path / "sparse.png").touch()
    with (tmp_path / "sparse.png").open("r+b") as file:
        file.truncate(2**40)
    commands.append(["plan", str(tmp_path / "sparse.png"), "--start", "1,1", "--goal", "2,2"])
    for outcome in run_commands(commands):
        assert_refused(outcome)


@pytest.mark.parametrize(
    ("kind", "before"),
    [(b"iCCP", b"p\0\0"), (b"zTXt", b"t\0\0"), (b"iTXt", b"t\0\1\0\0\0"), (b"acTL", b"")],
)
def test_what_inflates_beside_the_pixels_is_not_looked_at(
    tmp_path: Path, kind: bytes, before: bytes
) -> None:
    path = tmp_path / "profile.png"
    path.write_bytes(png_file((3, 3), _WHITE_ROWS, _inflating_chunk(kind, before, 500)))
    assert GridMap.load(path).free.all()
    words = ["plan", str(path), "--start", "1,1", "--goal", "2,2", "--sampler", "uniform"]
    [outcome] = run_commands([[*words, "--time", "0.1"]])
    assert outcome.status == 0, outcome
    assert outcome.megabytes < 200, outcome


@pytest.mark.parametrize("surplus", [1, 57, 64, 10_000])
def test_bytes_after_the_end_of_an_image_do_not_count(surplus: int) -> None:
    more = np.random.default_rng(surplus).bytes(surplus)
    for data in (png_file((3, 3), _WHITE_ROWS), _encode(".jpg", SHAPE), _encode(".bmp", SHAPE)):
        before, after = decode_image(data, "map"), decode_image(data + more, "map")
        np.testing.assert_array_equal(before.gray, after.gray)


@pytest.mark.parametrize("size", [(1, 1), (2, 9), (7, 5), (8, 8), (33, 17)])
def test_interlaced_png(size: tuple[int, int]) -> None:
    width, height = size
    pixels = np.random.default_rng(0).integers(0, 256, (height, width)).astype(np.uint8)
    data = png_file(size, interlaced_rows(pixels), interlaced=True)
    np.testing.assert_array_equal(decode_image(data, "map").gray, pixels)
    with pytest.raises(MapError, match="1 bytes of pixels are missing"):
        decode_image(png_file(size, interlaced_rows(pixels)[:-1], interlaced=True), "map")


_JPEG_KINDS = {
    "baseline": [],
    "optimized": [cv2.IMWRITE_JPEG_OPTIMIZE, 1],
    "restarts": [cv2.IMWRITE_JPEG_RST_INTERVAL, 3],
    "progressive": [cv2.IMWRITE_JPEG_PROGRESSIVE, 1],
}


@pytest.mark.parametrize("channels", [1, 3])
@pytest.mark.parametrize("kind", _JPEG_KINDS)
def test_jpeg_whose_data_end_too_early(
    kind: str, channels: int, capfd: pytest.CaptureFixture[str]
) -> None:
    rng = np.random.default_rng(channels)
    pixels = rng.integers(0, 2, (40, 56, channels)).repeat(3, axis=0).repeat(2, axis=1) * 255
    data = _encode(".jpg", pixels.astype(np.uint8), *_JPEG_KINDS[kind])
    whole = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED)
    for end in (b"\xff\xd9", b"\xff\xff\xff\xd9", b"\xff\xd9 more"):
        read = decode_pixels(data[:-2] + end, "map").values
        np.testing.assert_array_equal(read, whole)
    assert capfd.readouterr().err == ""
    scan = data.rindex(b"\xff\xda") + 20
    for cut in rng.integers(scan, len(data) - 20, 20):
        # A decoder fills in what is missing between here and the mark of the end.
        with pytest.raises(MapError, match="truncated or damaged"):
            decode_pixels(data[:cut].rstrip(b"\xff") + b"\xff\xd9", "map")


def test_pixels_in_many_chunks_and_small_surplus() -> None:
    packed = zlib.compress(_WHITE_ROWS + b"12345")
    chunks = b"".join(png_chunk(b"IDAT", packed[i : i + 1]) for i in range(len(packed)))
    data = png_header(3, 3) + chunks + png_chunk(b"IEND")
    assert (decode_image(data, "map").gray == 255).all()


def test_another_size_than_expected_is_refused_before_decoding() -> None:
    data = png_file((4096, 4096), b"")
    with pytest.raises(HeatmapError, match="4096 x 4096 pixels, but 3 x 3 are expected"):
        decode_pixels(data, "map", HeatmapError, size=(3, 3))
    assert decode_pixels(png_file((3, 3), _WHITE_ROWS), "map", size=(3, 3)).values.shape == (3, 3)


def _valid_images() -> list[bytes]:
    rng = np.random.default_rng(0)
    gray = rng.integers(0, 256, (14, 11)).astype(np.uint8)
    colour = rng.integers(0, 256, (14, 11, 3)).astype(np.uint8)
    alpha = rng.integers(0, 256, (14, 11, 4)).astype(np.uint8)
    text = io.BytesIO()
    np.savetxt(text, gray, "%d")
    return [
        _encode(".png", gray),
        _encode(".png", alpha),
        _encode(".png", gray.astype(np.uint16) * 257),
        _encode(".png", gray, cv2.IMWRITE_PNG_BILEVEL, 1),
        png_file((11, 14), interlaced_rows(gray), png_chunk(b"tEXt", b"a\0b"), interlaced=True),
        png_file(
            (11, 14),
            b"".join(b"\0" + row.tobytes() for row in gray % 4),
            png_chunk(b"PLTE", bytes(12)),
            png_chunk(b"tRNS", b"\0\x80"),
            colour=3,
        ),
        _encode(".jpg", gray),
        _encode(".jpg", colour, cv2.IMWRITE_JPEG_RST_INTERVAL, 1),
        _encode(".jpg", colour, cv2.IMWRITE_JPEG_PROGRESSIVE, 1),
        _encode(".bmp", gray),
        _encode(".bmp", colour),
        _encode(".pgm", gray),
        _encode(".ppm", colour),
        b"P2 # plain\n11 14\n255\n" + text.getvalue(),
        b"P3\n3 1 15\n1 2 3 4 5 6 7 8 9\n",
    ]


@pytest.mark.parametrize(
    ("count", "seed"), [(1000, 0), pytest.param(6000, 1, marks=pytest.mark.slow)]
)
def test_damaged_images_are_read_or_refused(tmp_path: Path, count: int, seed: int) -> None:
    path = tmp_path / "fuzzed.png"

    def load(data: bytes) -> None:
        path.write_bytes(data)
        assert GridMap.load(path, threshold=0, unknown_is_free=True).free.all()

    counts = read_all(load, mutations(_valid_images(), count, seed))
    assert min(counts["read"], counts["refused"]) > count / 50
