"""MovingAI maps: terrain, and every broken line with a reason."""

from __future__ import annotations

import tracemalloc

import pytest
from helpers.fuzzing import mutations, read_all
from helpers.images import png_header

from cbagan_ompl.errors import MapError
from cbagan_ompl.maps.grid_map import GridMap
from cbagan_ompl.maps.raw_map import MAX_SIDE

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


@pytest.mark.parametrize(
    "data",
    [
        moving_ai().encode() + b"\n" * 2**25,
        moving_ai().encode() + b"....." * 2**22,
        b"type octile\n" * 2**21,
        b"\r" * 2**25,
        b"type octile\nheight 9\nwidth 9\nmap\n" * 2**20,
    ],
)
def test_large_files_of_small_maps_are_refused_early(tmp_path, data):
    path = tmp_path / "large.map"
    path.write_bytes(data)
    tracemalloc.start()
    try:
        with pytest.raises(MapError):
            GridMap.load(path)
        assert tracemalloc.get_traced_memory()[1] < 2e8
    finally:
        tracemalloc.stop()


def test_damaged_maps_are_read_or_refused(tmp_path):
    path = tmp_path / "damaged.map"

    def read(data):
        path.write_bytes(data)
        GridMap.load(path)

    valid = [moving_ai().encode(), moving_ai(["." * 30] * 20, 20, 30, "type tile").encode()]
    counts = read_all(read, mutations(valid, 1500, 1))
    assert min(counts["read"], counts["refused"]) > 20
