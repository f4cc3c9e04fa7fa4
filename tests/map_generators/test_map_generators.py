"""The map families, and that the bundled maps are what the script draws."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import numpy as np
import pytest

from cbagan_ompl.errors import ConfigError
from cbagan_ompl.map_generators import MAP_GENERATORS, MIN_SIDE, bug_trap, narrow_passage
from cbagan_ompl.map_generators.randomization import randomized_map
from cbagan_ompl.maps.grid_map import GridMap
from cbagan_ompl.maps.loading import bundled_folder, bundled_maps

SCRIPT = Path(__file__).resolve().parents[2] / "scripts" / "make_bundled_maps.py"


@pytest.fixture(scope="module")
def script():
    spec = importlib.util.spec_from_file_location("make_bundled_maps", SCRIPT)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


#: Least and greatest free share of the families whose measures do not follow the side of the map.
SHARES = {
    "blocked_cells": (0.3, 0.97),
    "caves": (0.05, 0.81),
    "cell_maze": (0.4, 0.98),
    "city": (0.15, 0.98),
    "curved_walls": (0.2, 0.99),
    "halls": (0.1, 0.9),
    "offices": (0.4, 0.99),
    "race_track": (0.04, 0.4),
    "room_grid": (0.6, 0.98),
    "shelves": (0.35, 0.99),
}
FOLLOWING = sorted(set(MAP_GENERATORS) - set(SHARES))
SIZES = [(MIN_SIDE, MIN_SIDE), (64, 150), (220, 96)]


def checked(family, seed, width, height):
    """A map that has the right shape, and whose free pixels are all connected."""
    free = MAP_GENERATORS[family](np.random.default_rng(seed), width, height)
    assert free.shape == (height, width)
    assert free.dtype == np.bool_
    assert GridMap(free).components.max() == 1
    return free


def test_every_family_is_tested_for_its_free_share():
    assert set(SHARES) < set(MAP_GENERATORS)
    assert len(FOLLOWING) == 11


@pytest.mark.parametrize("family", SHARES)
@pytest.mark.parametrize(("width", "height"), [*SIZES, (64, 64), (256, 256)])
def test_families_of_every_scale(family, width, height):
    least, most = SHARES[family]
    for seed in range(8):
        assert least < checked(family, seed, width, height).mean() < most


@pytest.mark.parametrize("family", ["offices", "shelves"])
def test_no_map_is_all_free(family):
    # Of so many small maps some would have room for neither walls nor shelves.
    for seed in range(200):
        free = MAP_GENERATORS[family](np.random.default_rng(seed), MIN_SIDE, MIN_SIDE)
        assert 0.35 < free.mean() < 0.995


@pytest.mark.parametrize("family", FOLLOWING)
@pytest.mark.parametrize(("width", "height"), SIZES)
def test_families_at_every_size(family, width, height):
    for seed in range(6):
        free = checked(family, seed, width, height)
        assert 0.4 < free.mean() < 0.95
        # No part of the map has been walled off and filled.
        for part in (*np.array_split(free, 3, axis=0), *np.array_split(free, 3, axis=1)):
            assert part.mean() > 0.25


@pytest.mark.parametrize("family", MAP_GENERATORS)
def test_families_are_random_and_reproducible(family):
    draw = MAP_GENERATORS[family]
    first = draw(np.random.default_rng(1), 96, 96)
    np.testing.assert_array_equal(first, draw(np.random.default_rng(1), 96, 96))
    assert (first != draw(np.random.default_rng(2), 96, 96)).any()


@pytest.mark.parametrize("side", [MIN_SIDE, 64, 100])
def test_world_maps(side):
    seen = set()
    for seed in range(40):
        free = randomized_map(np.random.default_rng(seed), side, tuple(MAP_GENERATORS))
        assert free.shape == (side, side)
        assert free.dtype == np.bool_
        assert 0.12 <= free.mean() < 1
        assert GridMap(free).components.max() == 1
        seen.add(free.tobytes())
        again = randomized_map(np.random.default_rng(seed), side, tuple(MAP_GENERATORS))
        np.testing.assert_array_equal(free, again)
    assert len(seen) == 40


@pytest.mark.parametrize("family", MAP_GENERATORS)
def test_world_maps_of_one_family(family):
    free = randomized_map(np.random.default_rng(0), 64, (family,))
    assert free.shape == (64, 64)


@pytest.mark.parametrize("seed", range(5))
def test_narrow_passage_is_narrow(seed):
    free = narrow_passage(np.random.default_rng(seed), 256, 256)
    gap = free.sum(axis=0).min()
    assert 4 <= gap <= 6
    # With the passage shut the two sides are apart.
    free[:, free.sum(axis=0).argmin()] = False
    assert GridMap(free).components.max() >= 2


@pytest.mark.parametrize("seed", range(5))
def test_bug_trap_is_left_by_its_mouth_only(seed):
    free = bug_trap(np.random.default_rng(seed), 256, 256)
    middle = 128
    outside = np.flatnonzero(free[:, 0])[0]
    assert not free[middle, 150:220].all()  # the body is shut on the right

    def shuts_the_trap(column):
        """Whether a short wall somewhere across the channel parts the middle from the outside."""
        shut = free.copy()
        shut[90:166, column] = False
        labels = GridMap(shut).components
        return labels[middle, 150] not in (0, labels[outside, 0])

    assert any(shuts_the_trap(column) for column in range(50, 110))


@pytest.mark.parametrize("family", MAP_GENERATORS)
def test_families_refuse_small_maps(family):
    with pytest.raises(ConfigError, match=f"from {MIN_SIDE} pixels a side up, got 40 x 100"):
        MAP_GENERATORS[family](np.random.default_rng(0), 40, 100)


def test_bundled_maps_are_what_the_script_draws(script):
    assert set(bundled_maps()) == set(script.TASKS) < set(MAP_GENERATORS)
    for name in bundled_maps():
        np.testing.assert_array_equal(GridMap.load(f"bundled:{name}").free, script.draw(name))
    shipped = (bundled_folder() / "tasks.csv").read_text(encoding="utf-8")
    assert shipped == script.tasks_csv()
