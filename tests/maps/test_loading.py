"""Map files: every format as it should be read, and every broken file refused with a reason."""

from __future__ import annotations

import struct
import zlib
from math import pi

import cv2
import numpy as np
import pytest

from cbagan_ompl.errors import ConfigError, MapError
from cbagan_ompl.maps.grid_map import GridMap
from cbagan_ompl.maps.loading import MapOptions, bundled_maps
from cbagan_ompl.maps.raw_map import MAX_SIDE

GRAYS = np.array([[0, 100, 127, 128], [200, 205, 254, 255]], dtype=np.uint8)
SHAPE = np.kron([[1, 0, 1], [1, 1, 0]], np.ones((16, 16))).astype(np.uint8) * 255


def image(path, pixels, *flags):
    """Write pixels in the format that the suffix of the path names."""
    done, data = cv2.imencode(path.suffix, pixels, list(flags))
    assert done
    path.write_bytes(data.tobytes())
    return path


def png_header(width, height):
    """The first chunk of a PNG file."""
    chunk = b"IHDR" + struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n\0\0\0\r" + chunk + struct.pack(">I", zlib.crc32(chunk))


# --- images ---------------------------------------------------------------------------------


@pytest.mark.parametrize("suffix", [".png", ".bmp", ".pgm", ".jpg", ".jpeg", ".PNG", ".Jpg"])
def test_images(tmp_path, suffix):
    grid = GridMap.load(image(tmp_path / f"some map.v2{suffix}", SHAPE))
    np.testing.assert_array_equal(grid.free, SHAPE > 0)
    assert (grid.name, grid.resolution, grid.origin) == ("some map.v2", 1.0, None)


def test_path_may_be_a_string_with_any_characters(tmp_path):
    path = tmp_path / "Lageplan Größe 図.png"
    image(path, SHAPE)
    assert GridMap.load(str(path)).name == "Lageplan Größe 図"


def test_half_is_the_threshold_between_127_and_128(tmp_path):
    path = image(tmp_path / "grays.png", GRAYS)
    assert GridMap.load(path).free.tolist() == (GRAYS >= 128).tolist()


@pytest.mark.parametrize(
    ("threshold", "first"), [(0, 0), (100 / 255, 100), (100.01 / 255, 127), (0.8, 205), (1, 255)]
)
def test_threshold_is_met_by_equal_levels(tmp_path, threshold, first):
    path = image(tmp_path / "grays.png", GRAYS)
    grid = GridMap.load(path, threshold=threshold)
    assert sorted(GRAYS[grid.free]) == [level for level in GRAYS.ravel() if level >= first]


def test_16_bits_are_measured_against_65535(tmp_path):
    levels = np.array([[0, 255, 32767, 32768, 65535]], dtype=np.uint16)
    for name in ("deep.png", "deep.pgm"):
        free = GridMap.load(image(tmp_path / name, levels)).free
        assert free.tolist() == [[False, False, False, True, True]]


def test_colour_becomes_gray_by_its_brightness(tmp_path):
    blue_green_red = np.array([[(255, 0, 0), (0, 255, 0), (0, 0, 255), (0, 255, 255)]], np.uint8)
    for name in ("colour.png", "colour.bmp"):
        path = image(tmp_path / name, blue_green_red)
        assert GridMap.load(path).free.tolist() == [[False, True, False, True]]
        assert GridMap.load(path, threshold=0.29).free.tolist() == [[False, True, True, True]]


def test_transparent_pixels_are_unknown(tmp_path):
    bgra = np.zeros((1, 4, 4), np.uint8)
    bgra[0, :, :3] = np.array([255, 255, 255, 0])[:, None]
    bgra[0, :, 3] = 255, 254, 0, 255
    path = image(tmp_path / "alpha.png", bgra)
    assert GridMap.load(path).free.tolist() == [[True, False, False, False]]
    assert GridMap.load(path, unknown_is_free=True).free.tolist() == [[True, True, True, False]]


def test_bilevel_png(tmp_path):
    path = image(tmp_path / "bits.png", SHAPE, cv2.IMWRITE_PNG_BILEVEL, 1)
    np.testing.assert_array_equal(GridMap.load(path).free, SHAPE > 0)


