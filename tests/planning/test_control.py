"""Planners of ompl.control: which are reached, and that they plan with samples of the heat map."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from math import cos, hypot, pi, sin
from typing import Any

import numpy as np
import pytest
from helpers.setups import SMALL_GOAL, SMALL_START, small_heatmap, small_walls, solve_for

from cbagan_ompl import (
    CbaganOmplWarning,
    GridMap,
    GridValidityChecker,
    Heatmap,
    HeatmapStateSampler,
    PlannerError,
    Robot,
    RobotValidityChecker,
    attach,
    reached_control_planners,
)
from cbagan_ompl.planning import compat
from cbagan_ompl.planning.compat import ob, og, ou
from cbagan_ompl.planning.monitor import is_monitored

GRID = small_walls()
HEATMAP = small_heatmap(GRID)
TOLERANCE = 4.0
REACHED = {
    "control.EST": "valid-state-sampler",
    "control.RRT": "goal-injection",
    **(
        {"control.PDST": "state-sampler", "control.SST": "state-sampler"}
        if compat.HAS_STATE_SAMPLER_ALLOCATOR
        else {}
    ),
}


@pytest.fixture(autouse=True)
def quiet() -> None:
    ou.setLogLevel(ou.LOG_NONE)
    compat.seed_ompl(1)


def bounds_of(*limits: tuple[float, float]) -> Any:
    return compat.plane_bounds(*zip(*limits, strict=True))


def positions() -> Any:
    return compat.plane_space(*GRID.bounds)


def poses() -> Any:
    return compat.make_pose_space("SE2StateSpace", None, *map(np.asarray, GRID.bounds))


def with_velocities(part: Any) -> Any:
    velocities = ob.RealVectorStateSpace(2)
    velocities.setBounds(bounds_of((-2.0, 2.0), (-2.0, 2.0)))
    space = ob.CompoundStateSpace()
    space.addSubspace(part, 1.0)
    space.addSubspace(velocities, 0.1)
    return space


def drive_point(state: Any, control: Any, duration: float, result: Any) -> None:
    result[0] = state[0] + control[0] * duration
    result[1] = state[1] + control[1] * duration


def drive_car(state: Any, control: Any, duration: float, result: Any) -> None:
    yaw, way = state.getYaw(), (control[0] + 2.0) * duration
    x, y = state.getX() + way * cos(yaw), state.getY() + way * sin(yaw)
    result.setX(x)
    result.setY(y)
    result.setYaw((yaw + control[1] / 4 * way + pi) % (2 * pi) - pi)


def push_point(state: Any, control: Any, duration: float, result: Any) -> None:
    for axis in range(2):
        speed = state[1][axis]
        faster = min(max(speed + control[axis] * duration, -2.0), 2.0)
        result[0][axis] = state[0][axis] + (speed + faster) / 2 * duration
        result[1][axis] = faster


def push_car(state: Any, control: Any, duration: float, result: Any) -> None:
    faster = min(max(state[1][0] + control[0] * duration, -2.0), 2.0)
    drive_car(state[0], (faster - 1.0, control[1]), duration, result[0])
    result[1][0] = faster
    result[1][1] = 0.0


SPACES: dict[str, tuple[Callable[[], Any], Any]] = {
    "R2": (positions, drive_point),
    "SE2": (poses, drive_car),
    "R2 and velocities": (lambda: with_velocities(positions()), push_point),
    "SE2 and velocities": (lambda: with_velocities(poses()), push_car),
}


def make_state(space: Any, point: tuple[float, float]) -> Any:
    handle = compat.new_state(space)
    state = compat.typed_state(handle)
    is_compound = isinstance(space, ob.CompoundStateSpace) and not isinstance(
        space, ob.SE2StateSpace
    )
    part = state[0] if is_compound else state
    if hasattr(part, "setX"):
        part.setX(point[0])
        part.setY(point[1])
        part.setYaw(1.0)
    else:
        part[0], part[1] = point
    if is_compound:
        state[1][0] = state[1][1] = 0.0
    return handle


def control_setup(
    planner: str = "RRT", kind: str = "SE2", controls: int | None = None, grid: GridMap = GRID
) -> Any:
    from ompl import control as oc

    make_space, propagate = SPACES[kind]
    space = make_space()
    control_space = oc.RealVectorControlSpace(space, 2)
    control_space.setBounds(bounds_of((-1.0, 1.0), (-1.0, 1.0)))
    setup = oc.SimpleSetup(control_space)
    si = setup.getSpaceInformation()
    setup.setStateValidityChecker(GridValidityChecker(si, grid))
    setup.setStatePropagator(getattr(oc, "StatePropagatorFn", lambda same: same)(propagate))
    si.setPropagationStepSize(0.5)
    si.setMinMaxControlDuration(1, 20)
    if controls is not None:
        si.setDirectedControlSamplerAllocator(
            oc.DirectedControlSamplerAllocator(
                lambda si: oc.SimpleDirectedControlSampler(si, controls)
            )
        )
    start, goal = make_state(space, SMALL_START), make_state(space, SMALL_GOAL)
    setup.setStartAndGoalStates(start, goal, TOLERANCE)
    setup.setPlanner(getattr(oc, planner.removeprefix("control."))(si))
    return setup


def attach_quietly(setup: Any, heatmap: Heatmap = HEATMAP, **options: Any) -> Any:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", CbaganOmplWarning)
        return attach(setup, heatmap, seed=1, **options)


def tree_positions(setup: Any) -> np.ndarray:
    from cbagan_ompl.planning.states import state_access

    data = compat.planner_data(setup.getPlanner())
    read = state_access(setup.getStateSpace()).read
    return np.array([read(data.getVertex(i).getState()) for i in range(data.numVertices())])


def test_which_planners_are_reached() -> None:
    assert reached_control_planners() == REACHED


@pytest.mark.parametrize("name", sorted(REACHED))
def test_planner_samples_the_heat_map(name: str) -> None:
    setup = control_setup(name)
    own = type(setup.getGoal())
    with attach_quietly(setup) as attachment:
        assert attachment.hook == REACHED[name]
        solve_for(setup, 2000)
        counts = attachment.sample_counts
        assert counts["learned"] > 100
        assert counts["uniform"] > 10
    assert type(setup.getGoal()) is own
    setup.clear()
    solve_for(setup, 200)
    assert attachment.sample_counts == counts, "after detach the planner is plain OMPL's"


@pytest.mark.parametrize("kind", SPACES)
def test_paths_end_in_the_goal(kind: str) -> None:
    setup = control_setup(kind=kind)
    with attach(setup, HEATMAP, seed=1) as attachment:
        assert compat.is_exact(solve_for(setup, 20_000))
        assert attachment.sample_counts["learned"] > 20
        states = setup.getSolutionPath().getStates()
        read = attachment._monitor._states.read
        path = [read(states[k]) for k in range(len(states))]
    assert path[0] == SMALL_START
    assert hypot(*np.subtract(path[-1], SMALL_GOAL)) <= TOLERANCE
    assert GRID.is_free(np.array(path)).all()


def test_the_heat_map_saves_iterations() -> None:
    def mean_iterations(heatmap: Heatmap | None) -> float:
        counts = []
        for seed in range(10):
            compat.seed_ompl(seed)
            setup = control_setup(kind="R2")
            if heatmap is not None:
                attach(setup, heatmap, seed=seed)
            assert compat.is_exact(solve_for(setup, 20_000))
            counts.append(len(tree_positions(setup)))
        return float(np.mean(counts))

    assert mean_iterations(HEATMAP) < 0.85 * mean_iterations(None)


def test_rectangles_are_checked_in_control_spaces() -> None:
    setup = control_setup("RRT", "SE2")
    si = setup.getSpaceInformation()
    robot = Robot.rectangle(3, 2)
    checker = RobotValidityChecker(si, GRID, robot)
    setup.setStateValidityChecker(checker)
    heatmap = Heatmap.corridor(GRID, SMALL_START, SMALL_GOAL, robot=robot)
    with attach(setup, heatmap, seed=1) as attachment:
        assert compat.is_exact(solve_for(setup, 20_000))
        states = setup.getSolutionPath().getStates()
        assert all(checker.isValid(states[k]) for k in range(len(states)))
        assert attachment.sample_counts["learned"] > 20


@pytest.mark.parametrize("kind", ["R2", "SE2 and velocities"])
def test_velocities_are_sampled_uniformly(kind: str) -> None:
    space = SPACES[kind][0]()
    sampler = HeatmapStateSampler(space, HEATMAP, seed=0)
    handle = compat.new_state(space)
    state = compat.typed_state(handle)
    speeds = []
    for _ in range(300):
        sampler.sampleUniform(state)
        point = (state[0], state[1]) if kind == "R2" else (state[0].getX(), state[0].getY())
        assert GRID.is_free(point)
        if kind != "R2":
            speeds.append(state[1][0])
    if speeds:
        assert min(speeds) < -1.5
        assert max(speeds) > 1.5


def test_planners_that_are_not_reached_say_so() -> None:
    with pytest.raises(
        PlannerError, match=r"reaches control\.KPIECE1: it samples controls.*control\.RRT"
    ):
        attach(control_setup("KPIECE1"), HEATMAP)


@pytest.mark.parametrize("name", ["EST", "PDST"])
def test_samples_that_make_no_difference_are_warned_of(name: str) -> None:
    """Control samplers that try a single control do not look where it is to lead."""
    if f"control.{name}" not in REACHED:
        pytest.skip("not in this build")
    setup = control_setup(name)
    with pytest.warns(CbaganOmplWarning, match="single control"):
        attach(setup, HEATMAP).detach()
    if not compat.HAS_STATE_SAMPLER_ALLOCATOR:
        return  # no other sampler of controls can be set
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        attach(control_setup(name, controls=5), HEATMAP).detach()


def test_planner_and_setup_are_of_one_kind() -> None:
    setup = control_setup()
    setup.setPlanner(og.RRT(setup.getSpaceInformation()))
    with pytest.raises(PlannerError, match="not of one kind"):
        attach(setup, HEATMAP)


def test_a_planner_without_a_setup_and_one_that_is_subclassed() -> None:
    from ompl import control as oc

    class MyRRT(oc.RRT):  # type: ignore[misc]
        pass

    setup = control_setup()
    setup.setup()
    planner = MyRRT(setup.getSpaceInformation())
    planner.setProblemDefinition(setup.getProblemDefinition())
    planner.setup()
    with attach(planner, HEATMAP, seed=1) as attachment:
        solve_for(planner, 500)
        assert attachment.sample_counts["learned"] > 50
    with pytest.raises(PlannerError, match="setProblemDefinition"):
        attach(oc.RRT(setup.getSpaceInformation()), HEATMAP)


def test_a_setup_without_planner_or_task() -> None:
    from ompl import control as oc

    setup = oc.SimpleSetup(oc.RealVectorControlSpace(positions(), 2))
    with pytest.raises(PlannerError, match="setPlanner"):
        attach(setup, HEATMAP)
    setup.setPlanner(oc.RRT(setup.getSpaceInformation()))
    with pytest.raises(PlannerError, match="start and the goal"):
        attach(setup, HEATMAP)


def test_attached_twice_and_forgotten() -> None:
    setup = control_setup()
    attachment = attach(setup, HEATMAP)
    with pytest.raises(PlannerError, match="already"):
        attach(setup, HEATMAP)
    monitor = attachment._monitor
    assert is_monitored(setup.getPlanner())
    del attachment, setup
    attach(control_setup(), HEATMAP).detach()
    assert monitor.refers_to(None)


def test_a_goal_that_was_replaced_is_noticed() -> None:
    setup = control_setup()
    with attach(setup, HEATMAP):
        setup.setGoalState(make_state(setup.getStateSpace(), (30.5, 30.5)), 3.0)
        with pytest.raises(PlannerError, match="goal was replaced"):
            setup.solve(0.1)


def test_errors_of_the_propagator_leave_the_solve() -> None:
    from ompl import control as oc

    setup = control_setup()

    def fail(state: Any, control: Any, duration: float, result: Any) -> None:
        raise ZeroDivisionError("in the propagator")

    with attach(setup, HEATMAP, seed=1) as attachment:
        setup.setStatePropagator(getattr(oc, "StatePropagatorFn", lambda same: same)(fail))
        with pytest.raises(ZeroDivisionError, match="in the propagator"):
            solve_for(setup, 50)
    setup.setStatePropagator(getattr(oc, "StatePropagatorFn", lambda same: same)(drive_car))
    setup.clear()
    solve_for(setup, 50)
    assert sum(attachment.sample_counts.values()) <= 1


def test_a_second_solve_goes_on_and_a_cleared_one_begins_anew() -> None:
    setup = control_setup(kind="R2")
    with attach(setup, HEATMAP, seed=1) as attachment:
        solve_for(setup, 20)
        first = sum(attachment.sample_counts.values())
        nodes = len(tree_positions(setup))
        solve_for(setup, 20)
        assert sum(attachment.sample_counts.values()) > first
        assert len(tree_positions(setup)) > nodes
        setup.clear()
        assert compat.is_exact(solve_for(setup, 20_000))


@pytest.mark.parametrize("name", ["RRT", "EST"])
def test_benchmark_of_ompl(name: str) -> None:
    setup = control_setup(name, "R2")
    setup.setup()
    with attach_quietly(setup) as attachment:
        benchmark = compat.new_benchmark(setup, "small", lambda planner: None, lambda *_: None)
        benchmark.addPlanner(setup.getPlanner())
        request = compat.benchmark_request()
        request.maxTime, request.maxMem, request.runCount = 0.3, 4096, 2
        request.displayProgress = request.simplify = request.saveConsoleOutput = False
        benchmark.benchmark(request)
        assert attachment.sample_counts["learned"] > 50


def test_a_wrong_heat_map_ends_no_plan() -> None:
    """Half of the map is called good, the half where the goal is not."""
    values = np.where(GRID.free, 0.0, 0.0).astype(np.float32)
    values[:16] = GRID.free[:16]
    solved = 0
    for seed in range(5):
        compat.seed_ompl(seed)
        setup = control_setup(kind="R2")
        with attach(setup, Heatmap(values, GRID), seed=seed):
            solved += compat.is_exact(solve_for(setup, 20_000))
    assert solved == 5
