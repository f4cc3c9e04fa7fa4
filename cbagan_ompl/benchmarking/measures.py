"""Properties that are added to the runs of OMPL's logs.

They are written into the log afterwards, because OMPL 2.0 hands its post-run event a copy.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from math import inf, isfinite
from typing import TYPE_CHECKING

from ..errors import ConfigError, show
from ..planning.improvements import Improvement
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
#: Property of a run: length of that path, simplified where that was asked for.
COST = "checked solution cost REAL"
#: Property of a run: planning time to the first solution, seconds.
FIRST_TIME = "first solution time REAL"
#: Property of a run: cost of the first solution.
FIRST_COST = "first solution cost REAL"
#: Property of a run: nodes that the planner has added, more than it has at its end if it prunes.
NODES_ADDED = "nodes added INTEGER"
#: Property of a run: nodes that it had added when it found its first solution.
FIRST_NODES = "nodes at first solution INTEGER"
#: Property of a run: time in OMPL's path simplifier, seconds; 0 where it was not called.
SIMPLIFY = "simplification time REAL"
#: Property of an experiment: name of its map.
MAP = "map VARCHAR"
#: Property of an experiment: what kind of map it is.
FAMILY = "map family VARCHAR"
#: Property of an experiment: the sampler that ``auto`` stood for on its map.
AUTO_SOURCE = "auto VARCHAR"
#: Property of an experiment: the least cost of all its runs, or the optimal one where given.
BEST_KNOWN = "best_known_cost REAL"

#: OMPL's own property of runs and of points of progress: seconds.
TIME = "time REAL"
#: OMPL's own property of a run: states in the tree or roadmap.
NODES = "graph states INTEGER"
#: OMPL's own property of points of progress; BIT* and its relatives call it a DOUBLE.
BEST_COST = "best cost"

#: OMPL's own property of points of progress of roadmap planners.
MILESTONES = "milestone count INTEGER"

#: Thresholds of good paths, percent above the best known cost, for which every log has a time.
WITHIN_PERCENT = (10, 5, 2)

# No time, cost or count of a benchmark is larger.
_LARGEST = 1e100

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


def nodes_within(percent: int) -> str:
    """Return the property of a run: nodes added until its cost was within a threshold."""
    return f"nodes to {percent} percent INTEGER"


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
    costs = [run.final_cost for runs in records.values() for run in runs]
    best_known = min(costs if optimal_cost is None else [*costs, optimal_cost])
    borders = {percent: (1 + percent / 100) * best_known for percent in percents}
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
    borders: Mapping[int, float],
    limit: float,
) -> PlannerLog:
    runs = []
    for i, (run, record) in enumerate(zip(planner.runs, records, strict=True)):
        points = planner.progress[i] if planner.progress else ()
        nodes = int(run[NODES]) if record.nodes is None else record.nodes
        history = improvements_of(record, points, float(run[TIME]), nodes)
        added = {**_properties(record), NODES_ADDED: str(nodes)}
        runs.append({**run, **added, **_history_properties(history, borders, limit)})
    return replace(planner, runs=tuple(runs))


def check_measures(log: ExperimentLog, percents: Sequence[int] = WITHIN_PERCENT) -> None:
    """Raise unless the runs of a log have the properties that statistics and plots are made of.

    Args:
        log: from :func:`.parse_log`.
        percents: as for :func:`add_measures`.

    Raises:
        ConfigError: a property is missing, or its number makes no sense.
    """
    always = (TIME, SIMPLIFY, NODES, NODES_ADDED, INFERENCE, LEARNED, UNIFORM, CHECKS)
    solved = (COST, FIRST_TIME, FIRST_COST, FIRST_NODES, cost_at(fixed_times(log.time_limit)[-1]))
    any_solved = False
    for planner in log.planners:
        for i, run in enumerate(planner.runs):
            of_run = f"run {i} of {planner.name}"
            _check_numbers(of_run, run, always)
            any_solved |= _check_solution(of_run, run, solved)
            for percent in percents:
                if run.get(time_within(percent)) != "":
                    _check_numbers(of_run, run, [time_within(percent), nodes_within(percent)])
            for point in planner.progress[i] if planner.progress else ():
                _check_numbers(f"progress of {of_run}", point, [TIME])
    if any_solved:
        _check_numbers("the experiment", log.parameters, [BEST_KNOWN])


def _check_solution(of_run: str, run: Mapping[str, str], names: Iterable[str]) -> bool:
    """Return whether a run is solved; raise unless it has all properties of a solution, or none."""
    if run.get(SOLVED) not in ("0", "1"):
        raise ConfigError(f"{of_run}: {SOLVED} is {show(run.get(SOLVED))}, not 0 or 1")
    if run[SOLVED] == "1":
        _check_numbers(of_run, run, names)
        return True
    if any(run.get(name) != "" for name in names):
        raise ConfigError(f"{of_run} has a cost, and no path")
    return False


def _check_numbers(place: str, values: Mapping[str, str], names: Iterable[str]) -> None:
    for name in names:
        value = number(values.get(name))
        if value is None or not 0 <= value <= _LARGEST:
            raise ConfigError(f"{place}: {name} is {show(values.get(name))}")


def improvements_of(
    record: RunRecord, points: Sequence[Mapping[str, str]], time: float, nodes: int
) -> list[Improvement]:
    """Return each better solution of a run; none for an unsolved one.

    They come from the collision checks of a planner that tells its cost meanwhile, otherwise from
    the progress data of OMPL's log. Then come the path at the end of the run, and the simplified
    one. Where nobody tells how many nodes there were, there are those of the end.

    Args:
        record: record of the run.
        points: its progress data in OMPL's log.
        time: duration of the run, seconds.
        nodes: that the planner has added at its end.
    """
    if not isfinite(record.final_cost):
        return []
    seen = record.improvements or _logged_points(points)
    history = [*seen, Improvement(time, record.cost, nodes)]
    if record.simplify_s is not None:
        history.append(Improvement(time + record.simplify_s, record.final_cost, nodes))
    return [
        one if one.nodes is not None else one._replace(nodes=nodes)
        for one in _keep_improvements(history)
    ]


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
    later = [point for point in _logged_points(points) if point.seconds > first]
    end = float(run[TIME]) + float(run[SIMPLIFY])
    history = [Improvement(first, float(run[FIRST_COST])), *later, Improvement(end, cost)]
    return [(one.seconds, one.cost) for one in _keep_improvements(history)]


def _logged_points(points: Sequence[Mapping[str, str]]) -> list[Improvement]:
    found = []
    for point in points:
        nodes = number(point.get(MILESTONES))
        found += [
            Improvement(float(point[TIME]), cost, None if nodes is None else int(nodes))
            for name, text in point.items()
            if name.startswith(BEST_COST) and (cost := number(text)) is not None
        ]
    return found


def _keep_improvements(history: Sequence[Improvement]) -> list[Improvement]:
    kept = [history[0]]
    for one in history[1:]:
        if one.cost < kept[-1].cost:
            kept.append(one)
    return kept


def _properties(record: RunRecord) -> dict[str, str]:
    return {
        INFERENCE: _format(record.inference_s),
        LEARNED: str(record.sample_counts["learned"]),
        UNIFORM: str(record.sample_counts["uniform"]),
        CHECKS: str(record.collision_checks),
        SOLVED: str(int(isfinite(record.final_cost))),
        COST: _format(record.final_cost),
        SIMPLIFY: _format(record.simplify_s or 0.0),
    }


def _history_properties(
    history: Sequence[Improvement], borders: Mapping[int, float], limit: float
) -> dict[str, str]:
    never = Improvement(inf, inf)
    first = history[0] if history else never
    properties = {FIRST_TIME: first.seconds, FIRST_COST: first.cost, FIRST_NODES: first.nodes}
    for percent, border in borders.items():
        good = next((one for one in history if one.cost <= border), never)
        properties |= {time_within(percent): good.seconds, nodes_within(percent): good.nodes}
    for milliseconds in fixed_times(limit):
        # OMPL looks at the clock now and then only, so runs may end a little after the limit.
        last = milliseconds / 1000 if milliseconds < 1000 * limit else inf
        properties[cost_at(milliseconds)] = min(
            (one.cost for one in history if one.seconds <= last), default=inf
        )
    return {name: _format(inf if value is None else value) for name, value in properties.items()}


def _format(value: float) -> str:
    return f"{value:.9g}" if isfinite(value) else ""
