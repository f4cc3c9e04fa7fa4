"""Samples before the goal, for robots with a heading."""

from __future__ import annotations

from math import cos, pi, sin
from typing import Any

import numpy as np
import pytest
from helpers.poses import POSE_SPACES, RADIUS, SIDE, make_setup, make_space, new_pose
from helpers.setups import solve_for
from ompl import control as oc

from cbagan_ompl import GridMap, HeadingSpread, Heatmap, attach
from cbagan_ompl.planning import compat
from cbagan_ompl.planning.compat import ob, og, ou
from cbagan_ompl.planning.goal_approach import GoalApproach, goal_approach, turning_radius
from cbagan_ompl.planning.sample_budget import budget_of
from cbagan_ompl.robots.arcs import Pose, follow_arc
from cbagan_ompl.sampling.budget import ADVANCE, EARNED_BY_UNIFORM_POSE
from cbagan_ompl.sampling.sampler import HeatmapSampler

START, GOAL = (5.0, 5.0, 0.0), (64.0, 64.0, 0.7)
RANGE = 15.0
OPEN = GridMap(np.ones((SIDE, SIDE), bool))


@pytest.fixture(autouse=True)
def quiet() -> None:
    ou.setLogLevel(ou.LOG_ERROR)


def is_beside_the_wall(x: float, y: float) -> bool:
    return not 30.0 < x < 40.0


def is_anywhere(x: float, y: float) -> bool:
    return True


def sampler_on(grid: GridMap, **spread: float) -> HeatmapSampler:
    return HeatmapSampler(Heatmap.uniform(grid), seed=1, heading=HeadingSpread(**spread))


def approach_of(kind: str, grid: GridMap = OPEN, **spread: float) -> tuple[Any, GoalApproach]:
    """A space, and the approach of a planner in it."""
    setup = make_setup(kind, "RRTstar", (START, GOAL), is_anywhere, range=RANGE)
    approach = goal_approach(setup.getPlanner(), sampler_on(grid, **spread))
    assert approach is not None
    return setup.getStateSpace(), approach


def moved_back(space: Any, approach: GoalApproach, goal: Pose = GOAL) -> Any:
    """Poses before a goal, and the lengths of the ways to it, (N, 4)."""
    handles = new_pose(space, goal), new_pose(space, goal)
    target, state = (compat.typed_state(handle) for handle in handles)
    rows = []
    for _ in range(300):
        space.copyState(state, target)
        approach.move_back(state)
        rows.append((state.getX(), state.getY(), state.getYaw(), space.distance(state, target)))
    return np.array(rows)


@pytest.mark.parametrize("radius", [0.3, 6.0])
@pytest.mark.parametrize("kind", ["Dubins", "ReedsShepp"])
def test_the_turning_radius_is_found(kind: str, radius: float) -> None:
    space = make_space(kind, radius)
    assert turning_radius(space) == pytest.approx(radius)
    speeds = ob.RealVectorStateSpace(1)
    compound = ob.CompoundStateSpace()
    compound.addSubspace(space, 0.5)
    compound.addSubspace(speeds, 1.0)
    assert turning_radius(compound) == pytest.approx(radius), "whatever the weight"


@pytest.mark.parametrize("curvature", [-0.2, 0.0, 0.1])
@pytest.mark.parametrize("length", [-7.0, 3.0])
def test_arcs_are_those_of_small_steps(length: float, curvature: float) -> None:
    x, y, yaw = 1.0, 2.0, 3.0
    steps = 20000
    for _ in range(steps):
        yaw += length * curvature / steps
        x += length / steps * cos(yaw)
        y += length / steps * sin(yaw)
    end = follow_arc(1.0, 2.0, 3.0, length, curvature)
    assert end[:2] == pytest.approx((x, y), abs=1e-3)
    assert cos(end[2] - yaw) == pytest.approx(1.0)
    assert -pi <= end[2] < pi


@pytest.mark.parametrize("kind", ["Dubins", "ReedsShepp"])
def test_the_goal_is_reached_in_one_arc(kind: str) -> None:
    x, y, _, way = moved_back(*approach_of(kind)).T
    dx, dy = x - GOAL[0], y - GOAL[1]
    # No way is longer than half a circle, and none is shorter than the chord.
    assert (way <= pi * RADIUS + 1e-6).all()
    assert (np.hypot(dx, dy) <= pi * RADIUS).all()
    ahead = (dx * cos(GOAL[2]) + dy * sin(GOAL[2]) > 0).sum()
    assert ahead == 0 if kind == "Dubins" else 90 < ahead < 210


