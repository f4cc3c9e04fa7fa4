from __future__ import annotations

from collections.abc import Callable
from functools import partial
from math import inf
from typing import Any

import numpy as np
import pytest
from helpers.setups import path_positions
from helpers.tasks import GOAL, START
from scipy.stats import mannwhitneyu

from cbagan_ompl import (
    GridMap,
    GridMotionValidator,
    GridValidityChecker,
    Heatmap,
    PlannerError,
    attach,
    reached_planners,
)
from cbagan_ompl.planning import compat, hooks
from cbagan_ompl.planning.compat import ob, og, ou
from cbagan_ompl.sampling.options import NO_ADAPTATION

# Planners that the README's table of hooks promises, by whether StateSamplers can be set.
ALWAYS = {"RRT", "RRTstar", "InformedRRTstar", "SORRTstar", "PRM", "PRMstar", "BKPIECE1"}


@pytest.fixture(autouse=True)
def quiet() -> None:
    ou.setLogLevel(ou.LOG_ERROR)


def make_setup(grid: GridMap, planner: str, space: Any = None, threshold: float = 2.0) -> Any:
    space = space or compat.plane_space(*grid.bounds)
    setup = og.SimpleSetup(space)
    si = setup.getSpaceInformation()
    setup.setStateValidityChecker(GridValidityChecker(si, grid))
    if not isinstance(space, ob.DubinsStateSpace | ob.ReedsSheppStateSpace):
        si.setMotionValidator(GridMotionValidator(si, grid))
    start, goal = (make_state(space, *point) for point in (START, GOAL))
    setup.setStartAndGoalStates(start, goal, threshold)
    instance = getattr(og, planner)(si)
    if hasattr(instance, "setRange"):
        instance.setRange(20.0)
    setup.setPlanner(instance)
    return setup


def make_state(space: Any, x: float, y: float) -> Any:
    state = compat.new_state(space)
    if isinstance(space, ob.SE2StateSpace):
        typed = compat.typed_state(state)
        typed.setX(x)
        typed.setY(y)
        typed.setYaw(0.0)
    else:
        state[0], state[1] = x, y
    return state


def until(stop: Callable[[], bool], limit: int = 100_000) -> tuple[Any, list[int]]:
    """A condition that holds when ``stop`` does, and a list whose item counts its evaluations."""
    count = [0]

    def condition() -> bool:
        if stop() or count[0] >= limit:
            return True
        count[0] += 1
        return False

    return compat.termination_condition(condition), count


def path_end(setup: Any) -> np.ndarray:
    return path_positions(setup.getSolutionPath())[-1]


def test_table_of_hooks() -> None:
    reached = reached_planners()
    assert set(reached) >= ALWAYS
    assert reached["PRM"] == reached["BKPIECE1"] == "valid-state-sampler"
    trees = ("RRT", "RRTstar", "InformedRRTstar", "SORRTstar")
    assert {reached[name] for name in trees} == {"goal-injection"}
    sets_samplers = compat.HAS_STATE_SAMPLER_ALLOCATOR
    assert reached["RRTConnect"] == ("state-sampler" if sets_samplers else "bounds-steering")
    assert ("LBKPIECE1" in reached) == sets_samplers


@pytest.mark.parametrize("planner", sorted(reached_planners()))
def test_planner_draws_from_the_heatmap(
    two_walls: GridMap, corridor: Heatmap, planner: str
) -> None:
    compat.seed_ompl(1)
    setup = make_setup(two_walls, planner)
    with attach(setup, corridor, seed=1, adaptation=NO_ADAPTATION) as attachment:
        assert attachment.hook == reached_planners()[planner]
        status = setup.solve(0.4)
        assert attachment.sample_counts["learned"] > 20
        # STRIDE samples around its nodes, half of which lie where the heat map is 0.
        least = 0.5 if planner == "STRIDE" else 1.0
        assert attachment.sample_counts["learned"] > least * attachment.sample_counts["uniform"]
        if compat.is_exact(status):
            path = path_positions(setup.getSolutionPath())
            assert two_walls.path_is_free(path)
            assert np.hypot(*(path[-1] - GOAL)) <= 2.0


@pytest.mark.parametrize("planner", ["RRT", "RRTstar", "InformedRRTstar", "SORRTstar"])
def test_nearly_all_samples_are_ours(two_walls: GridMap, corridor: Heatmap, planner: str) -> None:
    compat.seed_ompl(2)
    setup = make_setup(two_walls, planner)
    with attach(setup, corridor, seed=2, adaptation=NO_ADAPTATION) as attachment:
        condition, iterations = until(lambda: False, limit=1500)
        setup.solve(condition)
        fraction = sum(attachment.sample_counts.values()) / iterations[0]
        assert fraction >= 0.8
        if attachment.hook == "goal-injection":
            assert fraction <= 1
        assert (
            0.85
            < attachment.sample_counts["learned"] / sum(attachment.sample_counts.values())
            < 0.95
        )


