from __future__ import annotations

import os
import signal

import numpy as np
import pytest

from cbagan_ompl import GridMap, Heatmap, HeatmapError, PlannerError
from cbagan_ompl.planning.compat import BOOST_PYTHON
from cbagan_ompl.planning.ompl_benchmark import (
    PlannerVariant,
    RunOptions,
    check_variants,
    run_benchmark,
)
from cbagan_ompl.planning.workspace import Workspace

# A planner that no hook reaches.
UNREACHED = "EITstar" if BOOST_PYTHON else "BITstar"


def test_errors_in_events_come_out(two_walls: GridMap) -> None:
    task = two_walls.check_task((10, 10), (240, 240))
    far = Heatmap.uniform(GridMap(np.ones((9, 9), bool), origin=(1e3, 1e3, 0.0)))
    variants = [PlannerVariant("RRTstar", name, lambda *_: far) for name in ("one", "two")]
    options = RunOptions(5, 1.0)
    rounds: list[int] = []
    with pytest.raises(HeatmapError, match="coordinates of the map"):
        run_benchmark("x", Workspace(two_walls), task, variants, options, lambda: rounds.append(1))
    assert len(rounds) == 1


@pytest.mark.usefixtures("interruptible")
def test_interrupt_of_a_benchmark_in_this_process(two_walls: GridMap, corridor: Heatmap) -> None:
    task = two_walls.check_task((10, 10), (240, 240))
    variants = [PlannerVariant("RRTstar", "corridor", lambda *_: corridor)]
    rounds = []

    def interrupt() -> None:
        rounds.append(1)
        os.kill(os.getpid(), signal.SIGINT)

    with pytest.raises(KeyboardInterrupt):
        run_benchmark("x", Workspace(two_walls), task, variants, RunOptions(9, 0.1), interrupt)
    assert len(rounds) == 1
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_unreached_planners_run_with_their_own_sampler_only(two_walls: GridMap) -> None:
    task = two_walls.check_task((10, 10), (240, 240))
    recording = run_benchmark(
        "x",
        Workspace(two_walls),
        task,
        [PlannerVariant("RRTConnect", "uniform", None)],
        RunOptions(2, 1.0),
    )
    assert all(run.cost < np.inf for run in recording.runs["RRTConnect_uniform"])
    variants = [PlannerVariant(UNREACHED, "corridor", Heatmap.corridor)]
    with pytest.raises(PlannerError, match=f"no hook reaches {UNREACHED}"):
        check_variants(Workspace(two_walls), task, variants, RunOptions(1, 0.1))
