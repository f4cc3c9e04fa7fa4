"""What attach takes, and what it refuses: planners without a setup, other kinds, wrong frames."""

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

from cbagan_ompl import GridMap, Heatmap, PlannerError, TaskError, attach, reached_planners
from cbagan_ompl.planning import compat
from cbagan_ompl.planning.compat import ob, og, ou
from cbagan_ompl.planning.monitor import is_monitored, release_forgotten

GRID = small_walls()
HEATMAP = small_heatmap(GRID)


@pytest.fixture(autouse=True)
def quiet() -> None:
    ou.setLogLevel(ou.LOG_NONE)
    compat.seed_ompl(1)


def make_state(space: Any, point: tuple[float, float]) -> Any:
    state = compat.new_state(space)
    state[0], state[1] = point
    return state


def bare_planner(name: str) -> Any:
    """A planner with a problem definition, as in OMPL's demo of optimal planning."""
    setup = small_setup(GRID, name)
    si, planner = setup.getSpaceInformation(), setup.getPlanner()
    si.setup()
    problem = ob.ProblemDefinition(si)
    problem.setStartAndGoalStates(
        make_state(si.getStateSpace(), SMALL_START),
        make_state(si.getStateSpace(), SMALL_GOAL),
        TOLERANCE,
    )
    problem.setOptimizationObjective(ob.PathLengthOptimizationObjective(si))
    planner.setProblemDefinition(problem)
    planner.setup()
    return planner


def path_end(problem: Any) -> np.ndarray:
    return path_positions(problem.getSolutionPath())[-1]


@pytest.mark.parametrize("name", [n for n in reached_planners() if not n.startswith("SPARS")])
def test_a_planner_without_a_setup(name: str) -> None:
    planner = bare_planner(name)
    problem = planner.getProblemDefinition()
    with attach(planner, HEATMAP, seed=1) as attachment:
        assert attachment.hook == reached_planners()[name]
        planner.solve(0.3)
        assert attachment.sample_counts["learned"] > 10
        if problem.hasExactSolution():
            assert np.hypot(*(path_end(problem) - SMALL_GOAL)) <= TOLERANCE
    seen = attachment.sample_counts
    assert isinstance(problem.getGoal(), ob.GoalState)
    planner.clear()
    planner.solve(0.1)
    assert attachment.sample_counts == seen, "after detach the planner is plain OMPL's"


@pytest.mark.parametrize("name", ["RRT", "RRTstar", "PRM"])
def test_a_planner_without_a_setup_is_let_go_when_it_is_forgotten(name: str) -> None:
    planner = bare_planner(name)
    attachment = attach(planner, HEATMAP)
    release_forgotten()
    assert is_monitored(planner), "both are still there"
    monitor = attachment._monitor
    del attachment
    release_forgotten()
    assert monitor.refers_to(planner), "the planner is still there, and samples the heat map"
    del planner
    attach(bare_planner(name), HEATMAP).detach()
    assert monitor.refers_to(None)


def test_a_planner_needs_its_task() -> None:
    setup = small_setup(GRID, "RRT")
    with pytest.raises(PlannerError, match="setProblemDefinition"):
        attach(og.RRT(setup.getSpaceInformation()), HEATMAP)
    planner = og.RRT(setup.getSpaceInformation())
    planner.setProblemDefinition(ob.ProblemDefinition(setup.getSpaceInformation()))
    with pytest.raises(PlannerError, match="start and the goal"):
        attach(planner, HEATMAP)


class RandomTree(ob.Planner):  # type: ignore[misc]
    """A planner of somebody's own, which does nothing."""

    def __init__(self, si: Any) -> None:
        super().__init__(si, "RandomTree")

    def solve(self, condition: Any) -> Any:
        return ob.PlannerStatus(False, False)


@pytest.mark.parametrize("is_bare", [False, True])
def test_planners_written_in_python_are_refused_with_the_way_out(is_bare: bool) -> None:
    setup = small_setup(GRID, "RRT")
    planner = RandomTree(setup.getSpaceInformation())
    planner.setProblemDefinition(setup.getProblemDefinition())
    setup.setPlanner(planner)
    with pytest.raises(PlannerError, match=r"written in Python.*HeatmapStateSampler"):
        attach(planner if is_bare else setup, HEATMAP)


@pytest.mark.parametrize("name", ["RRT", "PRM"])
def test_a_start_in_an_obstacle_of_the_heat_map_is_refused(name: str) -> None:
    free = np.ones((64, 64), np.bool_)
    free[:10, :10] = False
    with pytest.raises(TaskError, match=r"start \(5\.5, 5\.5\) is in an obstacle of the heat map"):
        attach(small_setup(GRID, name), Heatmap.uniform(GridMap(free)))


def test_pixels_against_metres_are_refused() -> None:
    grid = GridMap(GRID.free, resolution=0.05, origin=(-1.0, -2.0, 0.0))
    setup = small_setup(GRID, "RRTstar")
    with pytest.raises(TaskError, match=r"outside of the heat map's map.*metres"):
        attach(setup, Heatmap.uniform(grid))
    assert isinstance(setup.getGoal(), ob.GoalState)
    with attach(setup, HEATMAP) as attachment:
        solve_for(setup, 100)
        assert attachment.sample_counts["learned"] > 10


def test_one_of_several_starts_in_an_obstacle_is_no_reason_to_refuse() -> None:
    setup = small_setup(GRID, "RRTstar")
    setup.addStartState(make_state(setup.getStateSpace(), (40.5, 10.5)))
    free = GRID.free.copy()
    free[:10, :10] = False
    attach(setup, Heatmap.uniform(GridMap(free))).detach()