def has_solution(planner: Any) -> bool:
    return hasattr(planner, "bestCost") and compat.best_cost(planner) < inf


def first_solutions(grid: GridMap, planner: str, heatmap: Heatmap | None) -> np.ndarray:
    """Iterations to the first solution, one for each of 60 seeds."""
    iterations = []
    for seed in range(60):
        compat.seed_ompl(seed)
        setup = make_setup(grid, planner)
        attachment = (
            None if heatmap is None else attach(setup, heatmap, uniform_fraction=1.0, seed=seed)
        )
        condition, count = until(partial(has_solution, setup.getPlanner()))
        assert compat.is_exact(setup.solve(condition))
        iterations.append(count[0])
        if attachment is not None:
            assert attachment.sample_counts["learned"] == 0
            attachment.detach()
    return np.array(iterations)


@pytest.mark.parametrize("planner", ["RRT", "RRTstar", "InformedRRTstar"])
def test_all_uniform_is_as_good_as_plain_ompl(planner: str) -> None:
    """On a map of thin walls, where uniform over free space is nearly uniform over the bounds.

    OMPL's own samples fall into obstacles too, so that where there are many, ours do better.
    """
    free = np.ones((256, 256), bool)
    free[64:66, :200] = False
    free[154:156, 50:] = False
    grid = GridMap(free)
    plain = first_solutions(grid, planner, None)
    hooked = first_solutions(grid, planner, Heatmap.corridor(grid, START, GOAL))
    assert mannwhitneyu(plain, hooked).pvalue > 0.01, (np.median(plain), np.median(hooked))


def test_informed_costs_match_plain_ompl(two_walls: GridMap) -> None:
    """The informed set is kept: uniform samples through the hook converge like OMPL's own."""
    costs: dict[bool, list[float]] = {False: [], True: []}
    for hooked in costs:
        for seed in range(7):
            compat.seed_ompl(seed)
            setup = make_setup(two_walls, "InformedRRTstar")
            planner = setup.getPlanner()
            uniform = Heatmap.uniform(two_walls)
            attachment = attach(setup, uniform, uniform_fraction=1.0, seed=seed) if hooked else None
            setup.solve(until(lambda: False, limit=2500)[0])
            costs[hooked].append(compat.best_cost(planner))
            if attachment is not None:
                attachment.detach()
    plain, ours = np.median(costs[False]), np.median(costs[True])
    assert abs(ours - plain) < 0.01 * plain


@pytest.mark.parametrize("planner", ["RRT", "RRTstar", "InformedRRTstar"])
def test_simplified_path_still_ends_in_the_goal(
    two_walls: GridMap, corridor: Heatmap, planner: str
) -> None:
    for seed in range(5):
        compat.seed_ompl(seed)
        setup = make_setup(two_walls, planner)
        with attach(setup, corridor, seed=seed) as attachment:
            setup.solve(until(lambda: False, limit=1500)[0])
            counts = attachment.sample_counts
            setup.simplifySolution()
            assert attachment.sample_counts == counts, (
                "the simplifier asks the goal, not the heat map"
            )
            assert np.hypot(*(path_end(setup) - GOAL)) <= 2.0


@pytest.mark.parametrize("planner", ["RRT", "RRTstar", "InformedRRTstar", "PRM"])
def test_solve_again_and_detach(two_walls: GridMap, corridor: Heatmap, planner: str) -> None:
    setup = make_setup(two_walls, planner)
    instance = setup.getPlanner()
    settings = [
        getattr(instance, getter)
        for getter in ("getGoalBias", "getInformedSampling", "getSampleRejection")
        if hasattr(instance, getter)
    ]
    before = [getter() for getter in settings]
    attachment = attach(setup, corridor, seed=0)
    seen = 0
    for _ in range(3):
        setup.clear()
        setup.solve(0.15)
        assert attachment.sample_counts["learned"] > seen, "each run samples"
        seen = attachment.sample_counts["learned"]
    if planner == "InformedRRTstar":
        setup.solve(0.1)
        assert attachment.sample_counts["learned"] > seen, "a run that goes on samples"
    attachment.detach()
    attachment.detach()
    seen = attachment.sample_counts["learned"]
    assert [getter() for getter in settings] == before
    assert setup.getGoal().getThreshold() == 2.0
    setup.clear()
    assert setup.solve(0.5)
    assert attachment.sample_counts["learned"] == seen, "after detach the planner is plain OMPL's"
    assert np.hypot(*(path_end(setup) - GOAL)) <= 2.0


