"""Exact paths of rectangles that turn, the truth of the study of footprints."""

from __future__ import annotations

import importlib
from collections.abc import Iterator
from math import pi
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cbagan_ompl import GridMap, Robot, TaskError
from cbagan_ompl.robots.shape_checker import ShapeChecker

STUDIES = Path(__file__).resolve().parents[2] / "benchmarks" / "studies"
SLENDER = Robot.rectangle(14, 3.5)


@pytest.fixture(scope="module")
def lattices() -> Iterator[Any]:
    # Imported by its name, under which numba keeps what it compiles.
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(STUDIES))
        yield importlib.import_module("pose_lattice")


def corridor(width: int) -> GridMap:
    """Return two halls with a horizontal corridor between them."""
    free = np.zeros((60, 140), bool)
    free[2:58, 2:40] = free[2:58, 100:138] = True
    free[30 : 30 + width, 40:100] = True
    return GridMap(free)


def test_poses_are_free_where_the_exact_checker_says_so(lattices: Any) -> None:
    rng = np.random.default_rng(0)
    grid = GridMap(rng.random((40, 60)) > 0.01)
    lattice, checker = lattices.make_lattice(grid, SLENDER), ShapeChecker(grid, SLENDER)
    for _ in range(2000):
        k, row, column = (int(rng.integers(n)) for n in lattice.free.shape)
        pose = column + 0.5, row + 0.5, k * pi / lattices.HEADINGS
        assert lattice.free[k, row, column] == checker.pose_is_free(*pose)
    assert 0.1 < lattice.free.mean() < 0.9
    # It turns where it is free at both ends and between.
    ends = lattice.free & np.roll(lattice.free, -1, axis=0)
    assert (lattice.turns <= ends).all()
    assert lattice.turns.sum() < ends.sum()


def test_empty_map_gives_an_ellipse(lattices: Any) -> None:
    lattice = lattices.make_lattice(GridMap(np.ones((100, 160), bool)), SLENDER)
    start, goal = (30, 40), (130, 60)
    both = lattice.costs_from(start) + lattice.costs_from(goal)
    shortest = np.hypot(100, 20)
    assert lattice.cost_between(start, goal) == pytest.approx(shortest, rel=0.01)
    rows, columns = np.ogrid[:100, :160]
    lengths = sum(np.hypot(columns - u, rows - v) for u, v in (start, goal))
    ellipse = lengths <= 1.05 * shortest + 1
    region = both.min(axis=0) <= 1.05 * shortest + 1
    assert (region & ellipse).sum() / (region | ellipse).sum() > 0.93


def test_slender_rectangle_passes_a_corridor_lengthwise(lattices: Any) -> None:
    grid, start, goal = corridor(6), (20, 10), (120, 50)
    lattice = lattices.make_lattice(grid, SLENDER)
    assert lattice.cost_between(start, goal) == pytest.approx(
        np.hypot(20, 23) + 60 + np.hypot(20, 17), rel=0.05
    )
    # A seventh of a turn at most, where all 16 headings are free in the halls.
    headings = np.flatnonzero(lattice.free[:, :, 70].any(axis=1))
    assert set(headings) <= {0, 1, 2, 14, 15}
    assert lattice.free[:, 20, 20].all()
    # The disc around it, and a wider rectangle, do not pass.
    with pytest.raises(TaskError):
        grid.inflated(SLENDER.circumscribed_radius).check_task(start, goal)
    assert lattices.make_lattice(grid, Robot.rectangle(7, 7)).cost_between(start, goal) == np.inf


def test_corner_is_too_narrow_for_a_slender_rectangle(lattices: Any) -> None:
    free = np.zeros((80, 80), bool)
    free[10:16, 5:70] = free[10:75, 64:70] = True
    grid, start, goal = GridMap(free), (14, 13), (67, 60)
    disc = grid.inflated(SLENDER.inscribed_radius)
    disc.check_task(start, goal)
    assert lattices.make_lattice(grid, SLENDER).cost_between(start, goal) == np.inf
    short = lattices.make_lattice(grid, Robot.rectangle(4, 3.5))
    assert short.cost_between(start, goal) == pytest.approx(53 + 47, rel=0.1)


def test_paths_keep_to_a_region_and_pay_for_turns(lattices: Any) -> None:
    grid = GridMap(np.ones((80, 80), bool))
    lattice = lattices.make_lattice(grid, SLENDER)
    start, goal = (20, 40), (60, 40)
    around = np.ones(grid.shape, bool)
    around[20:, 38:42] = False
    detour = 2 * np.hypot(18, 21) + 4
    assert lattice.cost_between(start, goal, around) == pytest.approx(detour, rel=0.04)
    split = around.copy()
    split[:, 38:42] = False
    assert lattice.cost_between(start, goal, split) == np.inf
    # Any heading is there at the source, so that nothing is paid for; but for what is taken away.
    assert (lattice.costs_from(start)[:, 40, 20] == 0).all()
    lattice.free[1:, 40, 20] = False
    costs = lattice.costs_from(start)[:, 40, 30]
    assert costs[8] - costs[0] == pytest.approx(8 * lattices.TURN_COST, abs=1e-4)


def test_finer_lattice_gets_through_where_centres_of_pixels_do_not(lattices: Any) -> None:
    start, goal, robot = (20, 10), (120, 50), Robot.rectangle(14, 3.4)
    # The middle of four pixels is between two of them.
    assert lattices.make_lattice(corridor(4), robot).cost_between(start, goal) == np.inf
    wide = lattices.make_lattice(corridor(5), robot).cost_between(start, goal)
    assert lattices.refined_cost(corridor(4), robot, start, goal) == pytest.approx(wide, rel=0.02)
    assert lattices.refined_cost(corridor(3), robot, start, goal) == np.inf