@pytest.mark.parametrize(
    ("data", "free"),
    [
        (b"P2\n# drawn by hand\n3 2 # size\n100\n0 49 50\n51 100 0\n", [[0, 0, 1], [1, 1, 0]]),
        (b"P2 3 1 1 # bits\n1 0 # the last\n1", [[1, 0, 1]]),
        (b"P5\n# c\n3 1\n100\n" + bytes([49, 50, 100]), [[0, 1, 1]]),
        (b"P5 2 1 1000\n" + struct.pack(">2H", 499, 500), [[0, 1]]),
        (b"P5 2 1 255\n\n\xff", [[0, 1]]),  # a pixel that looks like a line end
        (b"P5\r2\t1\r255\r\x80\x7f and more that is not looked at", [[1, 0]]),
    ],
)
def test_pgm_in_all_its_forms(tmp_path, data, free):
    path = tmp_path / "some.pgm"
    path.write_bytes(data)
    assert GridMap.load(path).free.tolist() == np.array(free, dtype=bool).tolist()


def test_content_counts_not_the_suffix(tmp_path):
    image(tmp_path / "a.png", SHAPE).rename(tmp_path / "a.pgm")
    np.testing.assert_array_equal(GridMap.load(tmp_path / "a.pgm").free, SHAPE > 0)


# --- broken images --------------------------------------------------------------------------


@pytest.mark.parametrize("suffix", [".png", ".bmp", ".pgm", ".jpg"])
@pytest.mark.parametrize("kept", [0.02, 0.3, 0.6, 0.98])
def test_truncated_images(tmp_path, suffix, kept):
    noise = np.random.default_rng(0).integers(0, 2, (90, 70)).astype(np.uint8) * 255
    path = image(tmp_path / f"cut{suffix}", noise)
    data = path.read_bytes()
    path.write_bytes(data[: int(len(data) * kept)])
    with pytest.raises(MapError, match=r"cut\.\w+: the (image is truncated|PGM header is incom)"):
        GridMap.load(path)


@pytest.mark.parametrize("suffix", [".png", ".bmp", ".pgm", ".jpg"])
def test_no_prefix_of_a_image_is_a_map(tmp_path, suffix):
    path = image(tmp_path / f"cut{suffix}", SHAPE[:20, :20])
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
    path = image(tmp_path / "waves.jpg", noise, cv2.IMWRITE_JPEG_PROGRESSIVE, 1)
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
    path = image(tmp_path / "damaged.png", SHAPE)
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
def test_huge_images_are_refused_by_their_header(tmp_path, data):
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
        (b"P2 1 1 255\n99999999999999999999", "no number"),
        (b"P2 3 1 9\n1 2 10", "outside 0 to 9"),
        (b"P2 3 1 9\n1 2 -1", "outside 0 to 9"),
        (b"P5 1 1 100\n\xff", "outside 0 to 100"),
    ],
)
def test_broken_pgm(tmp_path, data, message):
    path = tmp_path / "broken.pgm"
    path.write_bytes(data)
    with pytest.raises(MapError, match=message):
        GridMap.load(path)


def test_all_dark_image_names_the_way_out(tmp_path):
    path = image(tmp_path / "night.png", np.full((4, 4), 90, np.uint8))
    with pytest.raises(MapError, match=r"night.png: no pixel .* threshold 0\.5; choose a lower"):
        GridMap.load(path)
    assert GridMap.load(path, threshold=0.3).free.all()


# --- other files, options, bundled maps -------------------------------------------------------


def test_missing_files_folders_and_unknown_kinds(tmp_path):
    for name in ("none.png", "none.yaml", "none.map", "nul\0.png"):
        with pytest.raises(MapError, match=r"cannot read .*none|cannot read .*nul"):
            GridMap.load(tmp_path / name)
    (tmp_path / "folder.png").mkdir()
    with pytest.raises(MapError, match=r"cannot read .*folder.png"):
        GridMap.load(tmp_path / "folder.png")
    for name in ("map.tiff", "map"):
        with pytest.raises(MapError, match=r"unknown kind .* \.png, .*\.yaml .*\.map .*bundled:"):
            GridMap.load(tmp_path / name)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"treshold": 0.5}, "'treshold'; known are threshold, unknown_is_free"),
        ({"threshold": 1.1}, "threshold must be a number from 0 to 1, got 1.1"),
        ({"threshold": float("nan")}, "threshold must be"),
        ({"threshold": "0.5"}, "threshold must be"),
        ({"threshold": True}, "threshold must be"),
        ({"unknown_is_free": 1}, "unknown_is_free is True or False"),
    ],
)
def test_options_that_make_no_sense(tmp_path, options, message):
    with pytest.raises(ConfigError, match=message):
        GridMap.load(image(tmp_path / "a.png", SHAPE), **options)
    assert MapOptions() == MapOptions(threshold=0.5, unknown_is_free=False)


