"""Poses: headings from the heat map in every space that has them, by every hook."""

from __future__ import annotations

from math import hypot, inf, nan, pi
from typing import Any

import numpy as np
import pytest
from helpers.tasks import GOAL, START

from cbagan_ompl import (
    GridMap,
    GridValidityChecker,
    HeadingSpread,
    Heatmap,
    HeatmapStateSampler,
    HeatmapValidStateSampler,
    PlannerError,
    attach,
    reached_planners,
)
from cbagan_ompl.planning import compat
from cbagan_ompl.planning.compat import ob, og, ou
from cbagan_ompl.planning.monitor import PlannerMonitor
from cbagan_ompl.planning.pose_headings import with_headings
from cbagan_ompl.planning.states import is_distance_bound, state_access

SPACES = ["SE2", "Dubins", "ReedsShepp", "compound"]


@pytest.fixture(autouse=True)
def quiet() -> None:
    ou.setLogLevel(ou.LOG_ERROR)


def bounds(space: Any, grid: GridMap) -> Any:
    limits = ob.RealVectorBounds(2)
    for axis, (low, high) in enumerate(zip(*grid.bounds, strict=True)):
        limits.setLow(axis, float(low))
        limits.setHigh(axis, float(high))
    space.setBounds(limits)
    return space


def make_space(kind: str, grid: GridMap) -> Any:
    if kind == "Dubins":
        return bounds(ob.DubinsStateSpace(10.0), grid)
    if kind == "ReedsShepp":
        return bounds(ob.ReedsSheppStateSpace(10.0), grid)
    poses = bounds(ob.SE2StateSpace(), grid)
    if kind == "SE2":
        return poses
    speeds = ob.RealVectorStateSpace(1)
    limits = ob.RealVectorBounds(1)
    limits.setLow(0, -2.0)
    limits.setHigh(0, -1.0)
    speeds.setBounds(limits)
    space = ob.CompoundStateSpace()
    space.addSubspace(poses, 1.0)
    space.addSubspace(speeds, 0.1)
    return space


def pose_of(space: Any, typed: Any) -> Any:
    return typed if isinstance(space, ob.SE2StateSpace) else typed[0]


def make_state(space: Any, x: float, y: float, yaw: float) -> Any:
    state = compat.new_state(space)
    typed = compat.typed_state(state)
    pose = pose_of(space, typed)
    pose.setX(x)
    pose.setY(y)
    pose.setYaw(yaw)
    if pose is not typed:
        typed[1][0] = -1.5
    return state


def make_setup(kind: str, grid: GridMap, planner: str, goal_yaw: float = 1.0) -> Any:
    space = make_space(kind, grid)
    setup = og.SimpleSetup(space)
    si = setup.getSpaceInformation()
    setup.setStateValidityChecker(GridValidityChecker(si, grid))
    si.setStateValidityCheckingResolution(1.0 / si.getMaximumExtent())
    start, goal = make_state(space, *START, 0.0), make_state(space, *GOAL, goal_yaw)
    setup.setStartAndGoalStates(start, goal, 6.0)
    instance = getattr(og, planner)(si)
    if hasattr(instance, "setRange"):
        instance.setRange(40.0)
    setup.setPlanner(instance)
    return setup


def sampled(space: Any, write: Any, count: int) -> np.ndarray:
    """Poses, and the speed of a compound space or NaN, (count, 4)."""
    state = compat.new_state(space)
    typed = compat.typed_state(state)
    rows = []
    for _ in range(count):
        write(typed)
        pose = pose_of(space, typed)
        speed = nan if pose is typed else typed[1][0]
        rows.append((pose.getX(), pose.getY(), pose.getYaw(), speed))
    return np.array(rows)


def fraction_near(yaw: np.ndarray, heading: float) -> float:
    return float((np.abs(np.angle(np.exp(1j * (yaw - heading)))) < 0.8).mean())


