"""Checks of robots for OMPL: what planners return is free, by an independent dense check."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise
from math import inf, pi
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from helpers.dense import DenseCheck, steps_of
from numpy.typing import NDArray

from cbagan_ompl import (
    GridMap,
    GridValidityChecker,
    MapError,
    PlannerError,
    Robot,
    RobotError,
    RobotMotionValidator,
    RobotValidityChecker,
)
from cbagan_ompl.planning import compat
from cbagan_ompl.planning.compat import ob, og

SPACES = {
    "SE2": lambda: ob.SE2StateSpace(),
    "Dubins": lambda: ob.DubinsStateSpace(6.0),
    "symmetric Dubins": lambda: ob.DubinsStateSpace(6.0, True),
    "Reeds-Shepp": lambda: ob.ReedsSheppStateSpace(6.0),
}
ROBOTS = {
    "rectangle": Robot.rectangle(10, 5),
    "car": Robot.rectangle(8, 4, offset=2.5),
    "arrow": Robot.polygon([(0, 0), (6, -3), (2, 0), (6, 3)]),
    "disc": Robot.disc(3.0, turning_radius=6.0),
    "point": Robot.point(turning_radius=6.0),
}


def with_bounds(space: Any, grid: GridMap) -> Any:
    bounds = ob.RealVectorBounds(2)
    for axis in range(2):
        bounds.setLow(axis, float(grid.bounds[0][axis]))
        bounds.setHigh(axis, float(grid.bounds[1][axis]))
    space.setBounds(bounds)
    return space


def make_map(seed: int, ros: bool = False) -> GridMap:
    rng = np.random.default_rng(seed)
    free = rng.random((100, 120)) >= 0.0008
    for _ in range(7):
        row, column, height, width = rng.integers((0, 0, 2, 2), (100, 120, 25, 25))
        free[row : row + height, column : column + width] = False
    return GridMap(free, 1.0, (-20.0, 7.0, 0.4)) if ros else GridMap(free)


class States:
    """New states of a space, kept alive."""

    def __init__(self, space: Any) -> None:
        self.space, self.kept = space, list[Any]()

    def __call__(self, x: float, y: float, yaw: float) -> Any:
        self.kept.append(compat.new_state(self.space))
        state = compat.typed_state(self.kept[-1])
        state.setX(float(x))
        state.setY(float(y))
        state.setYaw(float(yaw))
        return state

    @property
    def handle(self) -> Any:
        return self.kept[-1]


def random_poses(grid: GridMap, rng: np.random.Generator) -> Iterator[NDArray[np.float64]]:
    while True:
        pixel = rng.uniform((0, 0), (grid.width, grid.height))
        yield np.array([*grid.to_world(pixel), rng.uniform(-pi, pi)])


def poses_between(space: Any, start: Any, end: Any, steps: int) -> NDArray[np.float64]:
    """Poses that OMPL interpolates, (steps + 1, 3)."""
    handle = compat.new_state(space)
    state = compat.typed_state(handle)
    poses = np.empty((steps + 1, 3))
    for index in range(steps + 1):
        space.interpolate(start, end, index / steps, state)
        poses[index] = state.getX(), state.getY(), state.getYaw()
    return poses


@pytest.mark.parametrize("ros", [False, True])
@pytest.mark.parametrize("robot", ROBOTS)
@pytest.mark.parametrize("space_name", SPACES)
def test_motions_that_pass_touch_nothing(space_name: str, robot: str, ros: bool) -> None:
    grid, shape = make_map(1, ros), ROBOTS[robot]
    space = with_bounds(SPACES[space_name](), grid)
    si = ob.SpaceInformation(space)
    validator, dense = RobotMotionValidator(si, grid, shape), DenseCheck(grid, shape)
    rng = np.random.default_rng(2)
    make, poses = States(space), random_poses(grid, rng)
    passed = refused = 0
    for _ in range(150):
        start = next(poses)
        end = next(poses)
        end[:2] = start[:2] + rng.normal(0, 6, 2)
        if dense.collides(np.stack((start, end))).any():
            continue
        first, second = make(*start), make(*end)
        free = validator.checkMotion(first, second)
        assert type(free) is bool
        length = (
            np.hypot(*(end - start)[:2]) if space_name == "SE2" else space.distance(first, second)
        )
        turn = pi if space_name == "SE2" else length / 6.0
        steps = steps_of(grid, shape, float(length), turn)
        collides = dense.collides(poses_between(space, first, second, steps)).any()
        assert not (free and collides), (start, end)
        passed += free
        refused += not free and not collides
    assert passed > 5
    assert refused <= 0.1 * passed + 1


@pytest.mark.parametrize("planner", ["RRT", "RRTConnect", "RRTstar"])
@pytest.mark.parametrize("space_name", ["SE2", "Dubins", "Reeds-Shepp"])
def test_solved_paths_touch_nothing(space_name: str, planner: str) -> None:
    grid, robot = make_map(4), ROBOTS["car"]
    dense, rng = DenseCheck(grid, robot), np.random.default_rng(5)
    poses = random_poses(grid, rng)
    solved = 0
    for _ in range(12):
        start, goal = next(poses), next(poses)
        if dense.collides(np.stack((start, goal))).any():
            continue
        space = with_bounds(SPACES[space_name](), grid)
        setup = og.SimpleSetup(space)
        si = setup.getSpaceInformation()
        setup.setStateValidityChecker(RobotValidityChecker(si, grid, robot))
        si.setMotionValidator(RobotMotionValidator(si, grid, robot))
        make = States(space)
        make(*start)
        first = make.handle
        make(*goal)
        setup.setStartAndGoalStates(first, make.handle, 1.0)
        setup.setPlanner(getattr(og, planner)(si))
        setup.getPlanner().setRange(25.0)
        left = iter(range(800))
        if not compat.is_exact(
            setup.solve(compat.termination_condition(lambda left=left: next(left, None) is None))
        ):
            continue
        solved += 1
        states = setup.getSolutionPath().getStates()
        for first, second in pairwise(states):
            length = space.distance(first, second)
            steps = steps_of(grid, robot, length, length / 6.0 if space_name != "SE2" else pi)
            assert not dense.collides(poses_between(space, first, second, steps)).any()
    assert solved > 0


def test_compound_spaces_that_hold_a_pose_first() -> None:
    grid, robot = make_map(6), ROBOTS["rectangle"]
    for make_space in SPACES.values():
        poses = with_bounds(make_space(), grid)
        speeds = ob.RealVectorStateSpace(1)
        speeds.setBounds(0, 1)
        space = ob.CompoundStateSpace()
        space.addSubspace(poses, 1.0)
        space.addSubspace(speeds, 0.5)
        si, plain = ob.SpaceInformation(space), ob.SpaceInformation(poses)
        checks = RobotValidityChecker(si, grid, robot), RobotMotionValidator(si, grid, robot)
        expected = (
            RobotValidityChecker(plain, grid, robot),
            RobotMotionValidator(plain, grid, robot),
        )
        make, stream = States(poses), random_poses(grid, np.random.default_rng(7))
        answers = set()
        for _ in range(60):
            start, end = next(stream), next(stream)
            end[:2] = start[:2] + (end[:2] - start[:2]) / 10
            handles = [compat.new_state(space) for _ in range(2)]
            both = [compat.typed_state(handle) for handle in handles]
            for state, pose in zip(both, (start, end), strict=True):
                state[0].setX(float(pose[0]))
                state[0].setY(float(pose[1]))
                state[0].setYaw(float(pose[2]))
                state[1][0] = 0.3
            simple = make(*start), make(*end)
            assert checks[0].isValid(both[0]) == expected[0].isValid(simple[0])
            answer = checks[1].checkMotion(*both)
            assert answer == expected[1].checkMotion(*simple)
            answers.add(answer)
        assert answers == {True, False}


def test_a_disc_and_a_point_in_the_plane() -> None:
    grid = make_map(8)
    space = compat.plane_space(*grid.bounds)
    si = ob.SpaceInformation(space)
    point = RobotValidityChecker(si, grid, Robot.point())
    old, disc = GridValidityChecker(si, grid), RobotValidityChecker(si, grid, Robot.disc(2.5))
    handle = compat.new_state(space)
    state = compat.typed_state(handle)
    for x, y in np.random.default_rng(9).uniform(-3, 125, (800, 2)).tolist():
        state[0], state[1] = x, y
        assert point.isValid(state) == old.isValid(state) == bool(grid.is_free((x, y)))
        assert old.clearance(state) == point.clearance(state)
        if disc.isValid(state):
            assert disc.clearance(state) == pytest.approx(old.clearance(state) - 2.5, abs=0.03)


def test_clearance_reaches_ompl() -> None:
    free = np.ones((40, 60), np.bool_)
    free[:, 50:] = False
    grid = GridMap(free, 0.5)
    space = with_bounds(ob.SE2StateSpace(), grid)
    si = ob.SpaceInformation(space)
    checker = RobotValidityChecker(si, grid, Robot.rectangle(4, 2))
    si.setStateValidityChecker(checker)
    make = States(space)
    state = make(10.0, 10.0, 0.0)
    assert checker.clearance(state) == pytest.approx(25 - 12)
    assert type(checker.clearance(state)) is float
    assert checker.clearance(make(24.0, 10.0, 0.0)) == 0
    assert checker.clearance(make(10.0, 10.0, pi / 2)) == pytest.approx(25 - 11)
    assert si.getStateValidityChecker().clearance(state) == pytest.approx(13)
    everywhere = RobotValidityChecker(si, GridMap(np.ones((40, 60))), Robot.rectangle(4, 2))
    assert everywhere.clearance(state) == inf


def test_the_last_valid_state_of_ompl_1() -> None:
    free = np.ones((40, 100), np.bool_)
    free[:, 60:] = False
    grid, robot = GridMap(free), Robot.rectangle(10, 4)
    space = with_bounds(ob.SE2StateSpace(), grid)
    validator = RobotMotionValidator(ob.SpaceInformation(space), grid, robot)
    make = States(space)

    class LastValid:
        first, second = make(0, 0, 0), -1.0

    assert not validator.checkMotion(make(10, 20, 0), make(90, 20, 0), LastValid)
    assert pytest.approx(45 / 80, abs=2e-3) == LastValid.second
    assert LastValid.first.getX() == pytest.approx(55, abs=0.2)


def test_the_motion_to_the_last_valid_state_is_valid() -> None:
    """Reeds-Shepp curves to a state on a curve are another one in half a percent of the cases."""
    grid, robot = make_map(1), ROBOTS["car"]
    space = with_bounds(SPACES["Reeds-Shepp"](), grid)
    validator = RobotMotionValidator(ob.SpaceInformation(space), grid, robot)
    dense, rng = DenseCheck(grid, robot), np.random.default_rng(2)
    make, poses = States(space), random_poses(grid, rng)
    blocked = 0
    while blocked < 1000:
        start, end = next(poses), next(poses)
        end[:2] = start[:2] + rng.normal(0, 14, 2)
        if dense.collides(start[None]).any():
            continue
        pair = SimpleNamespace(first=make(0, 0, 0), second=-1.0)
        first = make(*start)
        if not validator.checkMotion(first, make(*end), pair):
            blocked += 1
            assert 0 <= pair.second < 1
            assert validator.checkMotion(first, pair.first)


def test_arguments_that_are_none() -> None:
    grid = make_map(1)
    plane = ob.SpaceInformation(compat.plane_space(*grid.bounds))
    poses = ob.SpaceInformation(with_bounds(ob.SE2StateSpace(), grid))
    angle = ob.SpaceInformation(ob.SO2StateSpace())
    for kind in (RobotValidityChecker, RobotMotionValidator):
        with pytest.raises(MapError, match="GridMap"):
            kind(poses, grid.free, ROBOTS["car"])
        with pytest.raises(RobotError, match=r"Robot\.rectangle"):
            kind(poses, grid, (4, 2))
        with pytest.raises(RobotError, match="larger"):
            kind(poses, grid, Robot.rectangle(400, 2))
        with pytest.raises(PlannerError, match="SE2StateSpace"):
            kind(plane, grid, ROBOTS["rectangle"])
        with pytest.raises(PlannerError, match="not SO2StateSpace"):
            kind(angle, grid, ROBOTS["car"])
        with pytest.raises(PlannerError, match="SpaceInformation"):
            kind(grid, grid, ROBOTS["car"])
