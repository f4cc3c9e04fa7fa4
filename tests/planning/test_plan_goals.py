"""Plans with several goals."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.setups import small_walls

from cbagan_ompl import ConfigError, Heatmap, Robot, TaskError, plan
from cbagan_ompl.cli import main

GRID = small_walls()
START, NEAR, FAR = (5.5, 5.5), (58.5, 5.5), (58.5, 58.5)


def run(goal: Any, planner: str = "RRTstar", **options: Any) -> Any:
    return plan(
        GRID,
        START,
        goal,
        planner,
        **({"sampler": "corridor", "iterations": 800, "seed": 1} | options),
    )


@pytest.mark.parametrize("planner", ["RRTstar", "RRT", "InformedRRTstar", "SORRTstar"])
@pytest.mark.parametrize("sampler", ["corridor", "uniform"])
def test_the_path_ends_in_one_of_the_goals(planner: str, sampler: str) -> None:
    result = run([FAR, NEAR], planner, sampler=sampler, time=5.0)
    assert result.solved
    assert result.goal.tolist() in ([*FAR], [*NEAR])
    assert np.hypot(*(result.path[-1] - result.goal)) <= result.goal_tolerance
    assert result.path[0].tolist() == [*START]


def test_planners_that_go_on_end_in_the_nearer_goal() -> None:
    for goals in ([FAR, NEAR], np.array([NEAR, FAR])):
        result = run(goals)
        assert result.goal.tolist() == [*NEAR]
        assert result.cost == pytest.approx(53, rel=0.05)


def test_the_heat_map_is_the_largest_of_those_of_each_goal() -> None:
    result = run([FAR, NEAR])
    single = [Heatmap.corridor(GRID, START, goal).values for goal in (FAR, NEAR)]
    np.testing.assert_array_equal(result.heatmap.values, np.maximum(*single))
    alone = run([NEAR])
    np.testing.assert_array_equal(alone.heatmap.values, single[1])
    np.testing.assert_array_equal(alone.path, run(NEAR).path)


def test_poses_as_goals() -> None:
    goals = [(58.5, 58.5, 0.0), (58.5, 8.5, 1.5)]
    result = plan(
        GRID,
        (*START, 0.0),
        goals,
        "RRT",
        "corridor",
        robot=Robot.rectangle(4, 2),
        time=20.0,
        seed=1,
    )
    assert result.solved
    assert result.goal.tolist() in [list(goal) for goal in goals]
    assert result.path.shape[1] == 3


def test_goals_that_no_path_reaches_are_named() -> None:
    with pytest.raises(TaskError, match=r"goal \(30, 22\)"):
        run([NEAR, (30.0, 22.0)])
    with pytest.raises(TaskError, match="goal"):
        run([NEAR, (1.0,)])
    with pytest.raises(TaskError, match="goal"):
        run([])
    with pytest.raises(ConfigError, match="one goal"):
        run([NEAR, FAR], snap=3.0)


def test_goals_of_the_command_line(tmp_path: Path) -> None:
    out = tmp_path / "plan.json"
    goals = ["--goal", "240,240", "--goal", "60,30"]
    options = ["--sampler", "uniform", "--iterations", "2000", "--seed", "1", "--json", str(out)]
    assert main(["plan", "bundled:rooms", "--start", "30,30", *goals, *options]) == 0
    assert json.loads(out.read_text())["goal"] == [60.0, 30.0]