@pytest.mark.parametrize("kind", SPACES)
def test_samplers_follow_the_headings(kind: str, two_walls: GridMap, corridor: Heatmap) -> None:
    space = make_space(kind, two_walls)
    heatmap = corridor.with_heading(np.full(two_walls.shape, 2.0))
    state_sampler = HeatmapStateSampler(space, heatmap, seed=1)
    si = ob.SpaceInformation(space)
    si.setStateValidityChecker(GridValidityChecker(si, two_walls))
    si.setup()
    valid_sampler = HeatmapValidStateSampler(si, heatmap, seed=2)
    near = make_state(space, 20.0, 20.0, 0.0)
    typed_near = compat.typed_state(near)
    for write in (
        state_sampler.sampleUniform,
        lambda state: state_sampler.sampleUniformNear(state, typed_near, 15.0),
        lambda state: state_sampler.sampleGaussian(state, typed_near, 5.0),
        valid_sampler.sample,
    ):
        found = sampled(space, write, 600)
        turned = kind == "ReedsShepp"
        assert fraction_near(found[:, 2], 2.0) == pytest.approx(0.66 if turned else 0.81, abs=0.07)
        assert fraction_near(found[:, 2], 2.0 - pi) == pytest.approx(
            0.2 if turned else 0.05, abs=0.06
        )
        if kind == "compound":
            assert ((found[:, 3] >= -2) & (found[:, 3] <= -1)).all()
            assert np.ptp(found[:, 3]) > 0.8, "the speed is uniform"


@pytest.mark.parametrize("kind", SPACES)
def test_without_headings_they_are_uniform(
    kind: str, two_walls: GridMap, corridor: Heatmap
) -> None:
    space = make_space(kind, two_walls)
    sampler = HeatmapStateSampler(space, corridor, seed=1)
    yaw = sampled(space, sampler.sampleUniform, 2000)[:, 2]
    assert np.abs(np.histogram(yaw, 4, (-pi, pi))[0] - 500).max() < 100


@pytest.mark.parametrize("kind", SPACES)
@pytest.mark.parametrize("planner", ["RRT", "RRTstar", "BKPIECE1", "RRTConnect"])
def test_attached(kind: str, planner: str, two_walls: GridMap, corridor: Heatmap) -> None:
    if planner not in reached_planners():
        pytest.skip("not reached by this build")
    if planner == "BKPIECE1" and kind == "compound":
        pytest.skip("the space has no projection")
    setup = make_setup(kind, two_walls, planner)
    with attach(setup, corridor, seed=1) as attachment:
        solved = compat.is_exact(setup.solve(5.0 if planner != "RRTstar" else 1.0))
        assert attachment.sample_counts["learned"] > 0
    assert solved or kind in ("Dubins", "compound"), "found in milliseconds elsewhere"
    path = setup.getSolutionPath().getStates() if solved else []
    for state in path:
        x, y = state_access(setup.getStateSpace()).read(state)
        assert two_walls.is_free((x, y))


@pytest.mark.parametrize("kind", SPACES)
def test_headings_are_made_for_poses(kind: str, two_walls: GridMap, corridor: Heatmap) -> None:
    setup = make_setup(kind, two_walls, "RRT")
    made = with_headings(setup, corridor, HeadingSpread())
    assert made.heading is not None
    assert corridor.heading is None
    assert made.heading[20, 20] == pytest.approx(corridor.directed(GOAL).heading[20, 20])
    assert with_headings(setup, made, HeadingSpread()) is made, "the user's own are kept"
    assert with_headings(setup, corridor, HeadingSpread(uniform_fraction=1)) is corridor


def test_no_headings_in_the_plane(two_walls: GridMap, corridor: Heatmap) -> None:
    setup = og.SimpleSetup(compat.plane_space(*two_walls.bounds))
    assert with_headings(setup, corridor, HeadingSpread()) is corridor


def test_headings_to_several_goals(two_walls: GridMap) -> None:
    setup = make_setup("SE2", two_walls, "RRT")
    goals = ob.GoalStates(setup.getSpaceInformation())
    kept = [make_state(setup.getStateSpace(), *point, 0.0) for point in ((10, 30), (150, 30))]
    for state in kept:
        goals.addState(state)
    setup.setGoal(goals)
    heading = with_headings(setup, Heatmap.uniform(two_walls), HeadingSpread()).heading
    assert heading is not None
    assert abs(heading[30, 60]) > 2.8
    assert abs(heading[30, 110]) < 0.3


def test_goals_off_the_map_give_no_headings(two_walls: GridMap, corridor: Heatmap) -> None:
    setup = make_setup("SE2", two_walls, "RRT")
    setup.setGoalState(make_state(setup.getStateSpace(), -50.0, 20.0, 0.0))
    assert with_headings(setup, corridor, HeadingSpread()) is corridor


@pytest.mark.parametrize("kind", SPACES)
def test_distances_bound_those_of_positions(kind: str, two_walls: GridMap) -> None:
    """What the informed set of positions rests on."""
    space = make_space(kind, two_walls)
    rng = np.random.default_rng(5)
    assert is_distance_bound(space)
    for _ in range(300):
        (x0, y0, a), (x1, y1, b) = rng.uniform((0, 0, -pi), (256, 256, pi), (2, 3)).tolist()
        states = make_state(space, x0, y0, a), make_state(space, x1, y1, b)
        distance = space.distance(*map(compat.typed_state, states))
        assert distance >= hypot(x1 - x0, y1 - y0) - 1e-9


