"""Robots with heading, from the map to the checked path."""

from __future__ import annotations

import json
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from cbagan_ompl import (
    CbaganOmplError,
    GridMap,
    Heatmap,
    MapError,
    Replanner,
    Robot,
    RobotError,
    TaskError,
    plan,
    tasks_of,
)
from cbagan_ompl.planning.plan_result import PlanResult
from cbagan_ompl.robots.shape_checker import ShapeChecker

START, GOAL = (20.0, 20.0, 0.0), (230.0, 230.0, np.pi / 2)
ROBOTS = {
    "SE(2)": Robot.rectangle(12, 6),
    "Dubins": Robot.rectangle(8, 4, turning_radius=6),
    "Reeds-Shepp": Robot.rectangle(8, 4, turning_radius=6, reverse=True),
    "point on Dubins curves": Robot.point(turning_radius=5),
    "disc on Reeds-Shepp curves": Robot.disc(3, turning_radius=5, reverse=True),
    "concave": Robot.polygon([(-5, -3), (5, -3), (5, 3), (2, 3), (2, 0), (-5, 0)]),
}


def check(result: PlanResult, grid: GridMap, robot: Robot) -> None:
    """Check a solved plan anew, pose by pose."""
    assert result.solved, result.status
    assert result.path.shape[1] == result.trajectory.shape[1] == 3
    np.testing.assert_allclose(result.path[0], result.start)
    np.testing.assert_array_equal(result.trajectory[[0, -1]], result.path[[0, -1]])
    checker = ShapeChecker.of(grid, robot)
    assert all(checker.pose_is_free(*pose) for pose in result.trajectory.tolist())
    half = grid.resolution / 2 + 1e-9
    moves = np.diff(result.trajectory, axis=0)
    turns = np.abs((moves[:, 2] + np.pi) % (2 * np.pi) - np.pi)
    assert np.hypot(*moves[:, :2].T).max() <= half
    assert (robot.circumscribed_radius * turns).max() <= 2 * half
    off = np.hypot(*(result.path[-1] - result.goal)[:2])
    assert off <= result.goal_tolerance + 1e-9
    assert result.cost >= np.hypot(*(result.goal - result.start)[:2]) - result.goal_tolerance


@pytest.mark.parametrize("name", ROBOTS)
@pytest.mark.parametrize("sampler", ["uniform", "corridor"])
def test_paths_can_be_driven(open_space: GridMap, name: str, sampler: str) -> None:
    robot = ROBOTS[name]
    result = plan(
        open_space, START, GOAL, "RRT", sampler, robot=robot, time=30, range=40, seed=1,
        goal_tolerance=8,
    )  # fmt: skip
    check(result, open_space, robot)
    if robot.turning_radius is not None:
        moves = np.diff(result.trajectory, axis=0)
        turns = np.abs((moves[:, 2] + np.pi) % (2 * np.pi) - np.pi)
        curvature = turns / np.maximum(np.hypot(*moves[:, :2].T), 1e-9)
        # The chord is a little shorter than the curve; where a robot reverses, much shorter.
        too_tight = curvature > 1.01 / robot.turning_radius
        assert too_tight.mean() < (0.03 if robot.reverse else 1e-9)
    if robot.motion == "dubins":
        ahead = [
            (b[0] - a[0]) * np.cos(a[2]) + (b[1] - a[1]) * np.sin(a[2])
            for a, b in pairwise(result.trajectory)
        ]
        assert min(ahead) > -1e-6, "it drives forwards only"


@pytest.fixture
def open_space() -> GridMap:
    free = np.ones((256, 256), bool)
    free[100:110, :150] = False
    return GridMap(free, name="open space")


def test_a_car_parks() -> None:
    grid = GridMap.load("bundled:parking")
    robot = ROBOTS["Reeds-Shepp"]
    task = tasks_of("bundled:parking", grid, with_yaw=True)[3]
    result = plan(
        grid, task.start, task.goal, "RRT", "corridor", robot=robot, time=30, range=30, seed=0
    )
    check(result, grid, robot)
    values = json.loads(json.dumps(result.to_dict()))
    assert values["robot"]["turning_radius"] == 6
    assert len(values["goal"]) == len(values["path"][0]) == 3


