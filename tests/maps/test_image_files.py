"""Image files of maps: every format as it should be read, broken files with a reason."""

from __future__ import annotations

import struct

import cv2
import numpy as np
import pytest
from helpers.images import GRAYS, SHAPE, png_header, write_image

from cbagan_ompl.errors import MapError
from cbagan_ompl.maps.grid_map import GridMap
from cbagan_ompl.maps.image_files import decode_image
from cbagan_ompl.maps.raw_map import MAX_SIDE


@pytest.mark.parametrize(
    "suffix", [".png", ".bmp", ".pgm", ".ppm", ".jpg", ".jpeg", ".PNG", ".Jpg"]
)
def test_images(tmp_path, suffix):
    grid = GridMap.load(write_image(tmp_path / f"some map.v2{suffix}", SHAPE))
    np.testing.assert_array_equal(grid.free, SHAPE > 0)
    assert (grid.name, grid.resolution, grid.origin) == ("some map.v2", 1.0, None)


def test_path_may_be_a_string_with_any_characters(tmp_path):
    path = tmp_path / "Lageplan Größe 図.png"
    write_image(path, SHAPE)
    assert GridMap.load(str(path)).name == "Lageplan Größe 図"


def test_half_is_the_threshold_between_127_and_128(tmp_path):
    path = write_image(tmp_path / "grays.png", GRAYS)
    assert GridMap.load(path).free.tolist() == (GRAYS >= 128).tolist()


@pytest.mark.parametrize(
    ("threshold", "first"), [(0, 0), (100 / 255, 100), (100.01 / 255, 127), (0.8, 205), (1, 255)]
)
def test_threshold_is_met_by_equal_levels(tmp_path, threshold, first):
    path = write_image(tmp_path / "grays.png", GRAYS)
    grid = GridMap.load(path, threshold=threshold)
    assert sorted(GRAYS[grid.free]) == [level for level in GRAYS.ravel() if level >= first]


def test_16_bits_are_measured_against_65535(tmp_path):
    levels = np.array([[0, 255, 32767, 32768, 65535]], dtype=np.uint16)
    for name in ("deep.png", "deep.pgm"):
        free = GridMap.load(write_image(tmp_path / name, levels)).free
        assert free.tolist() == [[False, False, False, True, True]]


def test_colour_becomes_gray_by_its_brightness(tmp_path):
    blue_green_red = np.array([[(255, 0, 0), (0, 255, 0), (0, 0, 255), (0, 255, 255)]], np.uint8)
    for name in ("colour.png", "colour.bmp"):
        path = write_image(tmp_path / name, blue_green_red)
        assert GridMap.load(path).free.tolist() == [[False, True, False, True]]
        assert GridMap.load(path, threshold=0.29).free.tolist() == [[False, True, True, True]]


def test_transparent_pixels_are_unknown(tmp_path):
    bgra = np.zeros((1, 4, 4), np.uint8)
    bgra[0, :, :3] = np.array([255, 255, 255, 0])[:, None]
    bgra[0, :, 3] = 255, 254, 0, 255
    path = write_image(tmp_path / "alpha.png", bgra)
    assert GridMap.load(path).free.tolist() == [[True, False, False, False]]
    assert GridMap.load(path, unknown_is_free=True).free.tolist() == [[True, True, True, False]]


def test_bilevel_png(tmp_path):
    path = write_image(tmp_path / "bits.png", SHAPE, cv2.IMWRITE_PNG_BILEVEL, 1)
    np.testing.assert_array_equal(GridMap.load(path).free, SHAPE > 0)


@pytest.mark.parametrize(
    ("data", "free"),
    [
        (b"P2\n# drawn by hand\n3 2 # size\n100\n0 49 50\n51 100 0\n", [[0, 0, 1], [1, 1, 0]]),
        (b"P2 3 1 1 # bits\n1 0 # the last\n1", [[1, 0, 1]]),
        (b"P5\n# c\n3 1\n100\n" + bytes([49, 50, 100]), [[0, 1, 1]]),
        (b"P5 2 1 1000\n" + struct.pack(">2H", 499, 500), [[0, 1]]),
        (b"P5 2 1 255\n\n\xff", [[0, 1]]),  # a pixel that looks like a line end
        (b"P5\r\n2 1\r\n255\r\n\xff\0", [[1, 0]]),  # lines of Windows
        (b"P6\r\n1 1\r\n255\r\n\xff\xff\0", [[1]]),
        (b"P5 2 1 255\r\n\xff", [[0, 1]]),  # no byte too many
        (b"P5\r2\t1\r255\r\x80\x7f and more that is not looked at", [[1, 0]]),
    ],
)
def test_pgm_in_all_its_forms(tmp_path, data, free):
    path = tmp_path / "some.pgm"
    path.write_bytes(data)
    assert GridMap.load(path).free.tolist() == np.array(free, dtype=bool).tolist()


