"""Exact checks of shapes, against an independent dense check."""

from __future__ import annotations

from functools import partial
from math import inf, nan, pi

import numpy as np
import pytest
from helpers.dense import DenseCheck, steps_of, straight_poses
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from cbagan_ompl import GridMap, Robot, RobotError
from cbagan_ompl.robots.shape_checker import ShapeChecker

ROBOTS = {
    "rectangle": Robot.rectangle(12, 6),
    "small": Robot.rectangle(0.7, 0.3),
    "car": Robot.rectangle(9, 4, offset=3.0),
    "triangle": Robot.polygon([(-3, -2), (5, 0), (-3, 2.5)]),
    "arrow": Robot.polygon([(0, 0), (8, -4), (3, 0), (8, 4)]),
    "trailer": Robot.polygon([(-9, -2), (-3, -2), (-3, 2), (-9, 2)]),
    "comb": Robot.polygon([(-4, -4), (4, -4), (4, 4), (2, 4), (2, -2), (-2, -2), (-2, 4), (-4, 4)]),
    "disc": Robot.disc(3.3),
    "point": Robot.point(),
}


def random_map(seed: int, blocked: float = 0.004, ros: bool = False) -> GridMap:
    rng = np.random.default_rng(seed)
    free = rng.random((90, 110)) >= blocked
    for _ in range(6):
        row, column, height, width = rng.integers((0, 0, 1, 1), (90, 110, 20, 20))
        free[row : row + height, column : column + width] = False
    return GridMap(free, 0.25, (3.0, -2.0, 0.7)) if ros else GridMap(free)


def scaled(robot: Robot, resolution: float) -> Robot:
    if robot.vertices is not None:
        return Robot.polygon(robot.vertices * resolution)
    return Robot.disc(robot.radius * resolution) if robot.radius else robot


def random_poses(grid: GridMap, rng: np.random.Generator, count: int) -> NDArray[np.float64]:
    pixels = rng.uniform((0, 0), (grid.width, grid.height), (count, 2))
    return np.column_stack((grid.to_world(pixels), rng.uniform(-pi, pi, count)))


def pose_between(
    start: NDArray[np.float64], end: NDArray[np.float64], t: float
) -> tuple[float, float, float]:
    x, y, yaw = (start + t * (end - start)).tolist()
    return x, y, yaw


@pytest.mark.parametrize("ros", [False, True])
@pytest.mark.parametrize("name", ROBOTS)
def test_poses_are_those_of_the_dense_check(name: str, ros: bool) -> None:
    grid = random_map(1, ros=ros)
    robot = scaled(ROBOTS[name], grid.resolution)
    checker, dense = ShapeChecker(grid, robot), DenseCheck(grid, robot)
    poses = random_poses(grid, np.random.default_rng(2), 2000)
    free = np.array([checker.pose_is_free(*pose) for pose in poses.tolist()])
    collides = dense.collides(poses)
    assert not (free & collides).any()
    refused = ~free & ~collides
    # A disc is checked as a polygon around it.
    assert refused.sum() <= (0.01 if robot.radius else 0) * (~collides).sum()
    assert 100 < free.sum() < 1950