def test_every_bundled_map_has_tasks_for_a_car() -> None:
    from cbagan_ompl import bundled_maps

    for name in bundled_maps():
        grid = GridMap.load(f"bundled:{name}")
        checker = ShapeChecker.of(grid, ROBOTS["Reeds-Shepp"])
        tasks = tasks_of(f"bundled:{name}", grid, with_yaw=True)
        assert len(tasks) == 4
        assert all(
            checker.pose_is_free(*task.start) and checker.pose_is_free(*task.goal) for task in tasks
        )


def test_the_same_seed_gives_the_same_path(open_space: GridMap) -> None:
    paths = [
        plan(
            open_space, START, GOAL, "RRTstar", "corridor", robot=ROBOTS["SE(2)"], time=60,
            iterations=300, range=40, goal_tolerance=5, seed=seed,
        ).trajectory
        for seed in (3, 3, 4)
    ]  # fmt: skip
    np.testing.assert_array_equal(paths[0], paths[1])
    assert not np.array_equal(paths[0], paths[2])


def test_metric_maps() -> None:
    free = np.ones((120, 160), bool)
    free[50:60, :100] = False
    grid = GridMap(free, 0.05, (-2.0, 3.0, 0.4))
    robot = Robot.rectangle(0.5, 0.3, turning_radius=0.4, reverse=True)
    start, goal = (
        (*grid.to_world(pixel).tolist(), yaw) for pixel, yaw in (((20, 20), 0.4), ((20, 100), -2.0))
    )
    result = plan(grid, start, goal, "RRT", "corridor", robot=robot, time=20, range=2.0, seed=0)
    check(result, grid, robot)


BAD: list[tuple[dict[str, Any], type[CbaganOmplError], str]] = [
    ({"start": (20, 20)}, TaskError, "start .* has no yaw"),
    ({"goal": (1, 2, 3, 4)}, TaskError, "three finite numbers"),
    ({"goal": (1, 2, np.nan)}, TaskError, "three finite numbers"),
    ({"goal": "there"}, TaskError, "three finite numbers"),
    ({"start": GOAL}, TaskError, "same pose"),
    ({"start": (-5, 20, 0)}, TaskError, "outside"),
    ({"start": (2, 20, 0)}, TaskError, "beyond the border"),
    ({"start": (50, 94, np.pi / 2)}, TaskError, "robot's front touches an obstacle"),
    ({"start": (50, 94, -np.pi / 2)}, TaskError, "robot's rear touches an obstacle"),
    ({"robot": "car"}, RobotError, "robot is a Robot"),
    ({"radius": 3}, RobotError, "robot or radius"),
    ({"robot": Robot.rectangle(400, 6)}, RobotError, "larger than open space"),
    ({"robot": Robot.point()}, TaskError, "has no heading"),
    ({"radius": -1}, MapError, "radius"),
]


def test_a_pose_in_unknown_space_is_told_from_one_in_an_obstacle() -> None:
    free = np.ones((60, 60), bool)
    free[30:, 30:] = False
    robot = Robot.rectangle(8, 4)
    for unknown, message in ((~free, "touches unknown space"), (None, "touches an obstacle")):
        grid = GridMap(free, unknown=unknown)
        with pytest.raises(TaskError, match=rf"{message}, .* the nearest one with snap"):
            plan(grid, (40, 40, 0), (10, 10, 0), sampler="uniform", robot=robot)


@pytest.mark.parametrize(("changes", "kind", "message"), BAD)
def test_bad_input(
    open_space: GridMap, changes: dict[str, Any], kind: type[CbaganOmplError], message: str
) -> None:
    arguments = {"start": START, "goal": GOAL, "robot": ROBOTS["SE(2)"], "sampler": "uniform"}
    with pytest.raises(kind, match=message):
        plan(open_space, **(arguments | changes))


