"""Planners other than the attached one get the goal itself."""

from __future__ import annotations

import subprocess
import sys
from typing import Any

import numpy as np
import pytest
from helpers.setups import (
    SMALL_GOAL,
    TOLERANCE,
    path_positions,
    small_heatmap,
    small_setup,
    small_walls,
    solve_for,
)

from cbagan_ompl import PlannerError, attach
from cbagan_ompl.planning import compat
from cbagan_ompl.planning.compat import ob, og, ou
from cbagan_ompl.planning.hooks import asks_in_thread

GRID = small_walls()
HEATMAP = small_heatmap(GRID)

# SPARS crashes by itself with any goal written in Python unless the setup knows of it; EITstar and
# SST take their whole time.
OTHERS = sorted(
    name
    for name in compat.planner_names()
    if not asks_in_thread(name) and not name.startswith("Lazy") and name not in ("EITstar", "SST")
)


@pytest.fixture(autouse=True)
def quiet() -> None:
    ou.setLogLevel(ou.LOG_NONE)


def prepare(attached: str, state: str) -> tuple[Any, Any]:
    """A setup with an attached planner that has done something, and the attachment."""
    compat.seed_ompl(3)
    setup = small_setup(GRID, attached)
    attachment = attach(setup, HEATMAP, seed=3)
    if state == "solved":
        solve_for(setup, 2000 if attached == "RRT" else 300)
        assert setup.haveExactSolutionPath()
        setup.getProblemDefinition().clearSolutionPaths()
    elif state != "new":
        setup.getPlanner().setRange(2.0)
        solve_for(setup, 60)
        assert not setup.haveExactSolutionPath()
        setup.getProblemDefinition().clearSolutionPaths()
        if state == "cleared":
            setup.clear()
    return setup, attachment


def solve_other(setup: Any, planner: str, how: str, time: float = 0.1) -> Any:
    """Let another planner plan to the goal of a setup; return the problem definition."""
    if how == "second setup":
        other = small_setup(GRID, planner)
        other.setGoal(setup.getGoal())
        other.solve(time)
        return other.getProblemDefinition()
    instance = getattr(og, planner)(setup.getSpaceInformation())
    problem = setup.getProblemDefinition()
    if how == "set":
        setup.setPlanner(instance)
        setup.solve(time)
    else:
        instance.setProblemDefinition(problem)
        instance.setup()
        instance.solve(time)
    return problem


@pytest.mark.parametrize("attached", ["RRT", "RRTstar", "InformedRRTstar"])
@pytest.mark.parametrize("how", ["set", "direct", "second setup"])
@pytest.mark.parametrize("state", ["new", "solved", "unsolved", "cleared"])
def test_another_planner_gets_the_goal_itself(attached: str, how: str, state: str) -> None:
    for planner in OTHERS:
        setup, attachment = prepare(attached, state)
        ours, counts = setup.getPlanner(), attachment.sample_counts
        problem = solve_other(setup, planner, how)
        assert attachment.sample_counts == counts, planner
        if problem.hasExactSolution():
            end = path_positions(problem.getSolutionPath())[-1]
            assert np.hypot(*(end - SMALL_GOAL)) <= TOLERANCE, planner
        # The attached planner samples the heat map again, and the goal is reached.
        setup.setPlanner(ours)
        setup.clear()
        solve_for(setup, 100)
        assert sum(attachment.sample_counts.values()) > sum(counts.values()), planner
        attachment.detach()


@pytest.mark.parametrize("planner", ["PRM", "PRMstar"])
@pytest.mark.parametrize("how", ["set", "direct", "second setup"])
@pytest.mark.parametrize("attached", ["RRT", "RRTstar"])
def test_planners_that_ask_in_a_thread_are_refused(attached: str, how: str, planner: str) -> None:
    setup, attachment = prepare(attached, "unsolved")
    with pytest.raises(PlannerError, match=r"thread of its own.*detach"):
        solve_other(setup, planner, how)
    attachment.detach()
    assert not isinstance(setup.getGoal(), type(None))
    problem = solve_other(setup, planner, "set", time=1)
    assert problem.hasExactSolution(), "after detach any planner plans to the goal"


