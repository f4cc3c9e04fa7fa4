"""Detaching at the wrong time, and not at all."""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from helpers.setups import (
    SMALL_GOAL,
    SMALL_START,
    small_heatmap,
    small_setup,
    small_walls,
    solve_for,
)

from cbagan_ompl import PlannerError, attach, plan, reached_planners
from cbagan_ompl.planning import compat
from cbagan_ompl.planning.compat import ob, ou
from cbagan_ompl.planning.monitor import release_forgotten

GRID = small_walls()
HEATMAP = small_heatmap(GRID)
# SPARS calls validity checks from threads.
PLANNERS = [name for name in reached_planners() if not name.startswith("SPARS")]


@pytest.fixture(autouse=True)
def quiet() -> None:
    ou.setLogLevel(ou.LOG_NONE)


class SteppingValidator(ob.MotionValidator):  # type: ignore[misc]
    """Asks a validity function about some points of each motion."""

    def __init__(self, si: Any, is_valid: Callable[[Any], bool]) -> None:
        super().__init__(si)
        self._is_valid = is_valid

    def checkMotion(self, s1: Any, s2: Any, *last_valid: Any) -> bool:  # noqa: N802
        x, y = s1[0], s1[1]
        ways = [(x + (s2[0] - x) * k / 12, y + (s2[1] - y) * k / 12) for k in range(1, 13)]
        return all(self._is_valid(point) for point in ways)


class DetachingChecker:
    """A validity function that detaches at its n-th call."""

    def __init__(self, setup: Any, at: int) -> None:
        self.calls, self.said = 0, ""
        self.attachment: Any = None
        self._at = at
        si = setup.getSpaceInformation()
        setup.setStateValidityChecker(compat.validity_function(self.is_valid))
        self._motions = SteppingValidator(si, self.is_valid)
        si.setMotionValidator(self._motions)

    def is_valid(self, state: Any) -> bool:
        self.calls += 1
        if self.attachment is not None and self.calls == self._at:
            try:
                self.attachment.detach()
            except PlannerError as error:
                self.said = str(error)
            else:
                self.said = "detached"
        return bool(GRID.is_free((state[0], state[1])))


@pytest.mark.parametrize("planner", PLANNERS)
@pytest.mark.parametrize("at", [1, 2, 40])
def test_detach_inside_a_solve_is_refused(planner: str, at: int) -> None:
    compat.seed_ompl(1)
    setup = small_setup(GRID, planner)
    checker = DetachingChecker(setup, at)
    checker.attachment = attachment = attach(setup, HEATMAP, seed=1)
    checker.calls = 0
    setup.solve(0.05)
    checker.attachment = None  # which keeps setup and checker alive through each other
    if checker.calls >= at:
        assert "after solve() has returned" in checker.said
    attachment.detach()
    setup.clear()
    setup.solve(0.05)


@pytest.mark.parametrize("planner", ["RRT", "RRTstar", "PRM", "BKPIECE1"])
def test_detach_inside_the_planners_own_solve_is_refused(planner: str) -> None:
    """Once it has asked for a sample."""
    compat.seed_ompl(1)
    setup = small_setup(GRID, planner)
    checker = DetachingChecker(setup, 60)
    checker.attachment = attachment = attach(setup, HEATMAP, seed=1)
    setup.setup()
    checker.calls = 0
    setup.getPlanner().solve(0.1)
    checker.attachment = None
    assert "after solve() has returned" in checker.said
    attachment.detach()


EARLY = """
import sys
from test_detach import DetachingChecker, HEATMAP, GRID, PLANNERS, attach, compat, ou, small_setup
ou.setLogLevel(ou.LOG_NONE)
for planner in PLANNERS:
    for at in range(1, 13):
        compat.seed_ompl(at)
        setup = small_setup(GRID, planner)
        checker = DetachingChecker(setup, at)
        checker.attachment = attachment = attach(setup, HEATMAP, seed=at)
        setup.setup()
        checker.calls = 0
        setup.getPlanner().solve(0.02)
        checker.attachment = None
        attachment.detach()
print("done")
"""


def test_detach_early_in_the_planners_own_solve_does_not_crash() -> None:
    """Before it has asked for a sample, too, where it is not known that it plans."""
    done = run_script(EARLY)
    assert done.returncode == 0, done.stderr
    assert done.stdout == "done\n"


def run_script(code: str) -> subprocess.CompletedProcess[str]:
    """Run code that imports this file in another process."""
    here = Path(__file__)
    paths = [str(here.parent), str(here.parents[1]), *sys.path]
    return subprocess.run(
        [sys.executable, "-c", code],
        env={**os.environ, "PYTHONPATH": os.pathsep.join(paths)},
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )


def test_the_error_leaves_the_solve() -> None:
    setup = small_setup(GRID, "RRTstar")
    attachment = attach(setup, HEATMAP, seed=1)
    calls: list[int] = []

    def stop() -> bool:
        calls.append(1)
        if len(calls) == 20:
            attachment.detach()
        return False

    with pytest.raises(PlannerError, match="while the planner plans"):
        setup.solve(compat.termination_condition(stop))
    attachment.detach()


