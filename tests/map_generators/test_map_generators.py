"""The map generators, and that the bundled maps are what the script generates."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import cv2
import numpy as np
import pytest

from cbagan_ompl.errors import ConfigError
from cbagan_ompl.map_generators import MAP_GENERATORS, MIN_SIZE, bug_trap, narrow_passage
from cbagan_ompl.map_generators.randomization import randomized_map
from cbagan_ompl.map_generators.shapes import inflate
from cbagan_ompl.maps.grid_map import GridMap
from cbagan_ompl.maps.loading import bundled_folder, bundled_maps

SCRIPT = Path(__file__).resolve().parents[2] / "scripts" / "make_bundled_maps.py"


@pytest.fixture(scope="module")
def script():
    spec = importlib.util.spec_from_file_location("make_bundled_maps", SCRIPT)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


#: Least and greatest free fraction of generators whose dimensions do not follow the map's size.
FREE_FRACTIONS = {
    "blocked_cells": (0.3, 0.97),
    "caves": (0.05, 0.81),
    "cell_maze": (0.4, 0.98),
    "city": (0.15, 0.98),
    "curved_walls": (0.2, 0.99),
    "fine_maze": (0.02, 0.92),
    "halls": (0.1, 0.9),
    "offices": (0.4, 0.99),
    "race_track": (0.04, 0.4),
    "random_pixels": (0.1, 0.8),
    "reduced_map": (0.02, 0.9),
    "room_grid": (0.6, 0.98),
    "scanned_map": (0.02, 0.99),
    "shelves": (0.35, 0.99),
    "slanted_walls": (0.05, 0.99),
}
FOLLOWING = sorted(set(MAP_GENERATORS) - set(FREE_FRACTIONS))
SIZES = [(MIN_SIZE, MIN_SIZE), (64, 150), (220, 96)]


def generate_checked(generator, seed, width, height):
    """Return a map, after a check of its shape and that its free pixels are connected."""
    free = MAP_GENERATORS[generator](np.random.default_rng(seed), width, height)
    assert free.shape == (height, width)
    assert free.dtype == np.bool_
    assert GridMap(free).components.max() == 1
    return free


def test_every_generator_is_tested_for_its_free_fraction():
    assert set(FREE_FRACTIONS) < set(MAP_GENERATORS)
    assert len(FOLLOWING) == 11


@pytest.mark.parametrize("generator", FREE_FRACTIONS)
@pytest.mark.parametrize(("width", "height"), [*SIZES, (64, 64), (256, 256)])
def test_generators_of_every_scale(generator, width, height):
    least, most = FREE_FRACTIONS[generator]
    for seed in range(8):
        assert least < generate_checked(generator, seed, width, height).mean() < most


@pytest.mark.parametrize("generator", ["offices", "shelves"])
def test_no_map_is_all_free(generator):
    # Of so many small maps some have room for neither walls nor shelves.
    for seed in range(200):
        free = MAP_GENERATORS[generator](np.random.default_rng(seed), MIN_SIZE, MIN_SIZE)
        assert 0.35 < free.mean() < 0.995


@pytest.mark.parametrize("generator", FOLLOWING)
@pytest.mark.parametrize(("width", "height"), SIZES)
def test_generators_at_every_size(generator, width, height):
    for seed in range(6):
        free = generate_checked(generator, seed, width, height)
        assert 0.4 < free.mean() < 0.95
        # No part of the map has been walled off and filled.
        for part in (*np.array_split(free, 3, axis=0), *np.array_split(free, 3, axis=1)):
            assert part.mean() > 0.25


@pytest.mark.parametrize("generator", MAP_GENERATORS)
def test_generators_are_random_and_reproducible(generator):
    generate = MAP_GENERATORS[generator]
    first = generate(np.random.default_rng(1), 96, 96)
    np.testing.assert_array_equal(first, generate(np.random.default_rng(1), 96, 96))
    assert (first != generate(np.random.default_rng(2), 96, 96)).any()


@pytest.mark.parametrize("size", [MIN_SIZE, 64, 100])
def test_randomized_maps(size):
    seen = set()
    for seed in range(40):
        free = randomized_map(np.random.default_rng(seed), size, tuple(MAP_GENERATORS))
        assert free.shape == (size, size)
        assert free.dtype == np.bool_
        assert 0.12 <= free.mean() < 1
        assert GridMap(free).components.max() == 1
        seen.add(free.tobytes())
        again = randomized_map(np.random.default_rng(seed), size, tuple(MAP_GENERATORS))
        np.testing.assert_array_equal(free, again)
    assert len(seen) == 40


@pytest.mark.parametrize("generator", MAP_GENERATORS)
def test_randomized_maps_of_one_generator(generator):
    free = randomized_map(np.random.default_rng(0), 64, (generator,))
    assert free.shape == (64, 64)


@pytest.mark.parametrize("seed", range(5))
def test_narrow_passage_is_narrow(seed):
    free = narrow_passage(np.random.default_rng(seed), 256, 256)
    gap = free.sum(axis=0).min()
    assert 4 <= gap <= 6
    # With the passage closed the two sides are apart.
    free[:, free.sum(axis=0).argmin()] = False
    assert GridMap(free).components.max() >= 2


@pytest.mark.parametrize("seed", range(5))
def test_bug_trap_has_no_exit_but_its_mouth(seed):
    free = bug_trap(np.random.default_rng(seed), 256, 256)
    middle = 128
    outside = np.flatnonzero(free[:, 0])[0]
    assert not free[middle, 150:220].all()  # the body is closed on the right

    def closes_the_trap(column):
        """Return whether a short wall across the channel separates the middle from the outside."""
        closed = free.copy()
        closed[90:166, column] = False
        labels = GridMap(closed).components
        return labels[middle, 150] not in (0, labels[outside, 0])

    assert any(closes_the_trap(column) for column in range(50, 110))


@pytest.mark.parametrize("generator", MAP_GENERATORS)
def test_generators_raise_for_small_maps(generator):
    with pytest.raises(ConfigError, match=f"from {MIN_SIZE} pixels a side up, got 40 x 100"):
        MAP_GENERATORS[generator](np.random.default_rng(0), 40, 100)


def test_bundled_maps_are_what_the_script_generates(script):
    assert set(bundled_maps()) == set(script.TASKS) <= {*MAP_GENERATORS, "parking"}
    for name in bundled_maps():
        np.testing.assert_array_equal(GridMap.load(f"bundled:{name}").free, script.draw(name))
    shipped = (bundled_folder() / "tasks.csv").read_text(encoding="utf-8")
    assert shipped == script.tasks_csv()
    poses = (bundled_folder() / "car_tasks.csv").read_text(encoding="utf-8")
    assert poses == script.car_tasks_csv()


def test_passages_of_fine_mazes_have_a_pixel_or_few():
    for seed in range(10):
        free = MAP_GENERATORS["fine_maze"](np.random.default_rng(seed), 96, 64)
        # No square of 5 pixels is free, but passages lead across most of the map.
        assert not cv2.erode(free.astype(np.uint8), np.ones((5, 5), np.uint8)).any()
        rows, columns = np.nonzero(free)
        assert np.ptp(rows) > 10
        assert np.ptp(columns) > 10


def test_inflated_maps_keep_their_distance_and_lose_their_pockets():
    free = np.ones((40, 60), np.bool_)
    free[:, 30] = False
    free[10:13, 30] = True
    inflated = inflate(free, 2.5)
    # The door is closed, and one of both rooms is left.
    assert inflated.sum() in (27 * 40, 28 * 40, 28 * 40 + 1, 27 * 40 + 1)
    assert not inflated[:, 29:32].any()
    assert inflate(free, 1.0)[11, 30]
