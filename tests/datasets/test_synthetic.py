from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from helpers.training_set import equal_tasks

from cbagan_ompl import ConfigError
from cbagan_ompl.datasets.geodesic import distance_field
from cbagan_ompl.datasets.synthetic import (
    HARD_DETOUR,
    TASKS_PER_MAP,
    SyntheticSettings,
    generate_map_tasks,
)
from cbagan_ompl.maps.connectivity import connects
from cbagan_ompl.maps.grid_map import GridMap
from cbagan_ompl.sampling.heatmap import REGION_THRESHOLD

SMALL = SyntheticSettings(size=64, seed=3)


def test_tasks_depend_on_seed_part_and_number_alone() -> None:
    tasks = generate_map_tasks(SMALL, 0, 5)
    assert equal_tasks(tasks, generate_map_tasks(SMALL, 0, 5))
    others = [(SMALL, 1, 5), (SMALL, 0, 6), (replace(SMALL, seed=4), 0, 5)]
    for settings, part, number in others:
        assert not np.array_equal(tasks.maps, generate_map_tasks(settings, part, number).maps)


@pytest.mark.parametrize("number", range(6))
def test_tasks_can_be_solved(number: int) -> None:
    tasks = generate_map_tasks(SMALL, 0, number)
    assert len(tasks) == TASKS_PER_MAP
    assert tasks.maps.shape == (1, 64, 64)
    assert tasks.region.shape == (TASKS_PER_MAP, 64, 64)
    assert tasks.region.dtype == np.float16
    free = tasks.maps[0].astype(bool)
    grid = GridMap(free)
    for start, goal, label in zip(tasks.start, tasks.goal, tasks.region, strict=True):
        endpoints = [tuple(point.astype(int).tolist()) for point in (start, goal)]
        assert all(free[v, u] for u, v in endpoints)
        grid.check_task(start, goal)
        assert np.hypot(*(start - goal)) >= 0.2 * 64
        assert connects(label >= REGION_THRESHOLD, *endpoints, connectivity=8)
        assert (label[~free] == 0).all()


def test_maps_of_the_smallest_size() -> None:
    for number in range(8):
        assert generate_map_tasks(SyntheticSettings(size=48), 0, number).size == 48


def hard_fraction(settings: SyntheticSettings, maps: int) -> float:
    fractions = []
    for number in range(maps):
        tasks = generate_map_tasks(settings, 0, number)
        for start, goal in zip(tasks.start.astype(int), tasks.goal.astype(int), strict=True):
            field = distance_field(tasks.maps[0].astype(bool), (start[0], start[1]))
            straight = np.hypot(*(start - goal))
            fractions.append(field[goal[1], goal[0]] >= HARD_DETOUR * straight)
    return float(np.mean(fractions))


def test_as_many_tasks_are_hard_as_were_asked_for() -> None:
    mazes = SyntheticSettings(size=64, generators=("cell_maze",))
    fractions = [
        hard_fraction(replace(mazes, hard_fraction=fraction), 40) for fraction in (0.2, 0.65, 1.0)
    ]
    assert fractions[1] == pytest.approx(0.65, abs=0.1)
    # Some of the mazes have too few tasks of a kind.
    assert fractions[0] < 0.45
    assert fractions[2] > 0.75


@pytest.mark.parametrize(
    ("option", "value", "message"),
    [
        ("size", 40, "size must be at least 48, got 40"),
        ("generators", ("blocks", "castles"), "'castles'; there are blocked_cells, blocks"),
        ("generators", (), "there are"),
        ("hard_fraction", 1.5, "hard_fraction is a fraction from 0 to 1, got 1.5"),
        ("seed", -1, "seed must be at least 0"),
    ],
)
def test_settings_that_make_no_sense(option: str, value: Any, message: str) -> None:
    with pytest.raises(ConfigError, match=message):
        replace(SMALL, **{option: value})