@pytest.mark.parametrize("planner", ["RRT", "RRTstar", "PRM"])
def test_detach_right_after_any_solve(planner: str) -> None:
    """Also after one without a path, and by the line that called solve."""
    setup = small_setup(GRID, planner)
    attachment = attach(setup, HEATMAP, seed=1)
    for step in (lambda: setup.getPlanner().clear(), lambda: setup.solve(0.0), attachment.detach):
        step()
    assert "solve" not in vars(setup)
    attachment = attach(setup, HEATMAP, seed=1)
    setup.setup()
    for step in (lambda: setup.getPlanner().solve(0.001), attachment.detach):
        step()


def test_forgotten_attachments_cost_nothing() -> None:
    def forget(planner: str, seed: int) -> None:
        setup = small_setup(GRID, planner)
        attach(setup, HEATMAP, seed=seed)
        solve_for(setup, 20) if planner != "PRM" else setup.solve(0.002)

    for planner in ("RRT", "RRTstar", "PRM"):
        for seed in range(30):
            forget(planner, seed)
        before = resident()
        for seed in range(200):
            forget(planner, seed)
        # Each would cost about 200 KB.
        assert resident() - before < 200 * 20_000, planner


def test_forgotten_attachments_are_let_go_when_another_planner_solves() -> None:
    setup = small_setup(GRID, "RRTstar")
    with attach(setup, HEATMAP, seed=1):
        many = [attach(small_setup(GRID, "RRT"), HEATMAP) for _ in range(3)]
        monitors = [attachment._monitor for attachment in many]
        del many
        assert not any(monitor.is_released for monitor in monitors)
        solve_for(setup, 1)
        assert all(monitor.is_released for monitor in monitors)


def test_a_setup_that_only_its_solve_refers_to_is_not_forgotten() -> None:
    samplers: list[Any] = []

    def attached_setup() -> Any:
        setup = small_setup(GRID, "RRTstar")
        attachment = attach(setup, HEATMAP, seed=1)
        samplers.append(attachment._sampler)
        return setup

    solve_for(attached_setup(), 50)
    steps = iter(range(50))

    def attach_another() -> bool:
        attach(small_setup(GRID, "RRT"), HEATMAP).detach()
        return next(steps, None) is None

    attached_setup().solve(compat.termination_condition(attach_another))
    assert all(sampler.sample_counts["learned"] > 20 for sampler in samplers)


LOSING = """
import gc, signal, time
from test_detach import GRID, HEATMAP, attach, small_setup
many = [[] for _ in range(10**6)]
setup = small_setup(GRID, "RRT")
attachment = attach(setup, HEATMAP)
signal.signal(signal.SIGALRM, signal.default_int_handler)
for _ in range(5):
    try:
        signal.setitimer(signal.ITIMER_REAL, 0.005)
        gc.collect()
        time.sleep(60)
        print("lost")
    except KeyboardInterrupt:
        print("seen")
"""


def test_no_interrupt_is_lost_while_garbage_is_collected() -> None:
    """One that arrives meanwhile is raised in what Python runs next, which must not be a callback.

    In another process, because libraries for tests have callbacks of their own.
    """
    done = run_script(LOSING)
    assert done.stdout == 5 * "seen\n", done.stderr
    assert done.stderr == ""


def test_what_is_still_in_use_is_not_forgotten() -> None:
    setup = small_setup(GRID, "RRTstar")
    attach(setup, HEATMAP, seed=1)  # the attachment alone is forgotten
    planner = setup.getPlanner()
    goal = setup.getGoal()
    attach(small_setup(GRID, "RRT"), HEATMAP).detach()
    solve_for(setup, 50)
    assert type(setup.getGoal()).__name__ == "InjectedGoal"
    counts = goal._sampler.sample_counts
    assert sum(counts.values()) > 30
    problem = setup.getProblemDefinition()
    del setup
    release_forgotten()
    planner.clear()
    problem.clearSolutionPaths()
    solve_for(planner, 50)
    assert sum(goal._sampler.sample_counts.values()) > sum(counts.values()) + 30


def resident() -> int:
    """Resident memory in bytes."""
    with open("/proc/self/statm") as statm:
        return int(statm.read().split()[1]) * resource.getpagesize()


def test_threads_leave_the_log_level_alone() -> None:
    ou.setLogLevel(ou.LOG_WARN)
    errors: list[BaseException] = []

    def work(seed: int) -> None:
        try:
            for i in range(6):
                plan(
                    GRID, SMALL_START, SMALL_GOAL, "RRT", "corridor", iterations=200, seed=seed + i
                )
        except BaseException as error:
            errors.append(error)

    threads = [threading.Thread(target=work, args=(10 * i,)) for i in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not errors
    assert ou.getLogLevel() == ou.LOG_WARN


def test_log_levels_of_blocks_that_overlap() -> None:
    ou.setLogLevel(ou.LOG_INFO)
    first, second = compat.log_level(ou.LOG_NONE), compat.log_level(ou.LOG_ERROR)
    first.__enter__()
    second.__enter__()
    assert ou.getLogLevel() == ou.LOG_NONE
    first.__exit__(None, None, None)
    assert ou.getLogLevel() == ou.LOG_ERROR
    second.__exit__(None, None, None)
    assert ou.getLogLevel() == ou.LOG_INFO
