"""Heat maps that come while the planner plans."""

from __future__ import annotations

import _thread
import sys
import threading
import time
from concurrent.futures import Future
from typing import Any

import numpy as np
import pytest
from helpers.setups import (
    SMALL_GOAL,
    SMALL_START,
    small_heatmap,
    small_setup,
    small_walls,
    solve_for,
)

from cbagan_ompl import (
    ConfigError,
    GridMap,
    GridMotionValidator,
    GridValidityChecker,
    Heatmap,
    HeatmapError,
    PlannerError,
    Robot,
    TaskError,
    attach,
    plan,
    reached_planners,
)
from cbagan_ompl.planning import compat, heatmap_sources, overlapping
from cbagan_ompl.planning import plan as plan_module
from cbagan_ompl.planning.compat import ou
from cbagan_ompl.planning.hooks import PLANNERS
from cbagan_ompl.planning.monitor import is_monitored

GRID = small_walls()
HEATMAP = small_heatmap(GRID)
AT_ONCE = {name for name, traits in PLANNERS.items() if traits.samples_at_once}
# SPARS plans in threads.
SWITCHED = [n for n in reached_planners() if n not in AT_ONCE and not n.startswith("SPARS")]
NOTHING = {"learned": 0, "uniform": 0}


@pytest.fixture(autouse=True)
def quiet() -> None:
    ou.setLogLevel(ou.LOG_NONE)
    compat.seed_ompl(1)