def test_bundled_maps():
    names = bundled_maps()
    assert len(names) >= 6
    for name in names:
        grid = GridMap.load(f"bundled:{name}")
        assert (grid.name, grid.origin) == (name, None)
        assert 0.5 < grid.free.mean() < 0.95
    with pytest.raises(MapError, match=f"no map 'nowhere' is bundled; there are {names[0]}, "):
        GridMap.load("bundled:nowhere")
    with pytest.raises(MapError, match="no map"):
        GridMap.load("bundled:../maps/maze")


# --- ROS maps ---------------------------------------------------------------------------------

KEYS = {
    "image": "image.pgm",
    "resolution": "0.05",
    "origin": "[-1.5, 2.0, 0.0]",
    "negate": "0",
    "occupied_thresh": "0.65",
    "free_thresh": "0.196",
}


@pytest.fixture
def ros(tmp_path):
    """A function that writes a map_server map and returns the path of its YAML file."""

    def write(pixels=GRAYS, **keys):
        keys = {**KEYS, **keys}
        if pixels is not None:
            image(tmp_path / keys["image"], pixels)
        lines = [f"{key}: {value}" for key, value in keys.items() if value is not None]
        path = tmp_path / "office.yaml"
        path.write_text("\n".join(lines), encoding="utf-8")
        return path

    return write


def test_ros_map_has_its_frame(ros):
    pixels = np.full((4, 6), 254, np.uint8)
    pixels[0, 5] = 0
    grid = GridMap.load(ros(pixels))
    assert (grid.name, grid.resolution, grid.origin) == ("office", 0.05, (-1.5, 2.0, 0.0))
    assert grid.free.tolist() == (pixels > 0).tolist()  # row 0 stays on top ...
    assert not grid.is_free((-1.5 + 5.5 * 0.05, 2.0 + 3.5 * 0.05))  # ... which is at the largest y
    assert grid.is_free((-1.5 + 5.5 * 0.05, 2.0 + 0.5 * 0.05))


def test_ros_yaw(ros):
    pixels = np.full((4, 6), 254, np.uint8)
    pixels[0, 5] = 0
    grid = GridMap.load(ros(pixels, origin=f"[1, 2, {pi / 2}]"))
    # 5.5 pixels along the turned x axis (up) and 3.5 along the turned y axis (left).
    assert not grid.is_free((1 - 3.5 * 0.05, 2 + 5.5 * 0.05))


@pytest.mark.parametrize(("free_thresh", "free_205"), [("0.196", False), ("0.25", True)])
def test_ros_unknown_gray_205_depends_on_free_thresh(ros, free_thresh, free_205):
    grid = GridMap.load(ros(np.array([[0, 205, 254]], np.uint8), free_thresh=free_thresh))
    assert grid.free.tolist() == [[False, free_205, True]]


def test_ros_thresholds_are_met_by_equal_values(ros):
    # p of the gray level 204 is 0.2 exactly, that of 102 is 0.6.
    pixels = np.array([[101, 102, 103, 203, 204, 205]], np.uint8)
    path = ros(pixels, free_thresh="0.2", occupied_thresh="0.6")
    assert GridMap.load(path).free.tolist() == [[False, False, False, False, True, True]]
    known = GridMap.load(path, unknown_is_free=True)
    assert known.free.tolist() == [[False, False, True, True, True, True]]


@pytest.mark.parametrize("negate", ["1", "true", "yes"])
def test_ros_negate(ros, negate):
    grid = GridMap.load(ros(negate=negate))
    assert grid.free.tolist() == (GRAYS <= 0.196 * 255).tolist()


@pytest.mark.parametrize("mode", ["trinary", "Trinary", "scale", "SCALE", None])
def test_ros_unknown_and_partly_occupied_are_blocked_unless_asked(ros, mode):
    path = ros(mode=mode)
    assert GridMap.load(path).free.tolist() == (GRAYS > 205).tolist()
    assert GridMap.load(path, unknown_is_free=True).free.tolist() == (GRAYS >= 100).tolist()


