"""Planning again from where the robot is: when the heat map is kept, and what that saves."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
from helpers.tasks import GOAL, START

from cbagan_ompl import (
    CbaganOmplError,
    ConfigError,
    GridMap,
    HeatmapError,
    MapError,
    ModelError,
    PlannerError,
    Replanner,
    Robot,
    SamplerOptions,
    TaskError,
)

OPTIONS: dict[str, Any] = {"sampler": "corridor", "time": 5, "range": 20, "seed": 1}


def with_obstacle(grid: GridMap, row: int, column: int, size: int = 4) -> GridMap:
    free = grid.free.copy()
    free[row : row + size, column : column + size] = False
    return GridMap(free, grid.resolution, grid.origin, name=grid.name)


def test_heatmap_is_kept_while_the_robot_follows_its_path(two_walls: GridMap) -> None:
    replanner = Replanner(two_walls, GOAL, **OPTIONS)
    assert replanner.heatmap is None
    result = replanner.plan(START)
    assert result.solved
    assert not result.heatmap_kept
    first = replanner.heatmap
    assert first is not None
    assert first is result.heatmap
    for _ in range(5):
        # Ahead of the robot, where its path is in the region.
        position = next(p for p in result.trajectory[20:] if first.connects(p, GOAL))
        result = replanner.plan(position)
        np.testing.assert_array_equal(result.start, position)
        assert result.solved
        assert result.heatmap_kept
        assert result.heatmap is first
        assert (result.sampler, result.hook) == ("corridor", "goal-injection")
        assert result.sample_counts["learned"] > 0
    assert json.loads(json.dumps(result.to_dict()))["heatmap_kept"] is True


def test_off_the_region_it_is_made_anew(two_walls: GridMap) -> None:
    replanner = Replanner(two_walls, GOAL, **OPTIONS)
    first = replanner.plan(START).heatmap
    assert first is not None
    off = next(
        point
        for point in two_walls.to_world(np.argwhere(~first.region & two_walls.free)[:, ::-1]) + 0.5
        if point[1] < 50
    )
    result = replanner.plan(off)
    assert result.solved
    assert not result.heatmap_kept
    assert result.heatmap is replanner.heatmap is not first
    assert replanner.plan(off).heatmap_kept


def test_an_obstacle_in_the_region_makes_it_anew_and_elsewhere_not(two_walls: GridMap) -> None:
    replanner = Replanner(two_walls, GOAL, **OPTIONS)
    first = replanner.plan(START).heatmap
    assert first is not None
    rows, columns = np.nonzero(~first.region & two_walls.free)
    elsewhere = with_obstacle(two_walls, rows[-1], columns[-1], 1)
    result = replanner.plan((12, 10), elsewhere)
    assert result.solved
    assert result.heatmap_kept
    assert replanner.grid is elsewhere
    assert result.heatmap is not None
    assert result.heatmap.grid is elsewhere
    in_the_way = with_obstacle(elsewhere, 102, int(np.median(np.nonzero(first.region[105])[0])), 6)
    assert (first.region & ~in_the_way.free).any()
    result = replanner.plan((12, 10), in_the_way)
    assert result.solved
    assert not result.heatmap_kept
    assert in_the_way.path_is_free(result.path)
    assert replanner.plan((14, 10)).heatmap_kept, "the map stays the new one"


def test_inflation_counts_as_obstacle(two_walls: GridMap) -> None:
    """What appears beside the region narrows it for a robot with a radius."""
    replanner = Replanner(two_walls, GOAL, radius=5, **OPTIONS)
    first = replanner.plan(START).heatmap
    assert first is not None
    rows, columns = np.nonzero(first.region)
    row = int(rows[rows < 40].max())
    column = int(columns[rows == row].min())
    beside = with_obstacle(two_walls, row + 2, column, 1)
    assert not (first.region & ~beside.free).any()
    assert not replanner.plan((12, 10), beside).heatmap_kept


@pytest.mark.parametrize(
    "grid",
    [
        GridMap(np.ones((256, 256), bool)[:, :250]),
        GridMap(np.ones((256, 256), bool), 1.0, (0.0, 0.0, 0.0)),
    ],
)
def test_a_map_in_another_frame_is_another_map(two_walls: GridMap, grid: GridMap) -> None:
    replanner = Replanner(two_walls, GOAL, **OPTIONS)
    replanner.plan(START)
    result = replanner.plan(START, grid)
    assert result.solved
    assert not result.heatmap_kept


def test_after_a_failure_it_is_made_anew(two_walls: GridMap) -> None:
    replanner = Replanner(two_walls, GOAL, **{**OPTIONS, "iterations": 5})
    assert not replanner.plan(START).solved
    assert replanner.heatmap is None
    assert not replanner.plan(START).heatmap_kept


def test_uniform_has_nothing_to_keep(two_walls: GridMap) -> None:
    replanner = Replanner(two_walls, GOAL, **{**OPTIONS, "sampler": "uniform"})
    for _ in range(2):
        result = replanner.plan(START)
        assert result.solved
        assert (result.sampler, result.hook, result.heatmap_kept) == ("uniform", None, False)


def test_seeds_count_up_and_repeat(two_walls: GridMap) -> None:
    runs = [
        [(result := replanner.plan(START)).seed, result.path.tolist()]
        for replanner in (Replanner(two_walls, GOAL, **OPTIONS) for _ in range(2))
        for _ in range(2)
    ]
    assert [seed for seed, _ in runs] == [1, 2, 1, 2]
    assert runs[:2] == runs[2:]
    assert runs[0][1] != runs[1][1]
    options = {**OPTIONS, "options": SamplerOptions(seed=7)}
    del options["seed"]
    assert Replanner(two_walls, GOAL, **options).plan(START).seed == 7


@pytest.mark.slow
def test_learned(two_walls: GridMap) -> None:
    pytest.importorskip("torch")
    replanner = Replanner(two_walls, GOAL, planner="RRT*", radius=2, time=0.3, range=20, seed=1)
    first = replanner.plan(START)
    assert first.solved
    assert (first.sampler, first.planner) == ("learned", "RRTstar")
    assert first.heatmap is not None
    second = replanner.plan(
        next(p for p in first.trajectory[9:] if first.heatmap.connects(p, GOAL))
    )
    assert second.solved
    assert second.heatmap_kept
    assert second.sampler == "learned"
    assert second.heatmap is first.heatmap


def test_robots_with_heading_have_poses(two_walls: GridMap) -> None:
    options = {**OPTIONS, "robot": Robot.rectangle(8, 4), "range": 40}
    replanner = Replanner(two_walls, (*GOAL, 0.0), **options)
    first = replanner.plan((*START, 0.0))
    assert first.solved
    assert first.path.shape[1] == 3
    assert first.heatmap is not None
    for pose in first.trajectory[20:]:
        if first.heatmap.connects(pose[:2], GOAL):
            break
    second = replanner.plan(pose)
    assert second.solved
    assert second.heatmap_kept
    with pytest.raises(TaskError, match="start"):
        replanner.plan(START)


@pytest.mark.parametrize("start", ["here", (1, 2, 3, 4), ((1, 2), (3,)), None])
def test_what_is_no_start(two_walls: GridMap, start: Any) -> None:
    replanner = Replanner(two_walls, GOAL, **OPTIONS)
    replanner.plan(START)
    with pytest.raises(TaskError, match="start"):
        replanner.plan(start)


@pytest.mark.parametrize(
    ("changes", "kind", "message"),
    [
        ({"grid": "bundled:maze"}, MapError, "a Replanner takes a GridMap, got 'bundled:maze'"),
        ({"sampler": "magic"}, ConfigError, "no sampler 'magic'"),
        ({"seed": -1}, ConfigError, "seed"),
        ({"model": "x.pt"}, ConfigError, "the corridor sampler uses no model"),
        ({"sampler": "learned", "model": 3}, ModelError, "model is a loaded model or the file"),
        ({"sampler": "learned", "model": "missing.pt"}, ModelError, "missing.pt"),
    ],
)
def test_misuse(
    two_walls: GridMap, changes: dict[str, Any], kind: type[CbaganOmplError], message: str
) -> None:
    with pytest.raises(kind, match=message):
        Replanner(**({"grid": two_walls, "goal": GOAL, **OPTIONS} | changes))


@pytest.mark.parametrize(
    ("changes", "kind", "message"),
    [
        ({"planner": "Magic"}, PlannerError, "no planner 'Magic'"),
        ({"heatmap": np.ones((3, 3))}, (ConfigError, HeatmapError), "heat map"),
        ({"magic": 1}, ConfigError, "unknown sampler option 'magic'"),
        ({"goal": (300, 300)}, TaskError, "goal"),
    ],
)
def test_misuse_of_what_plan_takes(
    two_walls: GridMap, changes: dict[str, Any], kind: type[CbaganOmplError], message: str
) -> None:
    with pytest.raises(kind, match=message):
        Replanner(**({"grid": two_walls, "goal": GOAL, **OPTIONS} | changes)).plan(START)


def test_map_of_a_plan_must_be_one(two_walls: GridMap) -> None:
    with pytest.raises(MapError, match="a Replanner takes a GridMap"):
        Replanner(two_walls, GOAL, **OPTIONS).plan(START, np.ones((3, 3)))  # type: ignore[arg-type]