@pytest.fixture
def two_cores(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(plan_module, "can_overlap", lambda: True)


@pytest.mark.parametrize("name", SWITCHED)
def test_planner_switches_when_the_heat_map_is_there(name: str) -> None:
    setup = small_setup(GRID, name)
    own_goal = type(setup.getGoal())
    future: Future[Heatmap] = Future()
    with attach(setup, future, seed=1) as attachment:
        assert attachment.hook == reached_planners()[name]
        setup.solve(0.03)
        assert attachment.sample_counts == NOTHING
        assert attachment.heatmap is attachment.arrival_s is None
        future.set_result(HEATMAP)
        setup.clear()
        setup.getProblemDefinition().clearSolutionPaths()
        setup.solve(0.3)
        assert attachment.sample_counts["learned"] > 5
        assert attachment.heatmap is HEATMAP
        assert attachment.arrival_s is not None
        assert attachment.arrival_s > 0
    assert type(setup.getGoal()) is own_goal
    counts = attachment.sample_counts
    setup.clear()
    setup.solve(0.05)
    assert attachment.sample_counts == counts


def open_grid() -> GridMap:
    """The goal is behind a wall without a gap, so that planners go on."""
    free = np.ones((64, 64), np.bool_)
    free[30:33] = False
    return GridMap(free)


@pytest.mark.parametrize("name", ["RRT", "RRTstar", "InformedRRTstar", "RRTConnect", "BKPIECE1"])
def test_planner_switches_in_the_middle_of_a_solve(name: str) -> None:
    grid = open_grid()
    setup = small_setup(GRID, name)
    si = setup.getSpaceInformation()
    setup.setStateValidityChecker(GridValidityChecker(si, grid))
    si.setMotionValidator(GridMotionValidator(si, grid))
    heatmap = Heatmap.uniform(grid)
    future: Future[Heatmap] = Future()
    attachment = attach(setup, future, seed=1)
    before: list[dict[str, int]] = []
    count = iter(range(3000))

    def stop() -> bool:
        number = next(count, None)
        if number == 1500:
            before.append(attachment.sample_counts)
            future.set_result(heatmap)
        return number is None

    setup.solve(compat.termination_condition(stop))
    assert before == [NOTHING]
    assert sum(attachment.sample_counts.values()) > 100
    attachment.detach()


def test_before_the_switch_the_planner_is_plain_ompls() -> None:
    """With the same seed of OMPL it makes the same tree as without an attachment."""

    def tree(is_attached: bool, name: str) -> Any:
        compat.seed_ompl(7)
        setup = small_setup(GRID, name)
        setup.setGoal(setup.getGoal())  # with a generator of its own, as attach does
        attachment = None
        if is_attached:
            compat.seed_ompl(7)
            setup = small_setup(GRID, name)
            attachment = attach(setup, Future(), seed=1)
        solve_for(setup, 200)
        data = compat.planner_data(setup.getPlanner())
        states = (data.getVertex(i).getState() for i in range(data.numVertices()))
        nodes = sorted((state[0], state[1]) for state in states)
        if attachment is not None:
            attachment.detach()
        return nodes

    for name in ("RRT", "RRTstar"):
        assert tree(True, name) == tree(False, name)


def test_samples_after_the_switch_repeat_themselves() -> None:
    def counts() -> dict[str, int]:
        compat.seed_ompl(3)
        setup = small_setup(GRID, "RRTstar")
        future: Future[Heatmap] = Future()
        with attach(setup, future, seed=5) as attachment:
            solve_for(setup, 100)
            future.set_result(HEATMAP)
            solve_for(setup, 300)
            return attachment.sample_counts

    assert counts() == counts()
    assert counts()["learned"] > 30


@pytest.mark.parametrize("name", sorted(AT_ONCE & reached_planners().keys()) or [""])
def test_planners_that_cannot_switch_are_refused(name: str) -> None:
    if not name:
        pytest.skip("this build reaches none of them")
    setup = small_setup(GRID, name)
    with pytest.raises(PlannerError, match="all its samples when its solve begins"):
        attach(setup, Future())
    with pytest.raises(PlannerError, match="all its samples"):
        plan(GRID, SMALL_START, SMALL_GOAL, name, "corridor", overlap=True)
    assert not is_monitored(setup.getPlanner())


def test_a_heat_map_that_is_there_already_is_taken_at_once() -> None:
    future: Future[Heatmap] = Future()
    future.set_result(HEATMAP)
    with attach(small_setup(GRID, "RRT"), future) as attachment:
        assert attachment.heatmap is HEATMAP
        assert attachment.arrival_s == 0


@pytest.mark.parametrize(
    ("failure", "kind", "says"),
    [
        (HeatmapError("no such region"), HeatmapError, "no such region"),
        (ZeroDivisionError("in the network"), PlannerError, "ZeroDivisionError: in the network"),
        (None, PlannerError, "cancelled"),
        ("a heat map", PlannerError, "its result is 'a heat map'"),
        (Heatmap.uniform(GridMap(GRID.free, origin=(500, 500, 0))), TaskError, "outside"),
    ],
)
@pytest.mark.parametrize("name", ["RRT", "PRM", "RRTConnect"])
def test_failures_are_raised_when_the_solve_has_ended(
    name: str, failure: Any, kind: type[Exception], says: str
) -> None:
    def fail(future: Future[Any]) -> None:
        if failure is None:
            future.cancel()
        elif isinstance(failure, Exception):
            future.set_exception(failure)
        else:
            future.set_result(failure)

    setup = small_setup(GRID, name)
    future: Future[Any] = Future()
    attachment = attach(setup, future, seed=1)
    setup.solve(0.01)
    fail(future)
    with pytest.raises(kind, match=says):
        setup.solve(0.02)
    assert attachment.has_failed
    assert attachment.sample_counts == NOTHING
    attachment.detach()
    setup.clear()
    setup.solve(0.02)
    if not isinstance(failure, Heatmap):
        done: Future[Any] = Future()
        fail(done)
        with pytest.raises(kind, match=says):
            attach(setup, done)


def test_planners_without_a_path_are_given_back_while_they_wait() -> None:
    """Nothing refers to them any more, though the heat map may come yet."""
    future: Future[Heatmap] = Future()
    attachment = attach(small_setup(GRID, "RRT"), future)
    monitor = attachment._monitor
    del attachment
    attach(small_setup(GRID, "RRT"), HEATMAP).detach()
    assert monitor.refers_to(None)
    future.set_result(HEATMAP)


@pytest.mark.usefixtures("two_cores")
@pytest.mark.parametrize("name", ["RRT", "RRTConnect", "RRTstar", "PRM"])
def test_plan_with_overlap(name: str) -> None:
    result = plan(GRID, SMALL_START, SMALL_GOAL, name, "corridor", time=1.0, seed=1, overlap=True)
    assert result.solved
    assert result.overlap
    assert result.total_s >= result.planning_s
    assert result.first_solution_s is None or (
        result.first_solution_total_s >= result.first_solution_s
    )
    if result.heatmap_arrival_s is not None:
        assert result.heatmap is not None
        assert result.heatmap_arrival_s <= result.total_s
    assert result.to_dict()["overlap"] is True


def make_slow(monkeypatch: pytest.MonkeyPatch, release: threading.Event) -> None:
    def slow(grid: GridMap, start: Any, goal: Any) -> Heatmap:
        release.wait(20)
        return Heatmap.uniform(grid)

    monkeypatch.setitem(heatmap_sources._CONTROLS, "corridor", slow)


def heatmap_threads() -> list[threading.Thread]:
    return [t for t in threading.enumerate() if t.name.startswith("cbagan-ompl-heatmap")]


def wait_until_gone() -> None:
    end = time.monotonic() + 20
    while heatmap_threads() and time.monotonic() < end:
        time.sleep(0.01)
    assert not heatmap_threads()


@pytest.mark.usefixtures("two_cores")
def test_a_path_is_there_before_the_heat_map(monkeypatch: pytest.MonkeyPatch) -> None:
    release = threading.Event()
    make_slow(monkeypatch, release)
    result = plan(GRID, SMALL_START, SMALL_GOAL, "RRT", "corridor", time=10, seed=1, overlap=True)
    assert result.solved
    assert result.heatmap is result.heatmap_arrival_s is None
    assert result.sample_counts == NOTHING
    release.set()
    wait_until_gone()


@pytest.mark.usefixtures("two_cores", "interruptible")
def test_an_interrupt_leaves_no_thread_behind(monkeypatch: pytest.MonkeyPatch) -> None:
    release = threading.Event()
    make_slow(monkeypatch, release)
    walled = open_grid()
    free = walled.free.copy()
    free[30:33, 63] = True  # a gap that is hard to find
    interval = sys.getswitchinterval()

    def interrupt() -> None:
        _thread.interrupt_main()
        time.sleep(0.1)
        release.set()

    timer = threading.Timer(0.3, interrupt)
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        plan(GridMap(free), SMALL_START, (20.5, 60.5), "RRTstar", "corridor", time=30, overlap=True)
    timer.join()
    wait_until_gone()
    assert sys.getswitchinterval() == interval


@pytest.mark.usefixtures("two_cores")
def test_a_failure_ends_the_plan(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(grid: GridMap, start: Any, goal: Any) -> Heatmap:
        raise HeatmapError("the network is ill")

    monkeypatch.setitem(heatmap_sources._CONTROLS, "corridor", fail)
    with pytest.raises(HeatmapError, match="the network is ill"):
        plan(GRID, SMALL_START, SMALL_GOAL, "RRTstar", "corridor", time=60, overlap=True)
    wait_until_gone()


@pytest.mark.usefixtures("two_cores")
def test_poses_have_their_headings_from_the_thread() -> None:
    result = plan(
        "bundled:rooms",
        (30, 30, 0),
        (60, 60, 0),
        "RRTstar",
        "corridor",
        robot=Robot.rectangle(6, 3),
        time=0.5,
        seed=1,
        overlap=True,
    )
    assert result.overlap
    if result.heatmap is not None:
        assert result.heatmap.heading is not None


def test_one_core_waits(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(plan_module, "can_overlap", lambda: False)
    result = plan(GRID, SMALL_START, SMALL_GOAL, "RRT", "corridor", seed=1, overlap=True)
    assert not result.overlap
    assert result.heatmap_arrival_s is None
    assert result.sample_counts["learned"] > 0
    monkeypatch.setattr(overlapping.os, "sched_getaffinity", lambda _: {3}, raising=False)
    assert not overlapping.can_overlap()
    monkeypatch.setattr(overlapping.os, "sched_getaffinity", lambda _: {0, 3}, raising=False)
    assert overlapping.can_overlap()


@pytest.mark.parametrize("options", [{"sampler": "uniform"}, {"heatmap": HEATMAP}])
def test_overlap_needs_something_to_wait_for(options: dict[str, Any]) -> None:
    with pytest.raises(ConfigError, match="overlap is for heat maps that are made"):
        plan(GRID, SMALL_START, SMALL_GOAL, "RRT", overlap=True, **options)
    with pytest.raises(ConfigError, match="overlap"):
        plan(GRID, SMALL_START, SMALL_GOAL, "RRT", "corridor", overlap="yes")  # type: ignore[arg-type]


def test_turns_of_threads_are_restored() -> None:
    interval = sys.getswitchinterval()
    with overlapping._quick_turns:
        with overlapping._quick_turns:
            assert sys.getswitchinterval() < interval
        assert sys.getswitchinterval() < interval
    assert sys.getswitchinterval() == interval
