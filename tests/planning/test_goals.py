"""Goals while a planner is attached: several, none yet, other ones."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from helpers.setups import (
    SMALL_GOAL,
    SMALL_START,
    TOLERANCE,
    path_positions,
    small_heatmap,
    small_setup,
    small_walls,
    solve_for,
)

from cbagan_ompl import Heatmap, PlannerError, attach
from cbagan_ompl.planning import compat
from cbagan_ompl.planning.compat import ob, ou

GRID = small_walls()
HEATMAP = small_heatmap(GRID)
INJECTED = ["RRT", "RRTstar", "InformedRRTstar", "SORRTstar"]
NEW_START, NEW_GOAL = (58.5, 10.5), (20.5, 58.5)


@pytest.fixture(autouse=True)
def quiet() -> None:
    ou.setLogLevel(ou.LOG_NONE)
    compat.seed_ompl(1)


def make_state(setup: Any, point: tuple[float, float]) -> Any:
    state = compat.new_state(setup.getStateSpace())
    state[0], state[1] = point
    return state


def path_end(setup: Any) -> np.ndarray:
    return path_positions(setup.getSolutionPath())[-1]


@pytest.mark.parametrize("planner", INJECTED)
@pytest.mark.parametrize("is_cleared", [True, False])
def test_a_goal_that_was_replaced_is_noticed(planner: str, is_cleared: bool) -> None:
    setup = small_setup(GRID, planner)
    attachment = attach(setup, HEATMAP, seed=1)
    solve_for(setup, 400)
    if is_cleared:
        setup.clear()
    setup.setStartAndGoalStates(
        make_state(setup, NEW_START), make_state(setup, NEW_GOAL), TOLERANCE
    )
    with pytest.raises(PlannerError, match=r"goal was replaced.*attach again"):
        solve_for(setup, 10)
    attachment.detach()
    setup.clear()
    with attach(setup, Heatmap.corridor(GRID, NEW_START, NEW_GOAL), seed=1):
        assert compat.is_exact(solve_for(setup, 3000))
        assert np.hypot(*(path_end(setup) - NEW_GOAL)) <= TOLERANCE


@pytest.mark.skipif(not compat.BOOST_PYTHON, reason="planners take no attributes")
def test_a_goal_that_was_replaced_is_noticed_by_the_planners_own_solve() -> None:
    setup = small_setup(GRID, "RRT")
    setup.setup()
    planner = setup.getPlanner()
    with attach(planner, HEATMAP, seed=1):
        setup.getProblemDefinition().setGoal(small_setup(GRID, "RRT").getGoal())
        with pytest.raises(PlannerError, match="goal was replaced"):
            solve_for(planner, 10)
    assert "solve" not in vars(planner)


def test_a_new_task_with_a_sampler_is_served() -> None:
    setup = small_setup(GRID, "PRM")
    with attach(setup, Heatmap.uniform(GRID), seed=1) as attachment:
        setup.solve(1.0)
        seen = attachment.sample_counts["learned"]
        setup.clear()
        setup.setStartAndGoalStates(
            make_state(setup, NEW_START), make_state(setup, NEW_GOAL), TOLERANCE
        )
        assert compat.is_exact(setup.solve(2.0))
        assert attachment.sample_counts["learned"] > seen
        assert np.hypot(*(path_end(setup) - NEW_GOAL)) <= TOLERANCE


@pytest.mark.parametrize("planner", INJECTED)
def test_a_new_start_is_served(planner: str) -> None:
    setup = small_setup(GRID, planner)
    with attach(setup, Heatmap.uniform(GRID), seed=1):
        solve_for(setup, 300)
        setup.clear()
        setup.getProblemDefinition().clearStartStates()
        setup.addStartState(make_state(setup, NEW_START))
        assert compat.is_exact(solve_for(setup, 3000))
        assert path_positions(setup.getSolutionPath())[0].tolist() == list(NEW_START)


@pytest.mark.parametrize("planner", INJECTED)
def test_the_getters_of_the_goal_answer(planner: str) -> None:
    setup = small_setup(GRID, planner)
    before = setup.getGoal()
    with attach(setup, HEATMAP):
        goal = setup.getGoal()
        state = goal.getState()
        assert (state[0], state[1]) == SMALL_GOAL
        assert goal.getThreshold() == before.getThreshold()
        assert goal.maxSampleCount() == 1
        with pytest.raises(AttributeError):
            goal.getStateCount()


def test_a_goal_state_that_moves_is_served() -> None:
    """Its setter is that of the goal itself."""
    setup = small_setup(GRID, "RRTstar")
    with attach(setup, Heatmap.uniform(GRID), seed=1):
        setup.getGoal().setState(make_state(setup, NEW_GOAL))
        assert compat.is_exact(solve_for(setup, 3000))
        assert np.hypot(*(path_end(setup) - NEW_GOAL)) <= TOLERANCE


@pytest.mark.parametrize("planner", INJECTED)
def test_states_of_the_goal_that_come_later(planner: str) -> None:
    setup = small_setup(GRID, planner)
    goals = ob.GoalStates(setup.getSpaceInformation())
    goals.setThreshold(TOLERANCE)
    first = make_state(setup, (58.5, 5.5))
    goals.addState(first)
    setup.setGoal(goals)
    second = make_state(setup, SMALL_GOAL)
    with attach(setup, HEATMAP, seed=1):
        assert setup.getGoal().getStateCount() == 1
        setup.getGoal().addState(second)
        assert compat.is_exact(solve_for(setup, 3000))
        ends = path_end(setup) - ((58.5, 5.5), SMALL_GOAL)
        assert np.hypot(*ends.T).min() <= TOLERANCE


class LateGoal(ob.GoalSampleableRegion):  # type: ignore[misc]
    """A goal that has no samples at first; asking for one then is an error."""

    def __init__(self, si: Any, late_by: int) -> None:
        super().__init__(si)
        self.setThreshold(TOLERANCE)
        self._left = late_by
        self.count = 0

    def distanceGoal(self, state: Any) -> float:  # noqa: N802
        self._left -= 1
        return float(np.hypot(state[0] - SMALL_GOAL[0], state[1] - SMALL_GOAL[1]))

    def maxSampleCount(self) -> int:  # noqa: N802
        return int(self._left <= 0)

    def couldSample(self) -> bool:  # noqa: N802
        return True

    def sampleGoal(self, state: Any) -> None:  # noqa: N802
        if self._left > 0:
            raise RuntimeError("there are no samples yet")
        self.count += 1
        state[0], state[1] = SMALL_GOAL


@pytest.mark.parametrize("planner", ["RRT", "RRTstar"])
def test_a_goal_without_samples_yet(planner: str) -> None:
    setup = small_setup(GRID, planner)
    goal = LateGoal(setup.getSpaceInformation(), 40)
    setup.setGoal(goal)
    with attach(setup, HEATMAP, seed=1) as attachment:
        assert compat.is_exact(solve_for(setup, 3000))
        assert goal.count > 0
        assert attachment.sample_counts["learned"] > 40
        assert np.hypot(*(path_end(setup) - SMALL_GOAL)) <= TOLERANCE


def test_starts_are_those_of_the_small_task() -> None:
    setup = small_setup(GRID, "RRT")
    read = compat.valid_starts(
        setup.getProblemDefinition(), setup.getSpaceInformation(), lambda s: (s[0], s[1])
    )
    assert read == [SMALL_START]
    assert isinstance(setup.getGoal(), ob.GoalState)
