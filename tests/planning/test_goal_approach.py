"""Samples before the goal, for robots that cannot turn on the spot."""

from __future__ import annotations

from math import cos, hypot, pi, sin
from typing import Any

import numpy as np
import pytest

from cbagan_ompl import GridMap, HeadingSpread, Heatmap, attach
from cbagan_ompl.planning import compat
from cbagan_ompl.planning.compat import ob, og, ou
from cbagan_ompl.planning.goal_approach import GoalApproach, goal_approach, turning_radius
from cbagan_ompl.planning.sample_budget import budget_of
from cbagan_ompl.robots.arcs import follow_arc
from cbagan_ompl.sampling.budget import ADVANCE, EARNED_BY_UNIFORM_POSE
from cbagan_ompl.sampling.sampler import HeatmapSampler

RADIUS = 6.0
SPACES = {"Dubins": ob.DubinsStateSpace, "Reeds-Shepp": ob.ReedsSheppStateSpace}
GOAL = (64.0, 64.0, 0.7)


@pytest.fixture(autouse=True)
def quiet() -> None:
    ou.setLogLevel(ou.LOG_ERROR)


def set_pose(typed: Any, x: float, y: float, yaw: float) -> None:
    typed.setX(x)
    typed.setY(y)
    typed.setYaw(yaw)


def new_state(space: Any, pose: tuple[float, float, float]) -> tuple[Any, Any]:
    handle = compat.new_state(space)
    typed = compat.typed_state(handle)
    set_pose(typed, *pose)
    return handle, typed


def make_space(kind: Any) -> Any:
    space = kind()
    bounds = ob.RealVectorBounds(2)
    bounds.setLow(0.0)
    bounds.setHigh(128.0)
    space.setBounds(bounds)
    return space


def sampler_on(grid: GridMap, **spread: float) -> HeatmapSampler:
    return HeatmapSampler(Heatmap.uniform(grid), seed=1, heading=HeadingSpread(**spread))


@pytest.mark.parametrize("radius", [0.3, 6.0])
@pytest.mark.parametrize("kind", SPACES)
def test_the_turning_radius_is_found(kind: str, radius: float) -> None:
    space = SPACES[kind](radius)
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


@pytest.mark.parametrize("kind", SPACES)
def test_the_goal_is_reached_in_one_arc(kind: str) -> None:
    space = make_space(lambda: SPACES[kind](RADIUS))
    approach = GoalApproach(space, sampler_on(GridMap(np.ones((128, 128), bool))))
    goal, typed_goal = new_state(space, GOAL)
    state, typed = new_state(space, GOAL)
    ahead = 0
    for _ in range(300):
        set_pose(typed, *GOAL)
        approach.move_back(typed)
        # No way is longer than half a circle, and none is shorter than the chord.
        assert space.distance(typed, typed_goal) <= pi * RADIUS + 1e-6
        dx, dy = typed.getX() - GOAL[0], typed.getY() - GOAL[1]
        assert hypot(dx, dy) <= pi * RADIUS
        ahead += dx * cos(GOAL[2]) + dy * sin(GOAL[2]) > 0
    assert ahead == 0 if kind == "Dubins" else 90 < ahead < 210
    del goal, state


def test_blocked_positions_are_not_proposed() -> None:
    free = np.ones((128, 128), bool)
    free[:, :62] = False
    space = make_space(lambda: ob.DubinsStateSpace(RADIUS))
    approach = GoalApproach(space, sampler_on(GridMap(free)))
    handle, typed = new_state(space, (63.0, 64.0, 0.0))
    for _ in range(100):
        set_pose(typed, 63.0, 64.0, 0.0)  # what is behind it is blocked but for a pixel
        approach.move_back(typed)
        assert typed.getX() >= 62.0
    del handle


def test_who_has_no_approach() -> None:
    grid = GridMap(np.ones((128, 128), bool))
    dubins = make_space(lambda: ob.DubinsStateSpace(RADIUS))
    assert goal_approach(dubins, sampler_on(grid)) is not None
    assert goal_approach(dubins, sampler_on(grid, approach_fraction=0)) is None
    assert goal_approach(dubins, sampler_on(grid, uniform_fraction=1)) is None
    assert goal_approach(make_space(ob.SE2StateSpace), sampler_on(grid)) is None
    assert goal_approach(ob.RealVectorStateSpace(2), sampler_on(grid)) is None


class _Wall(ob.StateValidityChecker):  # type: ignore[misc]
    def isValid(self, state: Any) -> bool:  # noqa: N802
        return not 30.0 < state.getX() < 40.0


def make_setup(planner: str) -> Any:
    space = make_space(lambda: ob.ReedsSheppStateSpace(RADIUS))
    setup = og.SimpleSetup(space)
    si = setup.getSpaceInformation()
    setup.setStateValidityChecker(_Wall(si))
    start, goal = new_state(space, (5.0, 5.0, 0.0))[0], new_state(space, GOAL)[0]
    setup.setStartAndGoalStates(start, goal, 0.01)
    setup.setPlanner(getattr(og, planner)(si))
    setup.getPlanner().setRange(4.0)
    return setup


@pytest.mark.parametrize("fraction", [0.0, 1.0])
def test_planners_sample_before_the_goal(fraction: float) -> None:
    setup = make_setup("RRTstar")
    heatmap = Heatmap.uniform(GridMap(np.ones((128, 128), bool)))
    heading = HeadingSpread(approach_fraction=fraction)
    left = iter(range(200))
    with attach(setup, heatmap, seed=1, heading=heading) as attachment:
        setup.solve(compat.termination_condition(lambda: next(left, None) is None))
        counts = attachment.sample_counts
    if fraction == 1:
        assert sum(counts.values()) == 0, "all others are the goal and the way to it"
    else:
        assert sum(counts.values()) > 150


def test_planners_of_poses_have_a_wider_budget() -> None:
    setup = make_setup("RRT")
    budget = budget_of(setup.getPlanner(), sees_nodes=True)
    spent = sum(budget.spend() for _ in range(10 * ADVANCE))
    assert spent == ADVANCE
    budget.earn_by_uniform()
    earned = sum(budget.spend() for _ in range(100))
    assert earned == EARNED_BY_UNIFORM_POSE
