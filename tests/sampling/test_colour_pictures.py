"""Heat maps in colour: read where it is certain what they say, otherwise an error."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

from cbagan_ompl import GridMap, Heatmap, HeatmapError, plan

# Blue, green, red, as OpenCV has them.
WHITE, BLACK, GREEN = (255, 255, 255), (0, 0, 0), (0, 255, 0)
RED, BLUE = (0, 0, 255), (255, 0, 0)


@pytest.fixture
def grid() -> GridMap:
    free = np.ones((40, 50), bool)
    free[:30, 20:24] = False
    return GridMap(free, name="hall")


def draw(grid: GridMap, green: tuple[int, int, int] = GREEN) -> np.ndarray:
    """A region around the end of the wall, with obstacles and marks."""
    picture = np.full((*grid.shape, 3), WHITE, np.uint8)
    picture[5:38, 5:12] = green
    picture[31:38, 5:44] = green
    picture[5:38, 38:44] = green
    picture[~grid.free] = BLACK
    return picture


def region_of(picture: np.ndarray) -> np.ndarray:
    return np.asarray((picture[..., 1] > 100) & (picture[..., 2] < 100))


@pytest.mark.parametrize("suffix", [".png", ".bmp", ".ppm"])
@pytest.mark.parametrize("green", [GREEN, (0, 128, 0), (50, 205, 50)])
def test_region_is_where_the_picture_is_green(
    grid: GridMap, tmp_path: Path, suffix: str, green: tuple[int, int, int]
) -> None:
    picture = draw(grid, green)
    path = tmp_path / f"roi{suffix}"
    cv2.imwrite(str(path), picture)
    heatmap = Heatmap.load(path, grid)
    np.testing.assert_array_equal(heatmap.region, region_of(picture))
    assert set(np.unique(heatmap.values)) == {0, 1}
    assert heatmap.connects((8.5, 8.5), (41.5, 8.5))


def test_marks_belong_to_the_region_that_they_cover(grid: GridMap, tmp_path: Path) -> None:
    picture = draw(grid)
    wanted = region_of(picture)
    picture[8, 8], picture[7:10, 40:43] = BLUE, RED
    path = tmp_path / "roi.png"
    cv2.imwrite(str(path), picture)
    heatmap = Heatmap.load(path, grid)
    np.testing.assert_array_equal(heatmap.region, wanted)
    result = plan(grid, (8.5, 8.5), (41.5, 8.5), "RRT", heatmap=heatmap, time=5, seed=1)
    assert result.solved


def test_published_form(grid: GridMap, tmp_path: Path) -> None:
    """With an alpha channel that is opaque, no obstacles, and 16 bits as well."""
    picture = np.full((*grid.shape, 4), 255, np.uint8)
    picture[10:20, :, :3] = GREEN
    for pixels in (picture, picture.astype(np.uint16) * 257):
        cv2.imwrite(str(tmp_path / "roi.png"), pixels)
        region = Heatmap.load(tmp_path / "roi.png", grid).region
        assert (region == ((picture[..., 2] == 0) & grid.free)).all()


def colour_map(grid: GridMap) -> np.ndarray:
    levels = np.linspace(0, 255, grid.width).astype(np.uint8)[None].repeat(grid.height, axis=0)
    return np.asarray(cv2.applyColorMap(levels, cv2.COLORMAP_JET))


def marks_alone(grid: GridMap) -> np.ndarray:
    picture = np.full((*grid.shape, 3), WHITE, np.uint8)
    picture[5:8, 5:8], picture[5:8, 40:43] = GREEN, RED
    return picture


def half(colour: tuple[int, int, int], other: tuple[int, int, int], grid: GridMap) -> np.ndarray:
    picture = np.full((*grid.shape, 3), colour, np.uint8)
    picture[20:] = other
    return picture


@pytest.mark.parametrize(
    "make",
    [
        colour_map,
        marks_alone,
        lambda grid: half(GREEN, RED, grid),
        lambda grid: half(WHITE, RED, grid),
        lambda grid: half(BLACK, BLUE, grid),
        lambda grid: half(WHITE, (200, 220, 200), grid),
        lambda grid: half(GREEN, (120, 120, 120), grid),
        lambda grid: np.dstack((draw(grid), np.full(grid.shape, 128, np.uint8))),
    ],
)
def test_other_colours_are_refused(grid: GridMap, tmp_path: Path, make: object) -> None:
    path = tmp_path / "heat.png"
    cv2.imwrite(str(path), make(grid))  # type: ignore[operator]
    with pytest.raises(HeatmapError, match=r"heat.png: a heat map is a gray image, .* green"):
        Heatmap.load(path, grid)


def test_gray_images_with_three_channels_stay_gray(grid: GridMap, tmp_path: Path) -> None:
    gray = np.arange(grid.free.size, dtype=np.uint8).reshape(grid.shape)
    cv2.imwrite(str(tmp_path / "gray.png"), gray)
    cv2.imwrite(str(tmp_path / "three.png"), cv2.cvtColor(gray, cv2.COLOR_GRAY2BGR))
    one, three = (Heatmap.load(tmp_path / name, grid) for name in ("gray.png", "three.png"))
    np.testing.assert_array_equal(one.values, three.values)
