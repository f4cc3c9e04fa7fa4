"""SVG maps: convex polygons, rasterised so that no obstacle shrinks."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cbagan_ompl import ConfigError, GridMap, MapError

HEAD = '<svg xmlns="http://www.w3.org/2000/svg" xmlns:i="http://www.inkscape.org/x">'
SQUARE = '<path id="a" d="m 10,20 4,0 0,2 -4,0 z"/>'


def write(tmp_path: Path, body: str, head: str = HEAD) -> Path:
    path = tmp_path / "lot.svg"
    path.write_text(f'<?xml version="1.0"?>{head}<defs><path d="?"/></defs>{body}</svg>')
    return path


def test_a_square_in_a_translated_group(tmp_path: Path) -> None:
    path = write(tmp_path, f'<g transform="translate(-10,-20)"><i:grid/>{SQUARE}</g>')
    grid = GridMap.load(path, resolution=0.5, margin=1.0)
    assert grid.name == "lot"
    assert grid.shape == (8, 12)
    low, high = grid.bounds
    assert np.allclose((low, high), [(-1, -3), (5, 1)])
    # y is negated: the square spans x 0 to 4 and y 0 to -2. What it touches is blocked.
    assert not grid.is_free([(0.1, -0.1), (3.9, -1.9), (4.1, -1.0), (2.0, 0.1)]).any()
    assert grid.is_free([(-0.6, -1.0), (4.6, -1.0), (2.0, 0.6), (2.0, -2.6)]).all()


@pytest.mark.parametrize(
    "data",
    [
        "m 10,20 h 4 v 2 h -4 z",
        "M10 20 14 20 14 22 10 22Z",
        "M 10,20 L 14,20 L 14,22 H 10 V 20",
        "m10,20l4.0,0.0e0,0,2-4,0z",
        "m 10,20 4,0 0,1e0 0,1 -4,0 v 0",
    ],
)
def test_spellings_of_one_path(tmp_path: Path, data: str) -> None:
    grid = GridMap.load(write(tmp_path, f'<path d="{data}"/>'), resolution=0.5, margin=1.0)
    expected = GridMap.load(write(tmp_path, SQUARE), resolution=0.5, margin=1.0)
    assert np.array_equal(grid.free, expected.free)


def test_no_pixel_that_a_polygon_touches_is_free(tmp_path: Path) -> None:
    corners = np.array([(0, 0), (7.3, 2.1), (8.9, 6.7), (3.1, 9.6)])
    data = " L ".join(f"{x},{y}" for x, y in corners)
    grid = GridMap.load(write(tmp_path, f'<path d="M {data} z"/>'), resolution=0.3, margin=1)
    weights = np.random.default_rng(0).dirichlet(np.full(4, 0.3), 20_000)
    assert not grid.is_free(weights @ (corners * (1, -1))).any()
    x, y = corners.T
    area = (x * np.roll(y, -1) - np.roll(x, -1) * y).sum() / 2
    blocked = np.count_nonzero(~grid.free) * 0.3**2
    assert area < blocked < area + 35 * 0.3 * 1.5


@pytest.mark.parametrize(
    ("body", "message"),
    [
        ("", "no path"),
        ('<rect width="3" height="3"/>', "<rect> is not read"),
        (f'{SQUARE}<g transform="rotate(30)"/>', "translate"),
        ('<path d="m 0,0 c 1,1 2,2 3,3 z"/>', "curve"),
        ('<path d="m 0,0 4,0 0,4 z m 1,1 1,0 0,1 z"/>', "several parts"),
        ('<path d="m 0,0 4,0 0,z"/>', "numbers"),
        ('<path d="m 0,0 4,0 4 z"/>', "numbers"),
        ('<path d="l 0,0 4,0 z"/>', "no path data"),
        ('<path d="4 4"/>', "no path data"),
        ('<path d=""/>', "no path data"),
        ('<path d="m 0,0 4,0 8,0 z"/>', "no area"),
        ('<path d="m 0,0 1e300,0 0,4 z"/>', "no lengths"),
        ('<path d="m 0,0 1e999,0 0,4 z"/>', "no lengths"),
        ('<path d="M 0,0 9,0 9,9 8,9 8,1 0,1 z"/>', "not convex"),
        ("<path", "no valid XML"),
        # Patterns that fit a text in many ways would take hours for these.
        (f'<path d="m 0,0{" " * 3_000_000}!"/>', "no path data"),
        (f'<path d="m 0,0{" ," * 1_000_000}!"/>', "no path data"),
        (f'<path d="m 0,0 {"1" * 3_000_000}!"/>', "no path data"),
        (f'<g transform="translate({"1" * 3_000_000}x"/>', "translate"),
        (f'<g transform="translate(1{" " * 3_000_000}x"/>', "translate"),
    ],
)
def test_files_that_are_no_maps(tmp_path: Path, body: str, message: str) -> None:
    with pytest.raises(MapError, match=message):
        GridMap.load(write(tmp_path, body))


@pytest.mark.parametrize("encoding", ["utf-7", "shift_jis", "no-such-thing", "rot13"])
def test_odd_encodings_are_refused(tmp_path: Path, encoding: str) -> None:
    path = tmp_path / "lot.svg"
    path.write_text(f'<?xml version="1.0" encoding="{encoding}"?>{HEAD}{SQUARE}</svg>')
    with pytest.raises(MapError, match="no valid XML"):
        GridMap.load(path)


def test_small_and_large_polygons_are_told_from_lines(tmp_path: Path) -> None:
    for size in (1e-150, 1e-30, 1e8):
        body = f'<path d="m 0,0 {size},0 0,{size} z"/>'
        grid = GridMap.load(write(tmp_path, body), resolution=size / 4, margin=size)
        assert np.count_nonzero(~grid.free) > 9
        with pytest.raises(MapError, match="no area"):
            GridMap.load(write(tmp_path, f'<path d="m 0,0 {size},{size} {size},{size} z"/>'))


def test_overlapping_polygons_and_their_number(tmp_path: Path) -> None:
    tall = '<path d="m 0,0 1,60 1,-60 z"/>'
    path = write(tmp_path, 300 * tall)
    grid = GridMap.load(path, resolution=0.5, margin=1.0)
    one = GridMap.load(write(tmp_path, tall), resolution=0.5, margin=1.0)
    assert np.array_equal(grid.free, one.free)
    with pytest.raises(MapError, match="rows of pixels"):
        GridMap.load(write(tmp_path, 2000 * tall), resolution=0.01, margin=1.0)


def test_entities_are_refused(tmp_path: Path) -> None:
    bomb = '<!DOCTYPE svg [<!ENTITY a "ha"><!ENTITY b "&a;&a;&a;&a;">]>'
    with pytest.raises(MapError, match="entities"):
        GridMap.load(write(tmp_path, SQUARE, bomb + HEAD))


def test_sizes_are_limited(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(MapError, match=r"too fine|pixels"):
        GridMap.load(write(tmp_path, SQUARE), resolution=1e-6)
    with pytest.raises(MapError, match="leave no pixel free"):
        GridMap.load(write(tmp_path, SQUARE), resolution=0.5)
    many = "".join(f'<path d="m {i},0 1,0 0,1 z"/>' for i in range(40))
    monkeypatch.setattr("cbagan_ompl.maps.svg.MAX_POINTS", 100)
    with pytest.raises(MapError, match="points"):
        GridMap.load(write(tmp_path, many))
    path = tmp_path / "huge.svg"
    path.write_bytes(b" " * (2**22 + 1))
    with pytest.raises(MapError, match="MiB"):
        GridMap.load(path)


@pytest.mark.parametrize("options", [{"resolution": 0}, {"margin": -1}, {"resolution": "fine"}])
def test_options_that_make_no_sense(tmp_path: Path, options: dict[str, float]) -> None:
    with pytest.raises(ConfigError):
        GridMap.load(write(tmp_path, SQUARE), **options)
