"""ROS map_server maps: the rules of nav2, and every broken key with a reason."""

from __future__ import annotations

from contextlib import nullcontext
from math import pi

import cv2
import numpy as np
import pytest
from helpers.images import GRAYS, write_image

from cbagan_ompl.errors import CbaganOmplWarning, MapError
from cbagan_ompl.maps.grid_map import GridMap

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
            write_image(tmp_path / keys["image"], pixels)
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
    path = ros(np.array([[0, 205, 254]], np.uint8), free_thresh=free_thresh)
    with pytest.warns(CbaganOmplWarning) if free_205 else nullcontext():
        grid = GridMap.load(path)
    assert grid.free.tolist() == [[False, free_205, True]]


@pytest.mark.parametrize("image", ["image.pgm", "image.png"])
def test_ros_warns_where_much_unknown_space_is_free(ros, tmp_path, image):
    """As nav2's map saver writes it: 205 beside a free_thresh of 0.25."""
    pixels = np.full((20, 20), 254, np.uint8)
    pixels[:1, :8] = 205  # 2 %
    path = ros(pixels, image=image, free_thresh="0.25")
    with pytest.warns(CbaganOmplWarning, match=r"yaml: 2% of the pixels have .* 205") as said:
        assert GridMap.load(path).free.all()
    assert "free_thresh 0.25" in str(said[0].message)
    assert said[0].filename == __file__, "the line of the caller"
    if image == "image.png":
        write_image(tmp_path / image, pixels.astype(np.uint16) * 257)
        with pytest.warns(CbaganOmplWarning, match="2% of the pixels"):
            GridMap.load(path)


def test_ros_warns_of_nothing_else(ros):
    """Warnings are errors in these tests."""
    pixels = np.full((20, 20), 254, np.uint8)
    pixels[0, :3] = 205  # below 1 %
    GridMap.load(ros(pixels, free_thresh="0.25"))
    pixels[:10] = 205
    assert GridMap.load(ros(pixels, free_thresh="0.196")).free.mean() == 0.5
    assert GridMap.load(ros(pixels, free_thresh="0.25"), unknown_is_free=True).free.all()
    GridMap.load(ros(255 - pixels, free_thresh="0.25", negate="1"))
    assert GridMap.load(ros(pixels // 100, free_thresh="0.25", mode="raw")).free.all()


def test_ros_yaml_with_tabs(ros):
    path = ros()
    plain = GridMap.load(path)
    path.write_text(path.read_text().replace(": ", ":\t").replace(", ", ",\t"))
    tabbed = GridMap.load(path)
    assert tabbed.free.tolist() == plain.free.tolist()
    assert (tabbed.resolution, tabbed.origin) == (plain.resolution, plain.origin)


def test_ros_image_in_the_home_folder(ros, tmp_path, monkeypatch):
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    (tmp_path / "home" / "maps").mkdir(parents=True)
    write_image(tmp_path / "home" / "maps" / "a.pgm", GRAYS)
    path = ros(None, image="~/maps/a.pgm")
    assert GridMap.load(path).free.tolist() == (GRAYS > 205).tolist()
    with pytest.raises(MapError, match=r"key 'image' = '~nobody-there/a.pgm': the home of this"):
        GridMap.load(ros(None, image="~nobody-there/a.pgm"))
    with pytest.raises(MapError, match=r"key 'image' = None: must be the path of an image"):
        GridMap.load(ros(None, image="~"))


def test_ros_ppm_and_png_with_bytes_after_their_end(ros, tmp_path):
    colour = cv2.cvtColor(GRAYS, cv2.COLOR_GRAY2BGR)
    assert GridMap.load(ros(colour, image="a.ppm")).free.tolist() == (GRAYS > 205).tolist()
    path = ros(GRAYS, image="a.png")
    for count in (1, 57, 5000):
        write_image(tmp_path / "a.png", GRAYS)
        with open(tmp_path / "a.png", "ab") as file:
            file.write(b"\0" * count)
        assert GridMap.load(path).free.tolist() == (GRAYS > 205).tolist()


@pytest.mark.filterwarnings("ignore:.*gray level 205")
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