@pytest.mark.parametrize("kind", ["SE2StateSpace", "DubinsStateSpace", "ReedsSheppStateSpace"])
@pytest.mark.parametrize("planner", ["RRT", "RRTstar", "InformedRRTstar", "PRM"])
def test_poses(two_walls: GridMap, corridor: Heatmap, kind: str, planner: str) -> None:
    arguments = () if kind == "SE2StateSpace" else (4.0,)
    space = getattr(ob, kind)(*arguments)
    bounds = ob.RealVectorBounds(2)
    bounds.setLow(0.0)
    bounds.setHigh(256.0)
    space.setBounds(bounds)
    setup = make_setup(two_walls, planner, space)
    with attach(setup, corridor, seed=0, adaptation=NO_ADAPTATION) as attachment:
        setup.solve(0.4)
        # PRM ends with its first path, after a few dozen samples.
        assert attachment.sample_counts["learned"] > (10 if planner == "PRM" else 50)
        assert attachment.sample_counts["learned"] > attachment.sample_counts["uniform"]
        path = setup.getSolutionPath()
        yaws = [path.getState(i).getYaw() for i in range(path.getStateCount())]
        assert path.getStateCount() < 3 or np.std(yaws) > 0.01


def test_unreached_planners_say_what_would_reach_them(
    two_walls: GridMap, corridor: Heatmap
) -> None:
    with pytest.raises(PlannerError, match=r"no hook reaches BITstar.*heat maps reach .*RRTstar"):
        hooks.hook_of("BITstar")
    if "EITstar" in compat.planner_names():
        with pytest.raises(PlannerError, match="no hook reaches EITstar"):
            attach(make_setup(two_walls, "EITstar"), corridor)
    if not compat.HAS_STATE_SAMPLER_ALLOCATOR:
        with pytest.raises(PlannerError, match=r"setStateSamplerAllocator, such as ompl 1\.7\.0"):
            attach(make_setup(two_walls, "LBKPIECE1"), corridor)


def test_a_build_that_binds_the_allocator_uses_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(hooks, "HAS_STATE_SAMPLER_ALLOCATOR", True)
    assert hooks.hook_of("RRTsharp") == hooks.hook_of("RRTConnect") == "state-sampler"


def test_attach_needs_planner_and_task(two_walls: GridMap, corridor: Heatmap) -> None:
    setup = og.SimpleSetup(compat.plane_space(*two_walls.bounds))
    with pytest.raises(PlannerError, match="setPlanner"):
        attach(setup, corridor)
    setup.setPlanner(og.RRT(setup.getSpaceInformation()))
    with pytest.raises(PlannerError, match="start and the goal"):
        attach(setup, corridor)


def test_other_spaces_raise(corridor: Heatmap) -> None:
    space = ob.RealVectorStateSpace(3)
    bounds = ob.RealVectorBounds(3)
    bounds.setLow(0.0)
    bounds.setHigh(1.0)
    space.setBounds(bounds)
    setup = og.SimpleSetup(space)
    setup.setPlanner(og.RRT(setup.getSpaceInformation()))
    endpoints = compat.new_state(space), compat.new_state(space)
    for endpoint, value in zip(endpoints, (0.1, 0.9), strict=True):
        for axis in range(3):
            endpoint[axis] = value
    setup.setStartAndGoalStates(*endpoints)
    with pytest.raises(PlannerError, match="RealVectorStateSpace of dimension 3"):
        attach(setup, corridor)


def test_subclass_of_a_planner_is_known_by_its_base(two_walls: GridMap, corridor: Heatmap) -> None:
    class MyRRT(og.RRT):  # type: ignore[misc]
        pass

    setup = make_setup(two_walls, "RRT")
    instance = MyRRT(setup.getSpaceInformation())
    instance.setRange(20.0)
    setup.setPlanner(instance)
    with attach(setup, corridor, seed=0) as attachment:
        setup.solve(0.2)
        assert attachment.sample_counts["learned"] > 20


@pytest.mark.parametrize("planner", ["RRT", "RRTstar"])
def test_same_seed_same_poses(two_walls: GridMap, corridor: Heatmap, planner: str) -> None:
    """Headings come from the same generator as positions."""
    runs = []
    for _ in range(2):
        compat.seed_ompl(3)
        space = ob.SE2StateSpace()
        bounds = ob.RealVectorBounds(2)
        bounds.setLow(0.0)
        bounds.setHigh(256.0)
        space.setBounds(bounds)
        setup = make_setup(two_walls, planner, space)
        with attach(setup, corridor, seed=3):
            setup.solve(until(lambda: False, limit=150)[0])
            path = setup.getSolutionPath()
            states = [path.getState(i) for i in range(path.getStateCount())]
            runs.append([(s.getX(), s.getY(), s.getYaw()) for s in states])
    assert runs[0] == runs[1]