@pytest.mark.parametrize("ros", [False, True])
@pytest.mark.parametrize("name", ROBOTS)
def test_motions_are_those_of_the_dense_check(name: str, ros: bool) -> None:
    grid = random_map(3, ros=ros)
    robot = scaled(ROBOTS[name], grid.resolution)
    checker, dense = ShapeChecker(grid, robot), DenseCheck(grid, robot)
    rng = np.random.default_rng(4)
    count = {"free": 0, "refused": 0}
    for _ in range(150):
        start, end = random_poses(grid, rng, 2)
        if rng.random() < 0.7:
            end[:2] = start[:2] + rng.normal(0, 10 * grid.resolution, 2)
        if rng.random() < 0.2:
            end[2] = start[2]
        turn = abs((end[2] - start[2] + pi) % (2 * pi) - pi)
        steps = steps_of(grid, robot, float(np.hypot(*(end - start)[:2])), turn)
        collides = dense.collides(straight_poses(start, end, steps)).any()
        free = checker.straight_is_free(*start.tolist(), *end.tolist())
        assert not (free and collides), (start, end)
        count["free"] += free
        count["refused"] += not free and not collides
    assert count["free"] > 10
    assert count["refused"] <= 0.1 * count["free"] + 1


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 2**32), st.sampled_from(sorted(ROBOTS)))
def test_a_free_motion_has_free_poses_only(seed: int, name: str) -> None:
    rng = np.random.default_rng(seed)
    grid = GridMap(rng.random((40, 50)) >= rng.uniform(0, 0.02))
    checker, dense = ShapeChecker(grid, ROBOTS[name]), DenseCheck(grid, ROBOTS[name])
    for _ in range(10):
        start, end = random_poses(grid, rng, 2)
        if checker.straight_is_free(*start.tolist(), *end.tolist()):
            poses = straight_poses(start, end, 1500)
            assert not dense.collides(poses).any()


def test_tables_and_exact_tests_agree() -> None:
    grid, robot = random_map(5), ROBOTS["rectangle"]
    lazy, made = ShapeChecker(grid, robot), ShapeChecker(grid, robot)
    rng = np.random.default_rng(6)
    for index in range(made.tables.count):
        made.tables.make(index)
    for pose in random_poses(grid, rng, 1000).tolist():
        assert lazy.pose_is_free(*pose) == made.pose_is_free(*pose)
    for start in random_poses(grid, rng, 400):
        motion = [*start.tolist(), *(start + rng.normal(0, (6, 6, 0.5))).tolist()]
        assert lazy.straight_is_free(*motion) == made.straight_is_free(*motion)


@pytest.mark.parametrize("ros", [False, True])
@pytest.mark.parametrize("name", ROBOTS)
def test_the_compiled_check_gives_the_same_answers(name: str, ros: bool) -> None:
    grid = random_map(11, ros=ros)
    robot = scaled(ROBOTS[name], grid.resolution)
    plain, compiled = ShapeChecker(grid, robot), ShapeChecker(grid, robot)
    compiled.compile()
    rng = np.random.default_rng(12)
    answers = set()
    for _ in range(300):
        start, end = random_poses(grid, rng, 2)
        if rng.random() < 0.8:
            end[:2] = start[:2] + rng.normal(0, 8 * grid.resolution, 2)
        motion = [*start.tolist(), *end.tolist()]
        answer = compiled.straight_is_free(*motion)
        assert type(answer) is bool
        assert answer == plain.straight_is_free(*motion)
        answers.add(answer)
        free = compiled.pose_is_free(*end.tolist())
        assert type(free) is bool
        assert free == plain.pose_is_free(*end.tolist())
        length, turn = float(np.hypot(*(end - start)[:2])), float(abs(end - start)[2])
        curve = partial(pose_between, start, end), length, turn
        assert compiled.curve_is_free(*curve) == plain.curve_is_free(*curve)
    assert answers == {True, False}
    for value in (nan, inf):
        for place in range(6):
            motion = [10.0, 10.0, 0.0, 11.0, 11.0, 1.0]
            motion[place] = value
            if place not in (2, 5) or robot.vertices is not None:
                assert not compiled.straight_is_free(*motion)


def test_tables_that_are_worth_their_time_are_made_on_the_way() -> None:
    grid, robot = random_map(5), ROBOTS["rectangle"]
    checker = ShapeChecker(grid, robot)
    poses = random_poses(grid, np.random.default_rng(6), 8000).tolist()
    for pose in poses:
        checker.pose_is_free(*pose)
    made = np.count_nonzero(checker.tables.slots[: checker.tables.count])
    assert made > 0
    assert (checker.tables.uses >= 40).sum() == made


