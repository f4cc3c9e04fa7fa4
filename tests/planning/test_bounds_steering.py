"""RRTConnect on builds without setStateSamplerAllocator: samples by way of the bounds."""

from __future__ import annotations

import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.tasks import GOAL, START
from numpy.typing import NDArray

from cbagan_ompl import GridMap, GridMotionValidator, GridValidityChecker, Heatmap, attach
from cbagan_ompl.errors import PlannerError
from cbagan_ompl.planning import compat
from cbagan_ompl.planning.compat import ob, og, ou
from cbagan_ompl.planning.ompl_benchmark import PlannerVariant, RunOptions, run_benchmark
from cbagan_ompl.planning.problem import make_setup
from cbagan_ompl.planning.workspace import Workspace
from cbagan_ompl.sampling.options import NO_ADAPTATION
from cbagan_ompl.sampling.sampler import HeatmapSampler

pytestmark = pytest.mark.skipif(
    compat.HAS_STATE_SAMPLER_ALLOCATOR, reason="this build sets a StateSampler"
)


@pytest.fixture(autouse=True)
def quiet() -> None:
    ou.setLogLevel(ou.LOG_ERROR)


def new_setup(grid: GridMap, planner: str = "RRTConnect", range: float = 20.0) -> Any:
    setup = make_setup(Workspace(grid), (np.array(START), np.array(GOAL)), 2.0)
    instance = getattr(og, planner)(setup.getSpaceInformation())
    instance.setRange(range)
    setup.setPlanner(instance)
    return setup


def positions(setup: Any) -> np.ndarray:
    return np.array([(state[0], state[1]) for state in setup.getSolutionPath().getStates()])


def is_as_before(setup: Any, grid: GridMap, range: float = 20.0) -> bool:
    bounds = setup.getStateSpace().getBounds()
    low, high = grid.bounds
    return (
        list(bounds.low) == low.tolist()
        and list(bounds.high) == high.tolist()
        and setup.getPlanner().getRange() == range
    )


@pytest.fixture
def walled_in(two_walls: GridMap) -> GridMap:
    """A map on which the goal cannot be reached."""
    return wall_in(two_walls.free.copy())


def wall_in(free: NDArray[np.bool_]) -> GridMap:
    """Close the surroundings of the goal."""
    u, v = (int(value) for value in GOAL)
    free[v - 8 : v + 9, u - 8] = free[v - 8 : v + 9, u + 8] = False
    free[v - 8, u - 8 : u + 9] = free[v + 8, u - 8 : u + 9] = False
    return GridMap(free)


