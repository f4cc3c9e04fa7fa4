"""Statistics of the runs of a benchmark: paired by task, censored where unsolved."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import inf
from zlib import crc32

import numpy as np
from numpy.typing import NDArray

from .intervals import Interval, Medians
from .logs import GEOMETRIC, ExperimentLog, number
from .measures import (
    BEST_KNOWN,
    CHECKS,
    COST,
    FAMILY,
    FIRST_COST,
    FIRST_NODES,
    FIRST_TIME,
    INFERENCE,
    NODES,
    NODES_ADDED,
    SOLVED,
    WITHIN_PERCENT,
    nodes_within,
    time_within,
)
from .settings import BASELINE


@dataclass(frozen=True)
class Summary:
    """The statistics of a planner with a sampler over some tasks.

    Attributes:
        planner: OMPL's name.
        sampler: name of the sampler.
        tasks: number of tasks.
        runs: number of runs on all of them.
        success: fraction of the runs with an exact path that passed the second check.
        measures: the median of each measure, see :func:`measures_of`.
        censored: for each measure the fraction of the runs of which only a lower bound is known,
            because they ended before; such a run counts with that bound, costs as infinite.
        ratios: for each measure the median over the tasks of the ratio to the same planner with
            OMPL's own sampler; empty for that sampler itself, or without it.
    """

    planner: str
    sampler: str
    tasks: int
    runs: int
    success: float
    measures: dict[str, Interval]
    censored: dict[str, float]
    ratios: dict[str, Interval]


@dataclass(frozen=True)
class Results:
    """All summaries of a benchmark.

    Attributes:
        overall: over all tasks, one for each planner with each sampler.
        families: the same for each kind of map; a map without a kind forms a group by itself.
    """

    overall: list[Summary]
    families: dict[str, list[Summary]]


# The value of a run, and whether it is only a lower bound.
_Value = tuple[float, bool]
_Reader = Callable[[Mapping[str, str], ExperimentLog], _Value]


def _planning_time(name: str) -> _Reader:
    def read(run: Mapping[str, str], log: ExperimentLog) -> _Value:
        time = number(run[name])
        return (log.time_limit, True) if time is None else (time, False)

    return read


def _total_time(name: str) -> _Reader:
    def read(run: Mapping[str, str], log: ExperimentLog) -> _Value:
        time, censored = _planning_time(name)(run, log)
        total = time + float(run[INFERENCE])
        # One limit for all, so that two runs that did not get there are a tie.
        return min(total, log.time_limit), censored or total > log.time_limit

    return read


def _relative_cost(name: str) -> _Reader:
    def read(run: Mapping[str, str], log: ExperimentLog) -> _Value:
        cost = number(run[name])
        if cost is None:
            return inf, True
        best = float(log.parameters[BEST_KNOWN])
        # A path without length is the best one where the start lies in the goal region.
        return (1.0 if cost == best else cost / best if best else inf), False

    return read


def _effort(name: str) -> _Reader:
    def read(run: Mapping[str, str], log: ExperimentLog) -> _Value:
        return float(run[name]), run[SOLVED] == "0"

    return read


def _nodes(name: str) -> _Reader:
    def read(run: Mapping[str, str], _: ExperimentLog) -> _Value:
        nodes = number(run[name])
        return (float(run[NODES_ADDED]), True) if nodes is None else (nodes, False)

    return read


# The baseline has none.
_NO_RATIO = frozenset({"inference_s"})


def within_key(percent: int, total: bool = False) -> str:
    """Return the name of the time to a cost within so many percent of the best known one.

    Args:
        percent: the threshold.
        total: with inference.

    Example:
        >>> within_key(5, total=True)
        'within_5_percent_total_s'
    """
    return f"within_{percent}_percent{'_total' if total else ''}_s"


def nodes_key(percent: int) -> str:
    """Return the name of the number of nodes until a cost is within a threshold.

    Example:
        >>> nodes_key(5)
        'nodes_to_5_percent'
    """
    return f"nodes_to_{percent}_percent"


def measures_of(percents: Iterable[int] = WITHIN_PERCENT) -> dict[str, _Reader]:
    """Return what is measured, by name.

    Times are in seconds, of planning alone (``_s``) and with inference (``_total_s``); costs are
    multiples of the best known one of the task. Nodes are those that the planner has added until
    its first path or a good one; ``nodes`` alone are those at its end, which for planners that run
    to the time limit say how many it gets done.

    Args:
        percents: thresholds of good paths, percent above the best known cost.
    """
    names = {percent: time_within(percent) for percent in percents}
    return {
        "inference_s": lambda run, _: (float(run[INFERENCE]), False),
        "first_solution_s": _planning_time(FIRST_TIME),
        "first_solution_total_s": _total_time(FIRST_TIME),
        **{within_key(percent): _planning_time(name) for percent, name in names.items()},
        **{within_key(percent, total=True): _total_time(name) for percent, name in names.items()},
        "nodes_to_first": _nodes(FIRST_NODES),
        **{nodes_key(percent): _nodes(nodes_within(percent)) for percent in names},
        "first_cost": _relative_cost(FIRST_COST),
        "final_cost": _relative_cost(COST),
        "nodes": _effort(NODES),
        "collision_checks": _effort(CHECKS),
    }


# A log, and the runs of one planner with one sampler in it.
_TaskRuns = tuple[ExperimentLog, list[Mapping[str, str]]]


def results_of(logs: Sequence[ExperimentLog], percents: Iterable[int] = WITHIN_PERCENT) -> Results:
    """Return summaries over all tasks and by kind of map; arguments as for :func:`summarize`."""
    measures = measures_of(percents)
    by_kind: dict[str, list[ExperimentLog]] = {}
    for log in logs:
        by_kind.setdefault(log.parameters[FAMILY], []).append(log)
    summaries = {kind: summarize(some, measures) for kind, some in by_kind.items()}
    return Results(summarize(logs, measures), summaries)


def summarize(
    logs: Sequence[ExperimentLog], measures: Mapping[str, _Reader] | None = None
) -> list[Summary]:
    """Return summaries of all planners with all samplers over the tasks of some logs.

    Args:
        logs: one for each task, of the same planners and samplers.
        measures: what is measured; that of :func:`measures_of` by default.
    """
    rows: dict[tuple[str, str], list[_TaskRuns]] = {}
    for log in logs:
        for planner in log.planners:
            name, sampler = planner.name.removeprefix(GEOMETRIC).split("_", 1)
            rows.setdefault((name, sampler), []).append((log, list(planner.runs)))
    values = {
        key: {
            measure: [
                np.array([read(run, log) for run in runs]).reshape(-1, 2) for log, runs in tasks
            ]
            for measure, read in (measures or measures_of()).items()
        }
        for key, tasks in rows.items()
    }
    baselines = {
        planner: _medians_of((planner, sampler), values[planner, sampler])
        for planner, sampler in rows
        if sampler == BASELINE
    }
    return [
        _summary(key, values[key], baselines.get(key[0]), _solved(tasks))
        for key, tasks in rows.items()
    ]


def _solved(tasks: Sequence[_TaskRuns]) -> list[bool]:
    return [run[SOLVED] == "1" for _, runs in tasks for run in runs]


def _summary(
    key: tuple[str, str],
    values: Mapping[str, list[NDArray[np.float64]]],
    baseline: Mapping[str, Medians] | None,
    solved: Sequence[bool],
) -> Summary:
    medians = _medians_of(key, values)
    ratios = {}
    if baseline is not None and key[1] != BASELINE:
        ratios = {
            name: runs.over(baseline[name]).interval()
            for name, runs in medians.items()
            if name not in _NO_RATIO
        }
    return Summary(
        planner=key[0],
        sampler=key[1],
        tasks=len(next(iter(values.values()))),
        runs=len(solved),
        success=float(np.mean(solved)),
        measures={name: runs.interval() for name, runs in medians.items()},
        censored={name: float(np.concatenate(v)[:, 1].mean()) for name, v in values.items()},
        ratios=ratios,
    )


def _medians_of(
    key: tuple[str, str], values: Mapping[str, list[NDArray[np.float64]]]
) -> dict[str, Medians]:
    """Return the medians of each measure, resampled with a seed of the row's own."""
    seed = crc32("_".join(key).encode())
    return {
        name: Medians.of([task[:, 0] for task in tasks], seed) for name, tasks in values.items()
    }
