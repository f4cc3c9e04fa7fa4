"""The map families, and that the bundled maps are what the script draws."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import numpy as np
import pytest

from cbagan_ompl.errors import ConfigError
from cbagan_ompl.gridmap import GridMap
from cbagan_ompl.map_families import FAMILIES, MIN_SIDE, bug_trap, narrow_passage
from cbagan_ompl.mapfiles import bundled_folder, bundled_maps

SCRIPT = Path(__file__).resolve().parents[1] / "benchmarks" / "make_bundled_maps.py"


@pytest.fixture(scope="module")
def script():
    spec = importlib.util.spec_from_file_location("make_bundled_maps", SCRIPT)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("family", FAMILIES)
@pytest.mark.parametrize(("width", "height"), [(MIN_SIDE, MIN_SIDE), (64, 150), (220, 96)])
def test_families_at_every_size(family, width, height):
    for seed in range(6):
        free = FAMILIES[family](np.random.default_rng(seed), width, height)
        assert free.shape == (height, width)
        assert free.dtype == np.bool_
        assert 0.4 < free.mean() < 0.95
        assert GridMap(free).components.max() == 1  # all that is free is connected
        # No part of the map has been walled off and filled.
        for part in (*np.array_split(free, 3, axis=0), *np.array_split(free, 3, axis=1)):
            assert part.mean() > 0.25


@pytest.mark.parametrize("family", FAMILIES)
def test_families_are_random_and_reproducible(family):
    draw = FAMILIES[family]
    first = draw(np.random.default_rng(1), 96, 96)
    np.testing.assert_array_equal(first, draw(np.random.default_rng(1), 96, 96))
    assert (first != draw(np.random.default_rng(2), 96, 96)).any()


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


@pytest.mark.parametrize("family", FAMILIES)
def test_families_refuse_small_maps(family):
    with pytest.raises(ConfigError, match=f"from {MIN_SIDE} pixels a side up, got 40 x 100"):
        FAMILIES[family](np.random.default_rng(0), 40, 100)


def test_bundled_maps_are_what_the_script_draws(script):
    assert set(bundled_maps()) == set(script.TASKS) < set(FAMILIES)
    for name in bundled_maps():
        np.testing.assert_array_equal(GridMap.load(f"bundled:{name}").free, script.draw(name))
    shipped = (bundled_folder() / "tasks.csv").read_text(encoding="utf-8")
    assert shipped == script.tasks_csv()