def test_samples_are_those_of_the_heat_map(
    two_walls: GridMap, corridor: Heatmap, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With a long range the first state that an iteration checks is its sample."""
    given: list[tuple[float, float]] = []
    checked: set[tuple[float, float]] = set()
    original = HeatmapSampler.next

    def note(self: HeatmapSampler) -> tuple[float, float]:
        given.append(original(self))
        return given[-1]

    class Motions(GridMotionValidator):
        def checkMotion(self, s1: Any, s2: Any) -> bool:  # noqa: N802
            checked.update([(s1[0], s1[1]), (s2[0], s2[1])])
            return super().checkMotion(s1, s2)

    class States(GridValidityChecker):
        def isValid(self, state: Any) -> bool:  # noqa: N802
            checked.add((state[0], state[1]))
            return super().isValid(state)

    monkeypatch.setattr(HeatmapSampler, "next", note)
    for seed in range(10):
        compat.seed_ompl(seed)
        setup = new_setup(two_walls, range=1000.0)
        si = setup.getSpaceInformation()
        setup.setStateValidityChecker(States(si, two_walls))
        si.setMotionValidator(Motions(si, two_walls))
        with attach(setup, corridor, seed=seed) as attachment:
            assert compat.is_exact(setup.solve(2.0))
            assert sum(attachment.sample_counts.values()) == len(given) > 1
        assert checked.issuperset(given)
        given.clear()


def test_every_sample_counted_is_one_that_was_drawn(two_walls: GridMap, corridor: Heatmap) -> None:
    """All iterations but those before the goal's tree has four nodes are ours."""
    for seed in range(20):
        compat.seed_ompl(seed)
        setup = new_setup(two_walls)
        iterations = [0]

        def count() -> bool:
            iterations[0] += 1  # noqa: B023
            return iterations[0] > 3000  # noqa: B023

        with attach(setup, corridor, seed=seed, adaptation=NO_ADAPTATION) as attachment:
            setup.solve(compat.termination_condition(count))
            steered = sum(attachment.sample_counts.values())
        assert steered <= iterations[0]
        assert steered >= iterations[0] - 30


@pytest.mark.parametrize("limit", [1e-9, 1e-5, 1e-4, 3e-4, 1e-3, 1e-2])
def test_runs_without_a_path_leave_the_bounds(walled_in: GridMap, limit: float) -> None:
    values = np.where(walled_in.free, 0.6, 0).astype(np.float32)
    setup = new_setup(walled_in)
    with attach(setup, Heatmap(values, walled_in), seed=0) as attachment:
        for _ in range(40):
            setup.clear()
            assert not compat.is_exact(setup.solve(limit))
            assert is_as_before(setup, walled_in)
        assert limit < 1e-3 or attachment.sample_counts["learned"] > 0


@pytest.mark.parametrize("place", ["isValid", "checkMotion", "termination"])
def test_exceptions_leave_the_bounds(walled_in: GridMap, place: str) -> None:
    values = np.where(walled_in.free, 0.6, 0).astype(np.float32)

    class OopsError(Exception):
        pass

    countdown = [0]

    def tick() -> None:
        countdown[0] -= 1
        if countdown[0] == 0:
            raise OopsError

    class States(GridValidityChecker):
        def isValid(self, state: Any) -> bool:  # noqa: N802
            if place == "isValid":
                tick()
            return super().isValid(state)

    class Motions(GridMotionValidator):
        def checkMotion(self, s1: Any, s2: Any) -> bool:  # noqa: N802
            if place == "checkMotion":
                tick()
            return super().checkMotion(s1, s2)

    def stop() -> bool:
        if place == "termination":
            tick()
        return False

    setup = new_setup(walled_in)
    si = setup.getSpaceInformation()
    setup.setStateValidityChecker(States(si, walled_in))
    si.setMotionValidator(Motions(si, walled_in))
    setup.setup()
    with attach(setup, Heatmap(values, walled_in), seed=0):
        for calls in range(1, 70):
            setup.clear()
            countdown[0] = calls
            with pytest.raises(OopsError):
                setup.solve(compat.termination_condition(stop))
            assert is_as_before(setup, walled_in), calls


def test_interrupts_leave_the_bounds() -> None:
    """In another process: an interrupt in the lock of a tool for coverage would block this one."""
    code = (
        "import sys; sys.path[:] = sys.argv[1:]; "
        "from test_bounds_steering import interrupt_often; interrupt_often()"
    )
    paths = [str(Path(__file__).parent), *sys.path]
    done = subprocess.run(
        [sys.executable, "-c", code, *paths],
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert "interrupted 200 times" in done.stdout


def interrupt_often() -> None:
    """Interrupt 200 solves, each at another moment, and look at the bounds after each."""
    ou.setLogLevel(ou.LOG_ERROR)
    grid = wall_in(np.ones((256, 256), bool))
    signal.signal(signal.SIGINT, signal.default_int_handler)
    values = np.where(grid.free, 0.6, 0).astype(np.float32)
    setup = new_setup(grid)
    before = signal.getsignal(signal.SIGINT)
    rng = np.random.default_rng(0)
    # A thread that interrupts could itself be interrupted while it is started.
    alarm = signal.signal(signal.SIGALRM, lambda *_: signal.raise_signal(signal.SIGINT))
    with attach(setup, Heatmap(values, grid), seed=0) as attachment:
        for _ in range(200):
            setup.clear()
            with pytest.raises(KeyboardInterrupt):  # noqa: PT012
                signal.setitimer(signal.ITIMER_REAL, float(rng.uniform(1e-5, 0.004)))
                setup.solve(compat.termination_condition(lambda: False))
            assert is_as_before(setup, grid)
        assert attachment.sample_counts["learned"] > 200
    signal.signal(signal.SIGALRM, alarm)
    assert signal.getsignal(signal.SIGINT) is before
    print("interrupted 200 times")


def test_solve_goes_on_and_begins_anew(two_walls: GridMap, corridor: Heatmap) -> None:
    setup = new_setup(two_walls)
    with attach(setup, corridor, seed=0) as attachment:
        for _ in range(2000):
            setup.solve(2e-4)
            if setup.haveExactSolutionPath():
                break
        assert setup.haveExactSolutionPath()
        seen = attachment.sample_counts["learned"]
        assert seen > 20
        setup.clear()
        assert compat.is_exact(setup.solve(2.0))
        assert attachment.sample_counts["learned"] > seen
        setup.simplifySolution()
        path = positions(setup)
        assert two_walls.path_is_free(path)
        assert np.hypot(*(path[-1] - GOAL)) <= 2.0


def test_another_planner_is_not_steered(two_walls: GridMap, corridor: Heatmap) -> None:
    setup = new_setup(two_walls)
    other = og.RRTConnect(setup.getSpaceInformation())
    other.setProblemDefinition(setup.getProblemDefinition())
    other.setRange(20.0)
    with attach(setup, corridor, seed=0) as attachment:
        other.setProblemDefinition(setup.getProblemDefinition())
        assert compat.is_exact(other.solve(2.0))
        assert attachment.sample_counts == {"learned": 0, "uniform": 0}
        setup.getProblemDefinition().clearSolutionPaths()
        assert compat.is_exact(setup.solve(2.0))
        seen = attachment.sample_counts
        assert seen["learned"] > 0
        other.clear()
        setup.getProblemDefinition().clearSolutionPaths()
        assert compat.is_exact(other.solve(2.0))
        assert attachment.sample_counts == seen


@pytest.mark.parametrize("kind", ["SE2StateSpace", "ReedsSheppStateSpace", "DubinsStateSpace"])
def test_poses_with_the_validator_of_ompl(two_walls: GridMap, corridor: Heatmap, kind: str) -> None:
    space = getattr(ob, kind)(*(() if kind == "SE2StateSpace" else (4.0,)))
    bounds = ob.RealVectorBounds(2)
    bounds.setLow(0.0)
    bounds.setHigh(256.0)
    space.setBounds(bounds)
    setup = og.SimpleSetup(space)
    si = setup.getSpaceInformation()
    setup.setStateValidityChecker(GridValidityChecker(si, two_walls))
    si.setStateValidityCheckingResolution(1.0 / space.getMaximumExtent())
    states = []
    for x, y in (START, GOAL):
        states.append(compat.new_state(space))
        states[-1].setXY(float(x), float(y))
        states[-1].setYaw(0.0)
    setup.setStartAndGoalStates(*states, 2.0)
    setup.setPlanner(og.RRTConnect(si))
    original = si.getMotionValidator()
    with attach(setup, corridor, seed=0) as attachment:
        setup.solve(1.0)
        assert attachment.sample_counts["learned"] > 10
        if setup.haveExactSolutionPath():
            path = setup.getSolutionPath()
            assert path.check()
            assert path.getStateCount() < 3 or np.std([s.getYaw() for s in path.getStates()]) > 0.01
    assert type(si.getMotionValidator()) is type(original)
    assert list(space.getBounds().high) == [256.0, 256.0]


def test_benchmark_of_ompl(two_walls: GridMap, walled_in: GridMap, corridor: Heatmap) -> None:
    """The script's own Benchmark, whose termination condition is C++'s."""
    values = np.where(walled_in.free, 0.6, 0).astype(np.float32)
    for grid, heatmap, solved in (
        (two_walls, corridor, True),
        (walled_in, Heatmap(values, walled_in), False),
    ):
        setup = new_setup(grid)
        planner = setup.getPlanner()
        other = og.RRT(setup.getSpaceInformation())
        found: list[tuple[bool, bool]] = []

        def look(planner: Any, run: Any) -> None:
            as_before = is_as_before(setup, grid)  # noqa: B023
            found.append((setup.haveExactSolutionPath(), as_before))  # noqa: B023

        with attach(setup, heatmap, seed=0) as attachment:
            benchmark = compat.new_benchmark(setup, "two", lambda planner: None, look)
            benchmark.addPlanner(planner)
            benchmark.addPlanner(other)
            request = compat.benchmark_request()
            request.maxTime, request.maxMem, request.runCount = (2.0 if solved else 0.2), 4096, 3
            request.displayProgress = request.simplify = request.saveConsoleOutput = False
            request.timeBetweenUpdates = 0.05
            benchmark.benchmark(request)
            assert attachment.sample_counts["learned"] > 50
        assert found == [(solved, True)] * 6


def test_benchmark_of_ours(two_walls: GridMap, corridor: Heatmap) -> None:
    variants = [
        PlannerVariant("RRTConnect", "own", lambda *_: corridor),
        PlannerVariant("RRTConnect", "uniform", None),
    ]
    ends = np.array(START, float), np.array(GOAL, float)
    options = RunOptions(runs=3, time=2.0, range=20.0, tolerance=1.0)
    recording = run_benchmark("two", Workspace(two_walls), ends, variants, options)
    assert all(run.sample_counts["learned"] > 0 for run in recording.runs["RRTConnect_own"])
    assert all(np.isfinite(run.cost) for runs in recording.runs.values() for run in runs)


def test_a_goal_with_many_states(two_walls: GridMap, corridor: Heatmap) -> None:
    class Disc(ob.GoalSampleableRegion):  # type: ignore[misc]
        def __init__(self, si: Any) -> None:
            super().__init__(si)
            self.setThreshold(5.0)
            self.rng = np.random.default_rng(0)

        def distanceGoal(self, state: Any) -> float:  # noqa: N802
            return float(np.hypot(state[0] - GOAL[0], state[1] - GOAL[1]))

        def maxSampleCount(self) -> int:  # noqa: N802
            return 10**6

        def sampleGoal(self, state: Any) -> None:  # noqa: N802
            state[0], state[1] = np.add(GOAL, self.rng.uniform(-3, 3, 2)).tolist()

    for seed in range(10):
        setup = new_setup(two_walls)
        setup.setGoal(Disc(setup.getSpaceInformation()))
        with attach(setup, corridor, seed=seed) as attachment:
            assert compat.is_exact(setup.solve(5.0))
            assert attachment.sample_counts["learned"] > 5
            end = positions(setup)[-1]
            assert np.hypot(*(end - GOAL)) <= 5.0


def test_checks_that_were_replaced_raise(two_walls: GridMap, corridor: Heatmap) -> None:
    setup = new_setup(two_walls)
    si = setup.getSpaceInformation()
    with attach(setup, corridor, seed=0):
        si.setMotionValidator(GridMotionValidator(si, two_walls))
        with pytest.raises(PlannerError, match="replaced"):
            setup.solve(1.0)
    assert isinstance(si.getMotionValidator(), GridMotionValidator)
    assert compat.is_exact(setup.solve(2.0))