@pytest.mark.parametrize("kind", ["SE2", "Dubins", "ReedsShepp"])
def test_informed_set_of_poses(kind: str, two_walls: GridMap) -> None:
    """It is there where positions weigh 1; with less, a path may be shorter than its positions."""
    setup = make_setup(kind, two_walls, "InformedRRTstar")
    monitor = PlannerMonitor(setup, state_access(setup.getStateSpace()))
    setup.setup()
    setup.solve(0.01)
    informed = monitor.informed_set()
    assert informed is not None
    assert informed.cost_bounds(np.array([START]))[0] == pytest.approx(
        hypot(GOAL[0] - START[0], GOAL[1] - START[1]) - 6.0
    )
    setup.getStateSpace().setSubspaceWeight(0, 0.5)
    assert (monitor.informed_set() is None) == (kind == "SE2"), "lengths of curves have no weights"


def test_weights_of_compound_spaces(two_walls: GridMap) -> None:
    space = make_space("compound", two_walls)
    space.setSubspaceWeight(0, 0.5)
    assert not is_distance_bound(space)
    space.getSubspace(0).setSubspaceWeight(0, 2.0)
    assert is_distance_bound(space)


@pytest.mark.parametrize("kind", ["SE2", "Dubins", "ReedsShepp"])
def test_informed_samples_of_poses(kind: str, two_walls: GridMap) -> None:
    """Once there is a path, samples are where a shorter one can pass."""
    setup = make_setup(kind, two_walls, "InformedRRTstar")
    heatmap = Heatmap.corridor(two_walls, START, GOAL)
    with attach(setup, heatmap, seed=3) as attachment:
        best = setup.getPlanner().bestCost
        setup.solve(compat.termination_condition(lambda: best().value() < inf))
        setup.solve(0.1)
        sampler = attachment._sampler
        points = np.array([sampler.next() for _ in range(500)])
        informed = sampler.monitor.informed_set()
        assert informed is not None
        assert (informed.cost_bounds(points) <= best().value()).mean() > 0.99


def test_other_compound_spaces_are_refused(two_walls: GridMap, corridor: Heatmap) -> None:
    space = ob.CompoundStateSpace()
    space.addSubspace(ob.SO2StateSpace(), 1.0)
    space.addSubspace(bounds(ob.SE2StateSpace(), two_walls), 1.0)
    with pytest.raises(PlannerError, match="first part"):
        HeatmapStateSampler(space, corridor)


class _OneWay(ob.StateValidityChecker):  # type: ignore[misc]
    """Poses are valid whose yaw is positive."""

    def __init__(self, si: Any, counts: list[bool]) -> None:
        super().__init__(si)
        self._counts = counts
        self._read = state_access(si.getStateSpace()).read_pose

    def isValid(self, state: Any) -> bool:  # noqa: N802
        valid = self._read(state)[2] > 0
        self._counts.append(valid)
        return valid


@pytest.mark.parametrize("kind", SPACES)
def test_a_sample_in_collision_gets_another_heading(two_walls: GridMap, kind: str) -> None:
    space = make_space(kind, two_walls)
    setup = og.SimpleSetup(space)
    si = setup.getSpaceInformation()
    counts: list[bool] = []
    setup.setStateValidityChecker(_OneWay(si, counts))
    access = state_access(space)
    ends = [compat.new_state(space) for _ in range(2)]
    for end, place in zip(ends, (START, GOAL), strict=True):
        access.write_pose(compat.typed_state(end), *place, 1.0)
    setup.setStartAndGoalStates(*ends, 0.01)
    setup.setPlanner(og.RRTstar(si))
    heading = HeadingSpread(uniform_fraction=1, approach_fraction=0)
    with attach(setup, Heatmap.uniform(two_walls), seed=0, heading=heading):
        goal = setup.getGoal()
        state = compat.new_state(space)
        yaws = []
        for _ in range(400):
            goal._sample_heatmap(compat.typed_state(state))
            yaws.append(access.read_pose(compat.typed_state(state))[2])
    # With four headings each, a sixteenth of the samples stays invalid.
    assert np.mean(np.array(yaws) <= 0) == pytest.approx(1 / 16, abs=0.04)
    assert 1.5 < len(counts) / 400 < 2.1
