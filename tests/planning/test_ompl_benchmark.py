from __future__ import annotations

import os
import signal
from typing import Any

import numpy as np
import pytest

from cbagan_ompl import GridMap, Heatmap, PlannerError, SamplerOptions, TaskError, attach
from cbagan_ompl.planning import ompl_benchmark
from cbagan_ompl.planning.attach import Attachment
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
    with pytest.raises(TaskError, match="outside of the heat map's map"):
        run_benchmark("x", Workspace(two_walls), task, variants, options, lambda: rounds.append(1))
    assert len(rounds) == 1


def test_samples_of_a_run_do_not_depend_on_how_long_others_have_run(
    two_walls: GridMap, corridor: Heatmap, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As they would with limits of time, on machines of other speed."""
    task = two_walls.check_task((10, 10), (240, 240))
    variants = [PlannerVariant("RRT", name, lambda *_: corridor) for name in ("one", "two")]
    begins: list[list[float]] = [[], []]
    for begin, used in zip(begins, (0, 7), strict=True):

        def attach_later(
            setup: Any,
            heatmap: Heatmap,
            options: SamplerOptions,
            begin: list[float] = begin,
            used: int = used,
        ) -> Attachment:
            assert isinstance(options.seed, np.random.Generator)
            begin.append(options.seed.random())
            options.seed.random(used)
            return attach(setup, heatmap, options)

        monkeypatch.setattr(ompl_benchmark, "attach", attach_later)
        run_benchmark("x", Workspace(two_walls), task, variants, RunOptions(2, 5.0, range=20.0))
    assert len(set(begins[0])) == 4, "each has samples of its own"
    assert begins[0] == begins[1]


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