@pytest.mark.parametrize("mode", ["trinary", "scale"])
def test_ros_transparent_is_unknown(ros, mode):
    bgra = np.full((1, 3, 4), 255, np.uint8)
    bgra[0, 1, 3] = 254
    bgra[0, 2] = 0, 0, 0, 0  # black, but transparent: not known to be occupied
    path = ros(bgra, image="image.png", mode=mode)
    assert GridMap.load(path).free.tolist() == [[True, False, False]]
    assert GridMap.load(path, unknown_is_free=True).free.all()


def test_ros_raw_levels_are_percent(ros):
    pixels = np.array([[0, 25, 26, 64, 65, 100, 101, 255]], np.uint8)
    keys = {"mode": "raw", "free_thresh": "0.25", "negate": "1"}
    path = ros(pixels, **keys)
    assert GridMap.load(path).free.tolist() == [[True, True, *[False] * 6]]
    assert GridMap.load(path, unknown_is_free=True).free.tolist() == (
        [[True, True, True, True, False, False, True, True]]
    )
    # 16 bits are brought down to 8 first, as by map_server.
    deep = ros(pixels.astype(np.uint16) * 257, image="image.png", **keys)
    assert GridMap.load(deep).free.tolist() == [[True, True, *[False] * 6]]


def test_ros_raw_looks_at_no_transparency(ros):
    bgra = np.zeros((1, 2, 4), np.uint8)
    bgra[0, 1, :3] = 90
    path = ros(bgra, image="image.png", mode="raw")
    assert GridMap.load(path).free.tolist() == [[True, False]]
    assert GridMap.load(path, unknown_is_free=True).free.tolist() == [[True, False]]


def test_ros_image_of_other_formats_in_other_folders(ros, tmp_path):
    (tmp_path / "images").mkdir()
    colour = cv2.cvtColor(GRAYS, cv2.COLOR_GRAY2BGR)
    for image in ("images/a.png", "images/a.bmp", str(tmp_path / "images" / "b.png")):
        assert GridMap.load(ros(colour, image=image)).free.tolist() == (GRAYS > 205).tolist()


def test_ros_numbers_that_only_ros_reads(ros):
    assert GridMap.load(ros(resolution="5e-2")).resolution == 0.05


@pytest.mark.parametrize("key", list(KEYS))
def test_ros_missing_key(ros, key):
    with pytest.raises(MapError, match=rf"office.yaml: missing keys: {key}$"):
        GridMap.load(ros(**{key: None}, pixels=None))


@pytest.mark.parametrize(
    ("key", "value", "reason"),
    [
        ("resolution", "0", "must be positive"),
        ("resolution", "-0.05", "must be positive"),
        ("resolution", ".nan", "finite numbers"),
        ("resolution", ".inf", "finite numbers"),
        ("resolution", "true", "finite numbers, got True"),
        ("resolution", "fine", "finite numbers, got 'fine'"),
        ("resolution", "[0.05]", "finite numbers"),
        ("resolution", "", "finite numbers, got None"),
        ("origin", "[0, 0]", r"must be \[x, y, yaw\]"),
        ("origin", "0", r"must be \[x, y, yaw\]"),
        ("origin", "[0, 0, .nan]", "finite numbers, got nan"),
        ("origin", "[0, 0, false]", "finite numbers, got False"),
        ("negate", "2", "0, 1, false or true"),
        ("negate", "0.0", "0, 1, false or true"),
        ("negate", "maybe", "0, 1, false or true"),
        ("occupied_thresh", "65", "from 0 to 1"),
        ("free_thresh", "-0.1", "from 0 to 1"),
        ("free_thresh", "0.65", "below occupied_thresh, which is 0.65"),
        ("free_thresh", "0.7", "below occupied_thresh"),
        ("mode", "binary", "choose one of trinary, scale, raw"),
        ("mode", "3", "choose one of"),
    ],
)
def test_ros_values_that_make_no_sense(ros, key, value, reason):
    with pytest.raises(MapError, match=f"Failed to read .*office.yaml, key '{key}' = .*{reason}"):
        GridMap.load(ros(**{key: value}))


def test_ros_images_that_cannot_be_read(ros, tmp_path):
    for image, reason in (("gone.pgm", "cannot read .*gone.pgm"), ("", "path"), ("7", "path")):
        with pytest.raises(MapError, match=f"key 'image' = .*{reason}"):
            GridMap.load(ros(None, image=image))
    (tmp_path / "cut.pgm").write_bytes(b"P5 9 9 255\n")
    with pytest.raises(MapError, match=r"key 'image' = 'cut.pgm': .*cut.pgm: the image is trunc"):
        GridMap.load(ros(None, image="cut.pgm"))