@pytest.mark.parametrize("white", [9, 255, 65535])
def test_plain_text_of_many_blocks(white: int) -> None:
    rng = np.random.default_rng(white)
    levels = rng.integers(0, white + 1, (700, 1000))
    gaps = rng.choice(
        [" ", "\n", "  ", "\r\n", "\t00", " #7\n", "#\n", "\n# long " + "comment" * 7 + "#\n"],
        levels.size,
    )
    gaps[0] = ""
    words = "".join(f"{gap}{level}" for gap, level in zip(gaps, levels.ravel(), strict=True))
    data = f"P2 1000 700 {white}\n0000000000000000000000{words} more".encode()
    assert decode_image(data, "map").gray.tolist() == levels.tolist()


@pytest.mark.parametrize(
    "data",
    [
        b"P3\n# three pixels\n3 1 255\n255 0 0  0 255 0  0 0 255\n",
        b"P6 3 1 # size\n255\n" + bytes((255, 0, 0, 0, 255, 0, 0, 0, 255)),
        b"P6 3 1 1000\n" + struct.pack(">9H", 1000, 0, 0, 0, 1000, 0, 0, 0, 1000),
    ],
)
def test_ppm_becomes_gray_by_its_brightness(tmp_path, data):
    path = tmp_path / "colour.ppm"
    path.write_bytes(data)
    for threshold, free in ((0.5, [0, 1, 0]), (0.29, [1, 1, 0]), (0.11, [1, 1, 1])):
        grid = GridMap.load(path, threshold=threshold)
        assert grid.free.tolist() == [[bool(pixel) for pixel in free]]


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"P6 3 3 255\n" + bytes(26), "3 x 3 pixels are announced and 8 are there"),
        (b"P3 1 1 9\n1 2", "1 x 1 pixels are announced and 0 are there"),
        (b"P3 1 1 9\n1 2 10", "the PPM holds levels outside 0 to 9"),
        (b"P6 1 1\n", "the PPM header is incomplete, expected P6"),
        (b"P6 0 1 255\n", "are no PPM"),
    ],
)
def test_broken_ppm(tmp_path, data, message):
    path = tmp_path / "broken.ppm"
    path.write_bytes(data)
    with pytest.raises(MapError, match=message):
        GridMap.load(path)


def test_content_counts_not_the_suffix(tmp_path):
    write_image(tmp_path / "a.png", SHAPE).rename(tmp_path / "a.pgm")
    np.testing.assert_array_equal(GridMap.load(tmp_path / "a.pgm").free, SHAPE > 0)


@pytest.mark.parametrize("suffix", [".png", ".bmp", ".pgm", ".ppm", ".jpg"])
@pytest.mark.parametrize("kept", [0.02, 0.3, 0.6, 0.98])
def test_truncated_images(tmp_path, suffix, kept):
    noise = np.random.default_rng(0).integers(0, 2, (90, 70)).astype(np.uint8) * 255
    path = write_image(tmp_path / f"cut{suffix}", noise)
    data = path.read_bytes()
    path.write_bytes(data[: int(len(data) * kept)])
    with pytest.raises(
        MapError, match=r"cut\.\w+: the (image is truncated|P[GP]M header is incom)"
    ):
        GridMap.load(path)


@pytest.mark.parametrize("suffix", [".png", ".bmp", ".pgm", ".ppm", ".jpg"])
def test_no_prefix_of_an_image_is_a_map(tmp_path, suffix):
    path = write_image(tmp_path / f"cut{suffix}", SHAPE[:20, :20])
    data = path.read_bytes()
    for length in range(0, len(data), 7):
        path.write_bytes(data[:length])
        with pytest.raises(MapError):
            GridMap.load(path)
    path.write_bytes(data[:-1])
    with pytest.raises(MapError):
        GridMap.load(path)


