"""Logs of benchmarks that never ran, for tests of what is made of them."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf

from cbagan_ompl.benchmarking.logs import ExperimentLog, PlannerLog
from cbagan_ompl.benchmarking.measures import WITHIN_PERCENT, add_measures
from cbagan_ompl.planning.improvements import Improvement
from cbagan_ompl.planning.ompl_benchmark import RunRecord

NO_SAMPLES = {"learned": 0, "uniform": 0}


def make_log(
    name: str,
    records: dict[str, list[RunRecord]],
    optimal_cost: float | None = None,
    percents: Sequence[int] = WITHIN_PERCENT,
) -> ExperimentLog:
    """A log of runs of 1 s, each with 100 nodes, that all ended after 0.9 s."""
    planners = tuple(
        PlannerLog(
            f"geometric_{planner}",
            ("range = 1",),
            tuple({"time REAL": "0.9", "graph states INTEGER": "100"} for _ in runs),
        )
        for planner, runs in records.items()
    )
    log = ExperimentLog(
        "OMPL version 2.0.1", name, {"map VARCHAR": name, "map family VARCHAR": "test"},
        "host", "2000-01-01 00:00:00",
        "Properties\nof the space", "", "7", 1.0, 100.0, len(next(iter(records.values()))), 5.0,
        (("status", "Unknown status", "Exact solution"),), planners,
    )  # fmt: skip
    return add_measures(log, records, optimal_cost, percents)


def solved(*costs: tuple[float, float], inference: float = 0.0, checks: int = 10) -> RunRecord:
    improvements = [Improvement(*cost, nodes=10 * (i + 1)) for i, cost in enumerate(costs)]
    return RunRecord(inference, NO_SAMPLES, checks, costs[-1][1], improvements, nodes=80)


def unsolved(inference: float = 0.0) -> RunRecord:
    return RunRecord(inference, NO_SAMPLES, 50, inf, [])