def test_ros_map_without_free_pixels_says_how_it_was_read(ros):
    with pytest.raises(MapError, match=r"no pixel .* mode trinary, negate 0 and free_thresh 0.196"):
        GridMap.load(ros(np.full((2, 2), 205, np.uint8)))


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", "no keys at all"),
        ("- a\n- b\n", "no keys at all"),
        ("just words", "no keys at all"),
        ("image: [a\norigin: }", "no valid YAML: .*line 2"),
        ("image: !!python/object/apply:os.getcwd []", "no valid YAML"),
        ("image: 2001-99-99", "no valid YAML"),
        ("[" * 1500, "no valid YAML"),
        ("\x00\x01", "no valid YAML"),
        (b"\xff\xfe\xfa", "no valid YAML"),
    ],
)
def test_ros_no_yaml(tmp_path, text, reason):
    path = tmp_path / "office.yml"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(MapError, match=rf"(?s)Failed to read .*office.yml: .*{reason}"):
        GridMap.load(path)


# --- MovingAI maps ----------------------------------------------------------------------------

ROWS = [".GS@O", "TW...", "....."]


def moving_ai(rows=ROWS, height=3, width=5, first="type octile"):
    return "\n".join([first, f"height {height}", f"width {width}", "map", *rows, ""])


def test_moving_ai_terrain(tmp_path):
    path = tmp_path / "arena.map"
    path.write_text(moving_ai())
    grid = GridMap.load(path)
    assert grid.free.astype(int).tolist() == [[1, 1, 1, 0, 0], [0, 0, 1, 1, 1], [1] * 5]
    assert (grid.name, grid.origin, grid.resolution) == ("arena", None, 1.0)


def test_moving_ai_line_ends_and_order_do_not_matter(tmp_path):
    path = tmp_path / "arena.map"
    text = "type tile\nwidth  5 \nheight 3\nmap\n" + "\n".join(ROWS) + " \n\n\n"
    path.write_bytes(text.replace("\n", "\r\n").encode())
    assert GridMap.load(path).shape == (3, 5)
    path.write_text(moving_ai().rstrip())
    assert GridMap.load(path).shape == (3, 5)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "no MovingAI map; its first lines must be"),
        ("hello\nworld\n", "no MovingAI map"),
        (moving_ai(first="octile"), "no MovingAI map"),
        (moving_ai().replace("map\n", ""), "no MovingAI map"),
        ("type octile\nheight 3\n", "no MovingAI map"),
        ("type octile\nheight 3\nheight 3\nwidth 5\nmap\n", "no MovingAI map"),
        (moving_ai(height=0), "line 2: height must be a positive whole number"),
        (moving_ai(width=-5), "line 3: width must be"),
        (moving_ai(width="5 5"), "line 3: width must be"),
        (moving_ai(width="wide"), "line 3: width must be"),
        (moving_ai(width="9" * 5000), "line 3: width must be"),
        (moving_ai(width=10**6), f"maps up to {MAX_SIDE}"),
        (moving_ai([".....", "....", "....."]), "line 6: a row of 4 characters, the width is 5"),
        (moving_ai([".....", "......", "....."]), "line 6: a row of 6 characters"),
        (moving_ai([".....", "", "....."]), "line 6: a row of 0 characters"),
        (moving_ai([".....", "..x..", "....."]), "line 6: unknown character 'x'; known are"),
        (moving_ai([".....", "..é..", "....."]), "line 6: unknown character 'é'"),
        (moving_ai(ROWS[:2]), "line 6: the file has 2 rows, the height is 3"),
        (moving_ai([*ROWS, "....."]), "line 8: the file has 4 rows, the height is 3"),
        (moving_ai(["@@@@@"] * 3), "every pixel is blocked"),
    ],
)
def test_moving_ai_broken(tmp_path, text, message):
    path = tmp_path / "broken.map"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(MapError, match=message):
        GridMap.load(path)


def test_moving_ai_no_text(tmp_path):
    path = tmp_path / "binary.map"
    path.write_bytes(png_header(5, 5))
    with pytest.raises(MapError, match=r"binary.map is no text file"):
        GridMap.load(path)
