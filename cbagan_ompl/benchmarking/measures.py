"""Properties that are added to the runs of OMPL's logs.

They are written into the log afterwards, because OMPL 2.0 hands its post-run event a copy.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import inf, isfinite
from typing import TYPE_CHECKING

from .logs import GEOMETRIC, ExperimentLog, PlannerLog, number

if TYPE_CHECKING:
    from ..planning.ompl_benchmark import RunRecord

#: Property of a run: making the heat map and attaching it, seconds.
INFERENCE = "inference time REAL"
#: Property of a run: draws from the heat map.
LEARNED = "learned draws INTEGER"
#: Property of a run: the uniform draws among the hook's.
UNIFORM = "uniform draws INTEGER"
#: Property of a run: motions that were checked.
CHECKS = "collision checks INTEGER"
#: Property of a run: whether its path is exact and passed the check again.
SOLVED = "checked solution BOOLEAN"
#: Property of a run: length of that path.
COST = "checked solution cost REAL"
#: Property of a run: planning time to the first solution, seconds.
FIRST_TIME = "first solution time REAL"
#: Property of a run: cost of the first solution.
FIRST_COST = "first solution cost REAL"
#: Property of an experiment: name of its map.
MAP = "map VARCHAR"
FAMILY = "map family VARCHAR"
#: Property of an experiment: the least cost of all its runs, or the optimal one where given.
BEST_KNOWN = "best_known_cost REAL"

#: OMPL's own property of runs and of points of progress: seconds.
TIME = "time REAL"
#: OMPL's own property of a run: states in the tree or roadmap.
NODES = "graph states INTEGER"
#: OMPL's own property of points of progress; BIT* and its kin call it a DOUBLE.
BEST_COST = "best cost"

#: Time is taken until the cost is within these percents of the best known one.
WITHIN_PERCENT = (10, 5, 2)

# Shares of the time limit at which the cost is taken.
_COST_AT = (0.1, 0.25, 0.5, 1.0)


def time_within(percent: int) -> str:
    """Property of a run: planning time to a cost within so many percent of the best known one."""
    return f"time to {percent} percent REAL"


def cost_at(milliseconds: int) -> str:
    """Property of a run: its cost after so much planning."""
    return f"cost at {milliseconds} ms REAL"


def fixed_times(limit: float) -> tuple[int, ...]:
    """The times, in milliseconds, at which the cost of runs with a time limit is taken."""
    return tuple(sorted({max(1, round(1000 * share * limit)) for share in _COST_AT}))


def add_measures(
    log: ExperimentLog, records: Mapping[str, Sequence[RunRecord]], optimal_cost: float | None
) -> ExperimentLog:
    """Add to each run of a log what is known of it.

    Args:
        log: of one task.
        records: for each planner, by its name without OMPL's prefix, its runs in order.
        optimal_cost: of the task, where it is known.
    """
    costs = [run.cost for runs in records.values() for run in runs]
    best_known = min(costs if optimal_cost is None else [*costs, optimal_cost])
    limit = log.time_limit
    planners = tuple(
        _measured(planner, records[planner.name.removeprefix(GEOMETRIC)], best_known, limit)
        for planner in log.planners
    )
    parameters = dict(log.parameters)
    if isfinite(best_known):
        parameters[BEST_KNOWN] = _text(best_known)
    return replace(log, parameters=parameters, planners=planners)


def _measured(
    planner: PlannerLog, records: Sequence[RunRecord], best_known: float, limit: float
) -> PlannerLog:
    runs = []
    for i, (run, record) in enumerate(zip(planner.runs, records, strict=True)):
        points = planner.progress[i] if planner.progress else ()
        costs = cost_history(record, points, float(run[TIME]))
        runs.append({**run, **_properties(record), **_cost_properties(costs, best_known, limit)})
    return replace(planner, runs=tuple(runs))


def cost_history(
    record: RunRecord, points: Sequence[Mapping[str, str]], time: float
) -> list[tuple[float, float]]:
    """The better and better solutions of a run, (seconds, cost); empty for an unsolved one.

    Seen from the planner's callbacks where it tells its cost there, otherwise from the progress
    data of OMPL's log, and in any case at the end of the run.

    Args:
        record: of the run.
        points: its progress in OMPL's log.
        time: that it took, seconds.
    """
    if not isfinite(record.cost):
        return []
    return _improvements([*(record.costs or _logged(points)), (time, record.cost)])


def logged_costs(
    run: Mapping[str, str], points: Sequence[Mapping[str, str]]
) -> list[tuple[float, float]]:
    """The better and better solutions of a run, from a log with all measures.

    Args:
        run: its properties.
        points: its progress.
    """
    first, cost = number(run[FIRST_TIME]), number(run[COST])
    if first is None or cost is None:
        return []
    later = [(when, better) for when, better in _logged(points) if when > first]
    return _improvements([(first, float(run[FIRST_COST])), *later, (float(run[TIME]), cost)])


def _logged(points: Sequence[Mapping[str, str]]) -> list[tuple[float, float]]:
    return [
        (float(point[TIME]), cost)
        for point in points
        for name, text in point.items()
        if name.startswith(BEST_COST) and (cost := number(text)) is not None
    ]


def _improvements(costs: Sequence[tuple[float, float]]) -> list[tuple[float, float]]:
    history = [costs[0]]
    for when, cost in costs[1:]:
        if cost < history[-1][1]:
            history.append((when, cost))
    return history


def _properties(record: RunRecord) -> dict[str, str]:
    solved = isfinite(record.cost)
    return {
        INFERENCE: _text(record.inference_s),
        LEARNED: str(record.sample_counts["learned"]),
        UNIFORM: str(record.sample_counts["uniform"]),
        CHECKS: str(record.collision_checks),
        SOLVED: str(int(solved)),
        COST: _text(record.cost),
    }


def _cost_properties(
    costs: Sequence[tuple[float, float]], best_known: float, limit: float
) -> dict[str, str]:
    first_time, first_cost = costs[0] if costs else (inf, inf)
    properties = {FIRST_TIME: first_time, FIRST_COST: first_cost}
    for percent in WITHIN_PERCENT:
        border = (1 + percent / 100) * best_known
        properties[time_within(percent)] = next((t for t, cost in costs if cost <= border), inf)
    for milliseconds in fixed_times(limit):
        # OMPL looks at the clock now and then only, so runs may end a little after the limit.
        last = milliseconds / 1000 if milliseconds < 1000 * limit else inf
        properties[cost_at(milliseconds)] = min((c for t, c in costs if t <= last), default=inf)
    return {name: _text(value) for name, value in properties.items()}


def _text(value: float) -> str:
    return f"{value:.9g}" if isfinite(value) else ""
