from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest
from helpers.tasks import GOAL, START
from scipy.stats import chisquare, kstest

from cbagan_ompl import GridMap, Heatmap, HeatmapError, TaskError


def random_heatmap(seed: int = 0, **frame: object) -> Heatmap:
    rng = np.random.default_rng(seed)
    free = rng.random((12, 17)) < 0.8
    values = rng.random(free.shape) ** 3
    values[rng.random(free.shape) < 0.2] = 0
    return Heatmap(values, GridMap(free, **frame))


@pytest.mark.parametrize("frame", [{}, {"resolution": 0.05, "origin": (-3.0, 2.0, 0.7)}])
def test_draws_follow_the_values(frame: dict[str, object]) -> None:
    heatmap = random_heatmap(**frame)
    points = heatmap.sample(200_000, np.random.default_rng(1))
    columns, rows = np.floor(heatmap.grid.to_pixel(points)).astype(int).T
    counts = np.zeros(heatmap.grid.shape)
    np.add.at(counts, (rows, columns), 1)
    expected = heatmap.values.astype(float) / heatmap.values.sum() * len(points)
    assert (counts[expected == 0] == 0).all()
    support = expected > 0
    total = expected[support].sum()
    assert chisquare(counts[support] * total / counts.sum(), expected[support]).pvalue > 1e-3


def test_draws_are_uniform_inside_a_pixel() -> None:
    heatmap = random_heatmap()
    inside = heatmap.sample(20_000, np.random.default_rng(2)) % 1
    for axis in range(2):
        assert kstest(inside[:, axis], "uniform").pvalue > 1e-3


def test_same_seed_same_draws() -> None:
    heatmap = random_heatmap()
    np.testing.assert_array_equal(heatmap.sample(100, 7), heatmap.sample(100, 7))
    assert not np.array_equal(heatmap.sample(100, 7), heatmap.sample(100, 8))


def test_obstacles_are_masked(two_walls: GridMap) -> None:
    heatmap = Heatmap(np.ones(two_walls.shape), two_walls)
    np.testing.assert_array_equal(heatmap.values > 0, two_walls.free)
    assert heatmap.values.dtype == np.float32
    with pytest.raises(ValueError, match="read-only"):
        heatmap.values[0, 0] = 0


def test_integer_and_boolean_arrays_are_scaled() -> None:
    grid = GridMap(np.ones((1, 3)))
    np.testing.assert_allclose(
        Heatmap(np.array([[0, 51, 255]], np.uint8), grid).values, [[0, 0.2, 1]]
    )
    for mask in ([[False, True, True]], np.array([[0, 1, 1]], np.uint8), [[0, 1, 1]]):
        np.testing.assert_array_equal(Heatmap(mask, grid).values, [[0, 1, 1]])


@pytest.mark.parametrize(
    ("values", "message"),
    [
        (np.ones((3, 2)), r"has shape \(2, 3\).*\(3, 2\)"),
        (np.array([[0.5, np.nan, 0], [0, 0, 0]]), "1 NaN or infinite"),
        (np.array([[0.5, np.inf, 0], [0, 0, 0]]), "1 NaN or infinite"),
        (np.array([[0.5, -0.25, 0], [0, 0, 0]]), "span -0.25 to 0.5"),
        (np.array([[0.5, 2, 0], [0, 0, 0]]), "span 0 to 2"),
        (np.zeros((2, 3)), "is 0 on all free space"),
        (np.array([[1.0, 0, 0], [0, 0, 0]]), "is 0 on all free space"),
        (np.full((2, 3), "a"), "real numbers"),
        (np.full((2, 3), 1j), "real numbers"),
    ],
)
def test_bad_values(values: np.ndarray, message: str) -> None:
    grid = GridMap([[0, 1, 1], [1, 1, 1]])
    with pytest.raises(HeatmapError, match=message):
        Heatmap(values, grid)


def test_controls_know_the_task(two_walls: GridMap) -> None:
    uniform = Heatmap.uniform(two_walls)
    np.testing.assert_array_equal(uniform.region, two_walls.free)

    line = Heatmap.straight_line(two_walls, START, GOAL)
    assert line.values[125, 125] > 0.9
    assert line.values[40, 200] == 0
    assert not line.connects(START, GOAL)

    corridor = Heatmap.corridor(two_walls, START, GOAL)
    assert corridor.connects(START, GOAL)
    assert corridor.values[66, 203] > 0.5, "through the first gap"
    assert corridor.values[155, 45] > 0.5, "through the second gap"
    assert corridor.values[125, 220] == 0
    assert corridor.region.sum() < 0.25 * two_walls.free.sum()


def test_connected_bridges_a_broken_region(two_walls: GridMap, corridor: Heatmap) -> None:
    values = corridor.values.copy()
    values[60:120] = 0
    values[:20] = 0
    broken = Heatmap(values, two_walls)
    assert not broken.connects(START, GOAL)
    connected = broken.connected(START, GOAL)
    assert connected.connects(START, GOAL)
    assert (connected.values >= broken.values).all()
    added = connected.region & ~broken.region
    assert 0 < added.sum() < 0.1 * two_walls.free.sum()
    assert connected.connected(START, GOAL) is connected
    for heatmap in broken, connected:
        assert np.array_equal(heatmap.support, np.flatnonzero(heatmap.values))
        assert np.array_equal(heatmap.support_values, heatmap.values[heatmap.values > 0])


def test_connected_raises_for_separate_parts() -> None:
    free = np.ones((9, 9), bool)
    free[:, 4] = False
    grid = GridMap(free)
    with pytest.raises(TaskError, match="no path connects"):
        Heatmap.uniform(grid).connected((1, 1), (8, 8))


def test_load(tmp_path: Path, two_walls: GridMap, corridor: Heatmap) -> None:
    np.save(tmp_path / "heat.npy", corridor.values)
    np.testing.assert_array_equal(
        Heatmap.load(tmp_path / "heat.npy", two_walls).values, corridor.values
    )
    cv2.imwrite(str(tmp_path / "heat.png"), np.rint(corridor.values * 255).astype(np.uint8))
    loaded = Heatmap.load(tmp_path / "heat.png", two_walls)
    np.testing.assert_allclose(loaded.values, corridor.values, atol=0.5 / 255 + 1e-6)


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("heat.npy", b"no array"),
        ("heat.npy", b""),
        ("heat.png", b"no image"),
        ("heat.png", b""),
        ("missing.png", None),
    ],
)
def test_load_bad_files(
    tmp_path: Path, two_walls: GridMap, name: str, content: bytes | None
) -> None:
    if content is not None:
        (tmp_path / name).write_bytes(content)
    with pytest.raises(HeatmapError, match=name):
        Heatmap.load(tmp_path / name, two_walls)