@pytest.mark.skipif(not compat.HAS_STATE_SAMPLER_ALLOCATOR, reason="not reached by this build")
@pytest.mark.parametrize("planner", sorted(filter(hooks.keeps_sampler, hooks.PLANNERS)))
def test_planners_that_keep_their_sampler_are_reached_when_set_up(
    two_walls: GridMap, corridor: Heatmap, planner: str
) -> None:
    setup = make_setup(two_walls, planner)
    setup.setup()
    with attach(setup, corridor, seed=0) as attachment:
        setup.solve(0.1)
        seen = attachment.sample_counts
        assert seen["learned"] > 20
    setup.solve(0.1)
    assert attachment.sample_counts == seen, "after detach the planner is plain OMPL's"


@pytest.mark.parametrize("planner", ["RRT", "RRTstar", "InformedRRTstar", "PRM"])
def test_attach_after_a_solve(two_walls: GridMap, corridor: Heatmap, planner: str) -> None:
    """Samplers and solutions of an earlier run do not keep the planner from drawing."""
    setup = make_setup(two_walls, planner)
    setup.solve(0.1)
    with attach(setup, corridor, seed=0, adaptation=NO_ADAPTATION) as attachment:
        setup.solve(0.2)
        assert attachment.sample_counts["learned"] > 20


def test_attach_with_informed_sampling_of_rrtstar(two_walls: GridMap, corridor: Heatmap) -> None:
    setup = make_setup(two_walls, "RRTstar")
    setup.getPlanner().setInformedSampling(True)
    with attach(setup, corridor, seed=0) as attachment:
        setup.solve(0.2)
        assert attachment.sample_counts["learned"] > 20
    assert setup.getPlanner().getInformedSampling()


def test_attach_twice_raises(two_walls: GridMap, corridor: Heatmap) -> None:
    setup = make_setup(two_walls, "RRTstar")
    attachment = attach(setup, corridor)
    with pytest.raises(PlannerError, match="detach"):
        attach(setup, corridor)
    attachment.detach()
    attach(setup, corridor).detach()


def test_planner_cleared_alone_draws_again(two_walls: GridMap, corridor: Heatmap) -> None:
    setup = make_setup(two_walls, "RRT")
    with attach(setup, corridor, seed=0) as attachment:
        setup.solve(0.5)
        seen = attachment.sample_counts["learned"]
        setup.getPlanner().clear()
        assert compat.is_exact(setup.solve(2.0))
        assert attachment.sample_counts["learned"] > seen


@pytest.mark.parametrize("planner", ["RRT", "InformedRRTstar"])
def test_detach_leaves_a_new_goal_alone(
    two_walls: GridMap, corridor: Heatmap, planner: str
) -> None:
    setup = make_setup(two_walls, planner)
    attachment = attach(setup, corridor)
    setup.solve(0.1)
    setup.clear()
    space = setup.getStateSpace()
    new = make_state(space, 10.0, 40.0)
    setup.setGoalState(new, 2.0)
    attachment.detach()
    assert compat.is_exact(setup.solve(1.0))
    assert np.hypot(*(path_end(setup) - (10, 40))) <= 2


def test_attach_needs_a_start_and_a_goal_to_sample(two_walls: GridMap, corridor: Heatmap) -> None:
    setup = make_setup(two_walls, "RRT")
    setup.getProblemDefinition().clearStartStates()
    with pytest.raises(PlannerError, match="start and the goal"):
        attach(setup, corridor)

    class Near(ob.GoalRegion):  # type: ignore[misc]
        def distanceGoal(self, state: Any) -> float:  # noqa: N802
            return abs(state[0] - 200.0)

    setup = make_setup(two_walls, "RRT")
    setup.setGoal(Near(setup.getSpaceInformation()))
    with pytest.raises(PlannerError, match="goal that can be sampled"):
        attach(setup, corridor)


def test_several_starts_and_goals(two_walls: GridMap, corridor: Heatmap) -> None:
    setup = make_setup(two_walls, "InformedRRTstar")
    si, space = setup.getSpaceInformation(), setup.getStateSpace()
    setup.addStartState(make_state(space, 30.0, 30.0))
    goals = ob.GoalStates(si)
    goals.setThreshold(2.0)
    keep = [make_state(space, x, 240.0) for x in (200.0, 240.0)]
    for goal in keep:
        goals.addState(goal)
    setup.setGoal(goals)
    with attach(setup, corridor, seed=0) as attachment:
        assert compat.is_exact(setup.solve(0.5))
        assert attachment.sample_counts["learned"] > 100
        end = path_end(setup)
        assert min(np.hypot(*(end - (x, 240))) for x in (200, 240)) <= 2
