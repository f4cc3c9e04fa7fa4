"""What the runs of a benchmark amount to: paired by task, censored where unsolved."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import inf

import numpy as np
from numpy.typing import NDArray

from .logs import GEOMETRIC, ExperimentLog, number
from .measures import (
    BEST_KNOWN,
    CHECKS,
    COST,
    FAMILY,
    FIRST_COST,
    FIRST_TIME,
    INFERENCE,
    NODES,
    SOLVED,
    WITHIN_PERCENT,
    time_within,
)
from .settings import BASELINE

_RESAMPLES = 2000
_TAILS = (0.025, 0.975)


@dataclass(frozen=True)
class Interval:
    """A median over tasks with its bootstrap 95 % interval; infinite where unsolved runs rule.

    Attributes:
        median: of the medians over the runs on each task.
        low: lower end of the interval.
        high: upper end of the interval.
    """

    median: float
    low: float
    high: float


@dataclass(frozen=True)
class Summary:
    """A planner with a sampler over some tasks.

    Attributes:
        planner: OMPL's name.
        sampler: its name.
        tasks: how many.
        runs: on all of them.
        success: share of the runs with an exact path that passed the check again.
        measures: for each of :data:`MEASURES` its median.
        censored: for each of them the share of runs of which only a lower bound is known, because
            they ended before; such a run counts with that bound, costs as infinite.
        ratios: for each of them the median over the tasks of the ratio to the same planner with
            OMPL's own sampler; empty for that one itself, or without it.
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
        families: the same for each map family; a map without one is a family of its own.
    """

    overall: list[Summary]
    families: dict[str, list[Summary]]


# A run's value, and whether it is but a lower bound.
_Value = tuple[float, bool]
_Reader = Callable[[Mapping[str, str], ExperimentLog], _Value]


def _planning(name: str) -> _Reader:
    def read(run: Mapping[str, str], log: ExperimentLog) -> _Value:
        time = number(run[name])
        return (log.time_limit, True) if time is None else (time, False)

    return read


def _total(name: str) -> _Reader:
    def read(run: Mapping[str, str], log: ExperimentLog) -> _Value:
        time, censored = _planning(name)(run, log)
        total = time + float(run[INFERENCE])
        # One limit for all, so that two runs that did not get there are a tie.
        return min(total, log.time_limit), censored or total > log.time_limit

    return read


def _excess(name: str) -> _Reader:
    def read(run: Mapping[str, str], log: ExperimentLog) -> _Value:
        cost = number(run[name])
        return (inf, True) if cost is None else (cost / float(log.parameters[BEST_KNOWN]), False)

    return read


def _effort(name: str) -> _Reader:
    def read(run: Mapping[str, str], log: ExperimentLog) -> _Value:
        return float(run[name]), run[SOLVED] == "0"

    return read


#: What is measured: times in seconds, of planning alone (``_s``) and with the inference counted in
#: (``_total_s``); costs in multiples of the best known one of the task.
MEASURES: dict[str, _Reader] = {
    "inference_s": lambda run, _: (float(run[INFERENCE]), False),
    "first_solution_s": _planning(FIRST_TIME),
    "first_solution_total_s": _total(FIRST_TIME),
    **{
        f"within_{percent}_percent_s": _planning(time_within(percent)) for percent in WITHIN_PERCENT
    },
    **{
        f"within_{percent}_percent_total_s": _total(time_within(percent))
        for percent in WITHIN_PERCENT
    },
    "first_cost": _excess(FIRST_COST),
    "final_cost": _excess(COST),
    "nodes": _effort(NODES),
    "collision_checks": _effort(CHECKS),
}

# The baseline has none.
_NO_RATIO = frozenset({"inference_s"})


def results_of(logs: Sequence[ExperimentLog]) -> Results:
    """Summaries over all tasks and by map family; arguments as for :func:`summarise`."""
    families: dict[str, list[ExperimentLog]] = {}
    for log in logs:
        families.setdefault(log.parameters[FAMILY], []).append(log)
    return Results(summarise(logs), {name: summarise(some) for name, some in families.items()})


def summarise(logs: Sequence[ExperimentLog]) -> list[Summary]:
    """Summaries of all planners with all samplers over the tasks of some logs.

    Args:
        logs: one for each task, of the same planners and samplers.
    """
    rows: dict[tuple[str, str], list[tuple[ExperimentLog, list[Mapping[str, str]]]]] = {}
    for log in logs:
        for planner in log.planners:
            name, sampler = planner.name.removeprefix(GEOMETRIC).split("_", 1)
            rows.setdefault((name, sampler), []).append((log, list(planner.runs)))
    values = {
        key: {
            measure: [
                np.array([read(run, log) for run in runs]).reshape(-1, 2) for log, runs in tasks
            ]
            for measure, read in MEASURES.items()
        }
        for key, tasks in rows.items()
    }
    return [
        _summary(key, values[key], values.get((key[0], BASELINE)), _solved(tasks))
        for key, tasks in rows.items()
    ]


def _solved(tasks: Sequence[tuple[ExperimentLog, list[Mapping[str, str]]]]) -> list[bool]:
    return [run[SOLVED] == "1" for _, runs in tasks for run in runs]


def _summary(
    key: tuple[str, str],
    values: Mapping[str, list[NDArray[np.float64]]],
    baseline: Mapping[str, list[NDArray[np.float64]]] | None,
    solved: Sequence[bool],
) -> Summary:
    medians = {name: [task[:, 0] for task in tasks] for name, tasks in values.items()}
    ratios = {}
    if baseline is not None and key[1] != BASELINE:
        ratios = {
            name: ratio_interval(runs, [task[:, 0] for task in baseline[name]])
            for name, runs in medians.items()
            if name not in _NO_RATIO
        }
    return Summary(
        planner=key[0],
        sampler=key[1],
        tasks=len(next(iter(values.values()))),
        runs=len(solved),
        success=float(np.mean(solved)),
        measures={name: median_interval(runs) for name, runs in medians.items()},
        censored={name: float(np.concatenate(v)[:, 1].mean()) for name, v in values.items()},
        ratios=ratios,
    )


def median_interval(tasks: Sequence[NDArray[np.float64]]) -> Interval:
    """The median over tasks of the medians over runs.

    The bootstrap draws tasks, and for each of them runs, so that neither the choice of the tasks
    nor the luck of the runs is taken for certain.

    Args:
        tasks: for each task the values of its runs, (R,); infinite ones are allowed.
    """
    rng = np.random.default_rng(0)
    medians = np.array([np.median(runs) for runs in tasks])
    return _interval(medians, np.array([_resampled(runs, rng) for runs in tasks]), rng)


def ratio_interval(
    tasks: Sequence[NDArray[np.float64]], baseline: Sequence[NDArray[np.float64]]
) -> Interval:
    """The median over tasks of the ratio of the medians over runs.

    Args:
        tasks: as for :func:`median_interval`.
        baseline: what to divide by, for the same tasks.
    """
    rng = np.random.default_rng(0)
    medians = (np.array([np.median(runs) for runs in side]) for side in (tasks, baseline))
    resampled = (np.array([_resampled(runs, rng) for runs in side]) for side in (tasks, baseline))
    return _interval(ratio(*medians), ratio(*resampled), rng)


def ratio(values: NDArray[np.float64], baseline: NDArray[np.float64]) -> NDArray[np.float64]:
    """Quotients; two equal values are a tie, also where both are infinite."""
    ones: NDArray[np.float64] = np.ones(values.shape)
    with np.errstate(divide="ignore"):
        return np.divide(values, baseline, out=ones, where=values != baseline)


def _resampled(runs: NDArray[np.float64], rng: np.random.Generator) -> NDArray[np.float64]:
    """Medians of the runs on a task, drawn anew with replacement."""
    drawn = runs[rng.integers(len(runs), size=(_RESAMPLES, len(runs)))]
    medians: NDArray[np.float64] = np.median(drawn, axis=1)
    return medians


def _interval(
    medians: NDArray[np.float64], resampled: NDArray[np.float64], rng: np.random.Generator
) -> Interval:
    """Args: medians of each task, (T,), and for each task its resampled ones, (T, B)."""
    tasks, resamples = resampled.shape
    drawn = rng.integers(tasks, size=(tasks, resamples))
    spread = np.median(resampled[drawn, np.arange(resamples)], axis=0)
    # Quantiles that are values of the sample, because there is nothing between infinite ones.
    low, high = np.quantile(spread, _TAILS, method="inverted_cdf")
    return Interval(float(np.median(medians)), float(low), float(high))