def test_truncated_progressive_and_run_length_images(tmp_path):
    noise = np.random.default_rng(0).integers(0, 2, (90, 70)).astype(np.uint8) * 255
    path = write_image(tmp_path / "waves.jpg", noise, cv2.IMWRITE_JPEG_PROGRESSIVE, 1)
    data = path.read_bytes()
    path.write_bytes(data[: len(data) // 2])
    with pytest.raises(MapError, match="truncated"):
        GridMap.load(path)
    # A BMP header that announces 1000 bytes of run lengths.
    header = struct.pack("<2sIHHIIiiHHII", b"BM", 1078, 0, 0, 78, 40, 8, 8, 1, 8, 1, 1000)
    path.write_bytes(header + bytes(100))
    with pytest.raises(MapError, match="truncated"):
        GridMap.load(path)


@pytest.mark.parametrize("suffix", [".png", ".jpg", ".jpeg", ".bmp", ".pgm"])
@pytest.mark.parametrize("data", [b"", b"hello world\n" * 50, b"\0" * 500])
def test_no_image_at_all(tmp_path, suffix, data):
    path = tmp_path / f"odd{suffix}"
    path.write_bytes(data)
    with pytest.raises(MapError, match=f"odd{suffix}: the (file is empty|content is no PNG)"):
        GridMap.load(path)


def test_damaged_image(tmp_path):
    path = write_image(tmp_path / "damaged.png", SHAPE)
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 0xFF
    path.write_bytes(data)
    with pytest.raises(MapError, match="damaged"):
        GridMap.load(path)


@pytest.mark.parametrize(
    "data",
    [
        png_header(100_000, 100_000),
        b"P5 100000 100000 255\n",
        b"P2 20000 1 255\n0",
        b"P5 99999999999999999999 1 255\n",
        struct.pack("<2sIHHIIiiHHII", b"BM", 0, 0, 0, 54, 40, 30_000, -30_000, 1, 24, 0, 0),
        b"\xff\xd8\xff\xff\xc0\0\x0b\x08" + struct.pack(">HHB", 60_000, 60_000, 1) + b"\x01\x11\0",
    ],
)
def test_huge_images_raise_by_their_header(tmp_path, data):
    path = tmp_path / "huge.png"
    path.write_bytes(data)
    with pytest.raises(MapError, match=f"huge.png: .* maps up to {MAX_SIDE} pixels"):
        GridMap.load(path)


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"P5 3 3\n", "header is incomplete"),
        (b"P5 3 -3 255\n" + bytes(9), "header is incomplete"),
        (b"P5 0 3 255\n", "must be positive"),
        (b"P5 3 3 0\n" + bytes(9), "brightest level"),
        (b"P5 3 3 70000\n" + bytes(18), "brightest level"),
        (b"P5 3 3 255\n" + bytes(8), "truncated, 3 x 3 pixels are announced and 8 are there"),
        (b"P5 3 3 256\n" + bytes(17), "and 8 are there"),
        (b"P2 3 1 255\n1 2", "and 2 are there"),
        (b"P2 3 1 255\n1 2 x", "no number"),
        (b"P2 1 1 255\n99999999999999999999", "outside 0 to 255"),
        (b"P2 3 1 9\n1 2 10", "outside 0 to 9"),
        (b"P2 3 1 9\n1 2 -1", "no number: b'-1'"),
        (b"P5 1 1 100\n\xff", "outside 0 to 100"),
    ],
)
def test_broken_pgm(tmp_path, data, message):
    path = tmp_path / "broken.pgm"
    path.write_bytes(data)
    with pytest.raises(MapError, match=message):
        GridMap.load(path)


def test_all_dark_image_names_the_way_out(tmp_path):
    path = write_image(tmp_path / "night.png", np.full((4, 4), 90, np.uint8))
    with pytest.raises(MapError, match=r"night.png: no pixel .* threshold 0\.5; choose a lower"):
        GridMap.load(path)
    assert GridMap.load(path, threshold=0.3).free.all()