def test_the_goal_is_reached_along_a_line_from_all_sides() -> None:
    x, y, yaw, _ = moved_back(*approach_of("SE2")).T
    dx, dy = x - GOAL[0], y - GOAL[1]
    assert (np.hypot(dx, dy) <= RANGE).all()
    assert np.hypot(dx, dy).max() > 0.9 * RANGE
    assert np.abs(np.exp(1j * np.arctan2(dy, dx)).mean()) < 0.15
    assert 0.3 < np.abs(yaw - GOAL[2]).max() < 0.61


@pytest.mark.parametrize("kind", POSE_SPACES)
def test_blocked_positions_are_not_proposed(kind: str) -> None:
    free = np.ones((SIDE, SIDE), bool)
    free[:, :62] = False
    goal = (63.0, 64.0, 0.0)  # what is behind it is blocked but for a pixel
    x, _, _, _ = moved_back(*approach_of(kind, GridMap(free)), goal).T
    assert (x >= 62).all()


@pytest.mark.parametrize("kind", POSE_SPACES)
def test_poses_out_of_bounds_are_not_proposed(kind: str) -> None:
    space, approach = approach_of(kind)
    bounds = ob.RealVectorBounds(2)
    bounds.setLow(0.0)
    bounds.setHigh(66.0)  # the map goes on beyond
    space.setBounds(bounds)
    assert moved_back(space, approach)[:, :2].max() <= 66


def test_the_goal_stays_where_there_is_no_room() -> None:
    free = np.zeros((SIDE, SIDE), bool)
    free[0, 0] = True
    x, y, yaw, _ = moved_back(*approach_of("Dubins", GridMap(free))).T
    assert np.ptp(x) == np.ptp(y) == np.ptp(yaw) == 0


def test_it_is_due_once_the_tree_is_near() -> None:
    _, approach = approach_of("SE2", approach_fraction=1)
    assert not approach.is_due(), "without a tree"
    for distance, count, is_due in (
        (2 * RANGE + 1, 1, False),
        (2 * RANGE - 1, 2, True),
        (2 * RANGE + 1, 3, True),
        (2 * RANGE + 1, 1, False),  # the tree has begun anew
        (RANGE - 1, 1, True),
    ):
        approach.on_new_node(distance, count)
        assert approach.is_due() == is_due


def test_who_has_no_approach() -> None:
    def has_approach(planner: Any, **spread: float) -> bool:
        return goal_approach(planner, sampler_on(OPEN, **spread)) is not None

    for kind in POSE_SPACES:
        space = make_space(kind)
        planner = og.RRT(ob.SpaceInformation(space))
        assert has_approach(planner)
        assert not has_approach(planner, approach_fraction=0)
        assert not has_approach(planner, uniform_fraction=1)
        controls = oc.RealVectorControlSpace(space, 2)
        assert not has_approach(oc.RRT(oc.SpaceInformation(space, controls)))
    plane = ob.RealVectorStateSpace(2)
    assert not has_approach(og.RRT(ob.SpaceInformation(plane)))


def test_a_goal_in_a_narrow_place_is_entered() -> None:
    """A tree whose nearest node is turned the wrong way, in a box that is open above."""

    def is_in_place(x: float, y: float) -> bool:
        return not (54 < x < 74 and y < 74) or (60 < x < 68 and y > 60)

    setup = make_setup("SE2", "RRT", ((64.0, 100.0, 0.0), (64.0, 64.0, -pi / 2)), is_in_place)
    free = np.array([[is_in_place(x + 0.5, y + 0.5) for x in range(SIDE)] for y in range(SIDE)])
    with attach(setup, Heatmap.uniform(GridMap(free)), seed=1):
        solve_for(setup, 2000)
    assert setup.haveExactSolutionPath()


@pytest.mark.parametrize("fraction", [0.0, 1.0])
def test_planners_sample_before_the_goal(fraction: float) -> None:
    # The range is so long that the start is near.
    ends = START, GOAL
    setup = make_setup("ReedsShepp", "RRTstar", ends, is_beside_the_wall, 0.01, range=200.0)
    heading = HeadingSpread(approach_fraction=fraction)
    with attach(setup, Heatmap.uniform(OPEN), seed=1, heading=heading) as attachment:
        solve_for(setup, 200)
        counts = attachment.sample_counts
    if fraction == 1:
        assert sum(counts.values()) < 20, "all others are the goal and the way to it"
    else:
        assert sum(counts.values()) > 150


def test_planners_of_poses_have_a_wider_budget() -> None:
    setup = make_setup("ReedsShepp", "RRT", (START, GOAL), is_anywhere)
    budget = budget_of(setup.getPlanner(), sees_nodes=True)
    spent = sum(budget.spend() for _ in range(10 * ADVANCE))
    assert spent == ADVANCE
    budget.earn_by_uniform()
    earned = sum(budget.spend() for _ in range(100))
    assert earned == EARNED_BY_UNIFORM_POSE