@pytest.mark.parametrize("attached", ["RRT", "RRTstar"])
def test_a_solve_that_goes_on_samples_the_heat_map(attached: str) -> None:
    setup, attachment = prepare(attached, "new")
    setup.getPlanner().setRange(1.0)
    seen = 0
    for _ in range(4):
        solve_for(setup, 60)
        drawn = sum(attachment.sample_counts.values())
        assert drawn - seen > 20
        seen = drawn
    attachment.detach()


def test_rrt_that_has_a_path_ends_in_the_goal_when_asked_again() -> None:
    setup, attachment = prepare("RRT", "new")
    for _ in range(5):
        assert compat.is_exact(setup.solve(1.0))
        end = path_positions(setup.getSolutionPath())[-1]
        assert np.hypot(*(end - SMALL_GOAL)) <= TOLERANCE
    attachment.detach()


def test_samples_by_hand_are_those_of_the_goal() -> None:
    setup, attachment = prepare("RRT", "unsolved")
    state = compat.new_state(setup.getStateSpace())
    typed = compat.typed_state(state)
    for _ in range(50):
        setup.getGoal().sampleGoal(typed)
        assert (typed[0], typed[1]) == SMALL_GOAL
    assert setup.getGoal().maxSampleCount() == 1
    attachment.detach()


def test_a_planner_that_ompl_has_chosen_is_reached() -> None:
    """OMPL 1.x makes a new Python object at each call for it."""
    compat.seed_ompl(1)
    setup = small_setup(GRID, "RRT")
    problem_setup = og.SimpleSetup(setup.getSpaceInformation())
    if not compat.BOOST_PYTHON:  # which chooses one that is reached by itself
        problem_setup.setPlannerAllocator(og.RRT)
    start = compat.new_state(setup.getStateSpace())
    start[0], start[1] = 5.5, 5.5
    problem_setup.addStartState(start)
    problem_setup.setGoal(setup.getGoal())
    problem_setup.setup()
    with attach(problem_setup, HEATMAP, seed=1) as attachment:
        with pytest.raises(PlannerError, match="detach"):
            attach(problem_setup, HEATMAP)
        problem_setup.solve(1.0)
        assert attachment.sample_counts["learned"] > 0
    assert isinstance(problem_setup.getGoal(), ob.GoalState)


FREE_LINE = """
import numpy as np
import cbagan_ompl
grid = cbagan_ompl.GridMap(np.ones((64, 64), bool))
pocket = np.zeros((64, 64))
pocket[:3, :3] = 1  # nothing of it in the informed set
ways = [{"sampler": name} for name in ("uniform", "straight-line", "corridor", "learned")]
for seed in range(1):
    for way in [*ways, {"heatmap": pocket}]:
        for tolerance in (0, 1e-6, None, 60):  # with the last the start is in the goal region
            result = cbagan_ompl.plan(
                grid, (5.5, 5.5), (50.2, 40.3), "SORRTstar", time=1.0, seed=seed,
                goal_tolerance=tolerance, **way
            )
            assert result.solved and result.cost < 1.01 * np.hypot(44.7, 34.8), result
print("done")
"""

BENCHMARK_OF_FREE_LINE = """
import numpy as np
import cbagan_ompl
from cbagan_ompl import Heatmap
from cbagan_ompl.planning.ompl_benchmark import PlannerVariant, RunOptions, run_benchmark
from cbagan_ompl.planning.workspace import Workspace
grid = cbagan_ompl.GridMap(np.ones((64, 64), bool))
variants = [PlannerVariant(p, "uniform", None) for p in ("SORRTstar", "RRTstar")]
variants += [PlannerVariant("SORRTstar", "corridor", Heatmap.corridor)]
ends = grid.check_task((5.5, 5.5), (50.2, 40.3))
recording = run_benchmark("x", Workspace(grid), ends, variants, RunOptions(2, 0.2))
costs = {name: [run.cost for run in runs] for name, runs in recording.runs.items()}
for sampler in ("uniform", "corridor"):
    assert max(costs["SORRTstar_" + sampler]) < 1.01 * np.hypot(44.7, 34.8), costs
print("done")
"""


@pytest.mark.parametrize("script", [FREE_LINE, BENCHMARK_OF_FREE_LINE], ids=["plan", "benchmark"])
def test_sorrtstar_ends_where_the_straight_line_is_free(script: str) -> None:
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, timeout=300, check=False
    )
    assert done.stdout.endswith("done\n"), done.stderr