@pytest.mark.parametrize("name", ["rectangle", "arrow", "disc", "point", "trailer"])
def test_clearance_is_the_true_distance(name: str) -> None:
    grid = random_map(7, ros=True)
    robot = scaled(ROBOTS[name], grid.resolution)
    checker, dense = ShapeChecker(grid, robot), DenseCheck(grid, robot)
    poses = random_poses(grid, np.random.default_rng(8), 300)
    free = 0
    for pose in poses:
        clearance = checker.clearance(*pose.tolist())
        if checker.pose_is_free(*pose.tolist()):
            free += 1
            slack = 0.03 * grid.resolution if robot.radius else 1e-6
            assert clearance == pytest.approx(dense.distance(pose), abs=slack)
        else:
            assert clearance == 0
    assert free > 50


def test_clearance_without_obstacles_is_infinite() -> None:
    checker = ShapeChecker(GridMap(np.ones((20, 20))), Robot.rectangle(4, 2))
    assert checker.clearance(10, 10, 0) == inf
    assert checker.clearance(0, 10, 0) == 0


def test_contact_counts_and_the_border_is_a_wall() -> None:
    free = np.ones((10, 30), np.bool_)
    free[:, 20:] = False
    checker = ShapeChecker(GridMap(free), Robot.rectangle(6, 2))
    assert not checker.pose_is_free(17.0, 5.0, 0.0)
    assert checker.pose_is_free(17.0 - 1e-6, 5.0, 0.0)
    assert not checker.pose_is_free(2.9, 5.0, 0.0)
    assert checker.pose_is_free(3.1, 5.0, 0.0)
    assert not checker.straight_is_free(10.0, 5.0, 0.0, 17.0, 5.0, 0.0)
    assert checker.straight_is_free(10.0, 5.0, 0.0, 16.9, 5.0, 0.0)


def test_straight_motions_without_a_turn_are_exact() -> None:
    """A robot slides through a corridor with a hundredth of a pixel to spare on either side."""
    free = np.zeros((20, 100), np.bool_)
    free[7:13] = True
    grid = GridMap(free)
    assert ShapeChecker(grid, Robot.rectangle(10, 5.98)).straight_is_free(8, 10, 0, 90, 10, 0)
    assert not ShapeChecker(grid, Robot.rectangle(10, 6.0)).straight_is_free(8, 10, 0, 90, 10, 0)


def test_a_turn_sweeps_over_an_obstacle_between_its_ends() -> None:
    free = np.ones((40, 40), np.bool_)
    free[26, 26] = False
    checker = ShapeChecker(GridMap(free), Robot.rectangle(20, 2))
    assert checker.pose_is_free(20, 20, 0)
    assert checker.pose_is_free(20, 20, pi / 2)
    assert not checker.straight_is_free(20, 20, 0, 20, 20, pi / 2)
    # The heading turns the short way, which is over -pi here.
    assert checker.straight_is_free(20, 20, pi * 0.9, 20, 20, -pi * 0.95)


def test_values_that_are_no_poses() -> None:
    checker = ShapeChecker(GridMap(np.ones((20, 20))), Robot.rectangle(4, 2))
    for value in (nan, inf, -inf):
        for axis in range(3):
            pose = [10.0, 10.0, 0.0]
            pose[axis] = value
            assert not checker.pose_is_free(*pose)
            assert not checker.straight_is_free(10, 10, 0, *pose)
            assert not checker.straight_is_free(*pose, 10, 10, 0)
    assert checker.straight_is_free(10, 10, 0, 10, 10, 0)


def test_a_robot_larger_than_the_map() -> None:
    grid = GridMap(np.ones((20, 30)), 0.5)
    for robot in (Robot.rectangle(30, 2), Robot.disc(6), Robot.rectangle(11, 11)):
        with pytest.raises(RobotError, match="larger than map"):
            ShapeChecker(grid, robot)
    assert ShapeChecker(grid, Robot.rectangle(14, 2)).pose_is_free(7.5, 5, 0)


def test_a_shape_without_its_reference_point_may_hold_it_over_an_obstacle() -> None:
    free = np.ones((20, 40), np.bool_)
    free[10, 30] = False
    checker = ShapeChecker(GridMap(free), ROBOTS["trailer"])
    assert checker.pose_is_free(30.5, 10.5, 0.0)
    for index in range(checker.tables.count):
        checker.tables.make(index)
    assert checker.pose_is_free(30.5, 10.5, 0.0)
