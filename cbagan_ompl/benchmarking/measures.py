"""Properties that are added to the runs of OMPL's logs.

They are written into the log afterwards, because OMPL 2.0 hands its post-run event a copy.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from math import inf, isfinite
from typing import TYPE_CHECKING

from ..errors import ConfigError, show
from .logs import GEOMETRIC, ExperimentLog, PlannerLog, number

if TYPE_CHECKING:
    from ..planning.ompl_benchmark import RunRecord

#: Property of a run: making the heat map and attaching it, seconds.
INFERENCE = "inference time REAL"
#: Property of a run: number of samples from the heat map.
LEARNED = "learned draws INTEGER"
#: Property of a run: number of uniform samples that the hook gave.
UNIFORM = "uniform draws INTEGER"
#: Property of a run: number of motions that were checked.
CHECKS = "collision checks INTEGER"
#: Property of a run: whether its path is exact and passed the second check.
SOLVED = "checked solution BOOLEAN"
#: Property of a run: length of that path.
COST = "checked solution cost REAL"
#: Property of a run: planning time to the first solution, seconds.
FIRST_TIME = "first solution time REAL"
#: Property of a run: cost of the first solution.
FIRST_COST = "first solution cost REAL"
#: Property of an experiment: name of its map.
MAP = "map VARCHAR"
#: Property of an experiment: what kind of map it is.
FAMILY = "map family VARCHAR"
#: Property of an experiment: the least cost of all its runs, or the optimal one where given.
BEST_KNOWN = "best_known_cost REAL"

#: OMPL's own property of runs and of points of progress: seconds.
TIME = "time REAL"
#: OMPL's own property of a run: states in the tree or roadmap.
NODES = "graph states INTEGER"
#: OMPL's own property of points of progress; BIT* and its relatives call it a DOUBLE.
BEST_COST = "best cost"

#: Thresholds of good paths, percent above the best known cost, for which every log has a time.
WITHIN_PERCENT = (10, 5, 2)

# No time, cost or count of a benchmark is larger.
_LARGEST = 1e300

# Fractions of the time limit at which the cost is taken.
_COST_AT = (0.1, 0.25, 0.5, 1.0)


def thresholds(within: int) -> tuple[int, ...]:
    """Return the thresholds of a benchmark: those of every log, and that of the user.

    Example:
        >>> thresholds(5), thresholds(20)
        ((10, 5, 2), (10, 5, 2, 20))
    """
    return tuple(dict.fromkeys((*WITHIN_PERCENT, within)))


def time_within(percent: int) -> str:
    """Return the property of a run: planning time to a cost within a threshold, in percent."""
    return f"time to {percent} percent REAL"


def cost_at(milliseconds: int) -> str:
    """Return the property of a run: its cost after so much planning."""
    return f"cost at {milliseconds} ms REAL"


def fixed_times(limit: float) -> tuple[int, ...]:
    """Return the times at which the cost of runs is taken, in milliseconds.

    Args:
        limit: time limit of the runs, seconds.
    """
    return tuple(sorted({max(1, round(1000 * fraction * limit)) for fraction in _COST_AT}))


def add_measures(
    log: ExperimentLog,
    records: Mapping[str, Sequence[RunRecord]],
    optimal_cost: float | None,
    percents: Sequence[int] = WITHIN_PERCENT,
) -> ExperimentLog:
    """Return a log with the properties of this module added to its runs.

    Args:
        log: log of one task.
        records: the runs of each planner in order, by its name without OMPL's prefix.
        optimal_cost: of the task, where it is known.
        percents: thresholds of good paths, see :func:`thresholds`.
    """
    costs = [run.cost for runs in records.values() for run in runs]
    best_known = min(costs if optimal_cost is None else [*costs, optimal_cost])
    borders = {time_within(percent): (1 + percent / 100) * best_known for percent in percents}
    planners = tuple(
        _add_to_planner(
            planner, records[planner.name.removeprefix(GEOMETRIC)], borders, log.time_limit
        )
        for planner in log.planners
    )
    parameters = dict(log.parameters)
    if isfinite(best_known):
        parameters[BEST_KNOWN] = _format(best_known)
    return replace(log, parameters=parameters, planners=planners)


def _add_to_planner(
    planner: PlannerLog,
    records: Sequence[RunRecord],
    borders: Mapping[str, float],
    limit: float,
) -> PlannerLog:
    runs = []
    for i, (run, record) in enumerate(zip(planner.runs, records, strict=True)):
        points = planner.progress[i] if planner.progress else ()
        costs = cost_history(record, points, float(run[TIME]))
        runs.append({**run, **_properties(record), **_cost_properties(costs, borders, limit)})
    return replace(planner, runs=tuple(runs))


def check_measures(log: ExperimentLog, percents: Sequence[int] = WITHIN_PERCENT) -> None:
    """Raise unless the runs of a log have the properties that statistics and plots are made of.

    Args:
        log: from :func:`.parse_log`.
        percents: as for :func:`add_measures`.

    Raises:
        ConfigError: a property is missing, or its number makes no sense.
    """
    always = (TIME, NODES, INFERENCE, LEARNED, UNIFORM, CHECKS)
    solved = (COST, FIRST_TIME, FIRST_COST, cost_at(fixed_times(log.time_limit)[-1]))
    any_solved = False
    for planner in log.planners:
        for i, run in enumerate(planner.runs):
            of_run = f"run {i} of {planner.name}"
            _check_numbers(of_run, run, always)
            if run.get(SOLVED) not in ("0", "1"):
                raise ConfigError(f"{of_run}: {SOLVED} is {show(run.get(SOLVED))}, not 0 or 1")
            if run[SOLVED] == "1":
                any_solved = True
                _check_numbers(of_run, run, solved)
            elif any(run.get(name) != "" for name in solved):
                raise ConfigError(f"{of_run} has a cost, and no path")
            for percent in percents:
                if run.get(time_within(percent)) != "":
                    _check_numbers(of_run, run, [time_within(percent)])
            for point in planner.progress[i] if planner.progress else ():
                _check_numbers(f"progress of {of_run}", point, [TIME])
    if any_solved:
        _check_numbers("the experiment", log.parameters, [BEST_KNOWN])


def _check_numbers(place: str, values: Mapping[str, str], names: Iterable[str]) -> None:
    for name in names:
        value = number(values.get(name))
        if value is None or not 0 <= value <= _LARGEST:
            raise ConfigError(f"{place}: {name} is {show(values.get(name))}")


def cost_history(
    record: RunRecord, points: Sequence[Mapping[str, str]], time: float
) -> list[tuple[float, float]]:
    """Return each better solution of a run, (seconds, cost); none for an unsolved one.

    They come from the collision checks of a planner that tells its cost meanwhile, otherwise from
    the progress data of OMPL's log; the last one is that of the end of the run.

    Args:
        record: record of the run.
        points: its progress data in OMPL's log.
        time: duration of the run, seconds.
    """
    if not isfinite(record.cost):
        return []
    return _keep_improvements([*(record.costs or _logged_points(points)), (time, record.cost)])


def logged_costs(
    run: Mapping[str, str], points: Sequence[Mapping[str, str]]
) -> list[tuple[float, float]]:
    """Return each better solution of a run, (seconds, cost), from a log with all measures.

    Args:
        run: the properties of the run.
        points: its progress data.
    """
    first, cost = number(run[FIRST_TIME]), number(run[COST])
    if first is None or cost is None:
        return []
    later = [(when, better) for when, better in _logged_points(points) if when > first]
    return _keep_improvements([(first, float(run[FIRST_COST])), *later, (float(run[TIME]), cost)])


def _logged_points(points: Sequence[Mapping[str, str]]) -> list[tuple[float, float]]:
    return [
        (float(point[TIME]), cost)
        for point in points
        for name, text in point.items()
        if name.startswith(BEST_COST) and (cost := number(text)) is not None
    ]


def _keep_improvements(costs: Sequence[tuple[float, float]]) -> list[tuple[float, float]]:
    history = [costs[0]]
    for when, cost in costs[1:]:
        if cost < history[-1][1]:
            history.append((when, cost))
    return history


def _properties(record: RunRecord) -> dict[str, str]:
    solved = isfinite(record.cost)
    return {
        INFERENCE: _format(record.inference_s),
        LEARNED: str(record.sample_counts["learned"]),
        UNIFORM: str(record.sample_counts["uniform"]),
        CHECKS: str(record.collision_checks),
        SOLVED: str(int(solved)),
        COST: _format(record.cost),
    }


def _cost_properties(
    costs: Sequence[tuple[float, float]], borders: Mapping[str, float], limit: float
) -> dict[str, str]:
    first_time, first_cost = costs[0] if costs else (inf, inf)
    properties = {FIRST_TIME: first_time, FIRST_COST: first_cost}
    for name, border in borders.items():
        properties[name] = next((t for t, cost in costs if cost <= border), inf)
    for milliseconds in fixed_times(limit):
        # OMPL looks at the clock now and then only, so runs may end a little after the limit.
        last = milliseconds / 1000 if milliseconds < 1000 * limit else inf
        properties[cost_at(milliseconds)] = min((c for t, c in costs if t <= last), default=inf)
    return {name: _format(value) for name, value in properties.items()}


def _format(value: float) -> str:
    return f"{value:.9g}" if isfinite(value) else ""