def test_heat_maps_of_a_robot(open_space: GridMap) -> None:
    pytest.importorskip("torch")
    from cbagan_ompl import load_model

    robot = ROBOTS["SE(2)"]
    model = load_model()
    for heatmap in (
        model.predict(open_space, START, GOAL, robot=robot),
        Heatmap.corridor(open_space, START, GOAL, robot),
        *model.predict_many(open_space, [START], [GOAL[:2]], robot=robot),
    ):
        assert heatmap.grid.free.sum() < open_space.free.sum()
        assert heatmap.connects(START[:2], GOAL[:2])
    for call in (model.predict, Heatmap.corridor):
        with pytest.raises(RobotError, match="expected a Robot"):
            call(open_space, START, GOAL, robot="car")  # type: ignore[arg-type]
        with pytest.raises(TaskError):
            call(open_space, START, GOAL)


def test_gaps_too_narrow_for_any_heading_are_told_at_once(open_space: GridMap) -> None:
    free = np.array(open_space.free)
    free[100:110] = False
    free[:, 200:203] = True
    with pytest.raises(TaskError, match="too narrow for the robot"):
        plan(GridMap(free), START, GOAL, sampler="uniform", robot=Robot.rectangle(14, 12), time=60)


@pytest.mark.parametrize("width", [4.0, 6.6])
def test_a_gap_of_nearly_the_robots_width_stays_open(width: float) -> None:
    """The map that heat maps lie on must not close a gap that the robot fits through."""
    free = np.ones((80, 80), bool)
    free[40:42] = False
    free[:, 37:44] = True  # 7 pixels
    grid, robot = GridMap(free), Robot.rectangle(10, width)
    checker = ShapeChecker.of(grid, robot)
    assert checker.straight_is_free(40.5, 20, np.pi / 2, 40.5, 62, np.pi / 2)
    ends = (40.5, 20, np.pi / 2), (40.5, 62, np.pi / 2)
    result = plan(grid, *ends, "RRT", "corridor", robot=robot, time=20, range=50, seed=0)
    if width < 6:
        check(result, grid, robot)
    assert result.heatmap is not None
    assert result.heatmap.connects(ends[0][:2], ends[1][:2])


def test_snap_moves_a_pose_to_where_it_fits(open_space: GridMap) -> None:
    robot = ROBOTS["SE(2)"]
    result = plan(
        open_space, (50, 94, np.pi / 2), GOAL, "RRT", "corridor", robot=robot, time=20, range=40,
        snap=8, seed=0, goal_tolerance=3,
    )  # fmt: skip
    check(result, open_space, robot)
    assert result.snapped["start"]["given"] == [50, 94, np.pi / 2]
    assert 0 < result.snapped["start"]["distance"] < 2
    assert result.start[2] == np.pi / 2
    with pytest.raises(TaskError, match=r"nothing within 0\.2"):
        plan(open_space, (50, 94, np.pi / 2), GOAL, robot=robot, snap=0.2, sampler="uniform")


def test_replanner_keeps_the_heat_map_of_a_robot(open_space: GridMap) -> None:
    robot = ROBOTS["SE(2)"]
    replanner = Replanner(
        open_space, GOAL, "RRT", "corridor", robot=robot, time=20, range=40, seed=0,
        goal_tolerance=3,
    )  # fmt: skip
    first = replanner.plan(START)
    second = replanner.plan(first.path[1])
    assert (first.heatmap_kept, second.heatmap_kept) == (False, True)
    check(second, open_space, robot)


@pytest.mark.parametrize("yaw", [np.pi, -np.pi, 3 * np.pi, 7.0])
def test_any_yaw_is_one_that_ompl_takes(open_space: GridMap, yaw: float) -> None:
    robot = ROBOTS["SE(2)"]
    start, goal = (200.0, 30.0, yaw), (60.0, 30.0, yaw)
    result = plan(open_space, start, goal, "RRT", "corridor", robot=robot, time=20, seed=0)
    check(result, open_space, robot)
    assert -np.pi <= result.start[2] < np.pi
    assert abs(np.exp(1j * result.start[2]) - np.exp(1j * yaw)) < 1e-9
