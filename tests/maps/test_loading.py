"""Map files of every kind, recognised by their suffix; options; the bundled maps."""

from __future__ import annotations

import pytest
from helpers.images import SHAPE, write_image

from cbagan_ompl.errors import ConfigError, MapError
from cbagan_ompl.maps.grid_map import GridMap
from cbagan_ompl.maps.loading import MapOptions, bundled_maps


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
        GridMap.load(write_image(tmp_path / "a.png", SHAPE), **options)
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
