"""OMPL's benchmark logs: reading, concatenating and writing them.

The format is that of `OMPL's documentation of Benchmark
<https://ompl.kavrakilab.org/benchmark.html>`_. Properties that this package does not know are kept.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import chain
from math import inf, isfinite
from pathlib import Path

from ..common.files import read_text
from ..errors import ConfigError, show
from .log_lines import BLOCK_BEGIN, BLOCK_END, FINITE, MAX_LOG_BYTES, NUMBER, LogLines, check_names

#: OMPL's logs put this before the name of a geometric planner.
GEOMETRIC = "geometric_"

#: Separates the hosts of a log whose runs were done on several.
HOSTS = ", "


@dataclass(frozen=True)
class PlannerLog:
    """The runs of one planner.

    Attributes:
        name: name of the planner, with OMPL's prefix.
        settings: lines ``parameter = value``.
        runs: the properties of each run, ``"graph states INTEGER"`` -> text; a property that a run
            does not have is missing or empty.
        progress: the progress data of each run: points in time, each a property -> text; empty
            for a planner without such data.
    """

    name: str
    settings: tuple[str, ...]
    runs: tuple[Mapping[str, str], ...]
    progress: tuple[tuple[Mapping[str, str], ...], ...] = ()


@dataclass(frozen=True)
class ExperimentLog:
    """The log of one experiment: the runs of all planners on one problem.

    Attributes:
        version: ``"OMPL version 2.0.1"``.
        name: name of the experiment, without blanks.
        parameters: properties of the experiment, ``"map VARCHAR"`` -> text.
        host: name of the machine; several with :data:`HOSTS` between them.
        date: time at which the experiment began.
        setup: OMPL's description of the problem.
        cpu: OMPL's description of the processor, empty where it gives none.
        seed: seed of OMPL's generators.
        time_limit: of a run, seconds.
        memory_limit: of a run, megabytes.
        runs: number of runs of each planner.
        total_time: of the experiment, seconds.
        enums: name and values of each enumeration.
        planners: the planners, in the order in which they ran.
    """

    version: str
    name: str
    parameters: Mapping[str, str]
    host: str
    date: str
    setup: str
    cpu: str
    seed: str
    time_limit: float
    memory_limit: float
    runs: int
    total_time: float
    enums: tuple[tuple[str, ...], ...]
    planners: tuple[PlannerLog, ...] = field(repr=False)


def read_log(path: Path) -> ExperimentLog:
    """Return the content of a log file.

    Raises:
        ConfigError: the file cannot be read, is larger than :data:`.MAX_LOG_BYTES`, or is no log;
            the message names it.
    """
    text = read_text(path, ConfigError, MAX_LOG_BYTES)
    try:
        return parse_log(text)
    except ConfigError as error:
        raise ConfigError(f"{path}: {error}") from error


def parse_log(text: str) -> ExperimentLog:
    """Return the content of a log that OMPL's Benchmark or :func:`format_log` wrote.

    Nothing is taken on trust: names of properties, their types and numbers are checked, and counts
    must agree with the lines. The database is made of what passed.

    Raises:
        ConfigError: the text is no such log, or is cut off.
    """
    lines = LogLines(text)
    try:
        log = ExperimentLog(
            version=lines.match(r"([A-Za-z]\S{0,49} version \S.{0,99})"),
            name=lines.match(r"Experiment (\S.{0,299})"),
            parameters=dict(
                _parse_parameter(line)
                for line in lines.several(r"([0-9]{1,3}) experiment properties", "0")
            ),
            host=lines.match(r"Running on (.{1,1000})"),
            date=lines.match(r"Starting at (.{1,100})"),
            setup=lines.block(),
            cpu=lines.block(),
            seed=lines.match(r"([0-9]{1,20}) is the random seed"),
            time_limit=float(lines.match(rf"({FINITE}) seconds per run")),
            memory_limit=float(lines.match(rf"({FINITE}) MB per run")),
            runs=int(lines.match(r"([0-9]{1,7}) runs per planner")),
            total_time=float(lines.match(rf"({FINITE}) seconds spent to collect the data")),
            enums=tuple(
                tuple(line.split("|")) for line in lines.several(r"([0-9]{1,3}) enum types?", "0")
            ),
            planners=tuple(
                _parse_planner(lines) for _ in range(int(lines.match(r"([0-9]{1,4}) planners")))
            ),
        )
        lines.end()
        if not all(map(isfinite, (log.time_limit, log.memory_limit, log.total_time))):
            raise ValueError("a limit or the total time is infinite")
        check_names(log.parameters)
        if any(len(planner.runs) != log.runs for planner in log.planners):
            raise ValueError(f"not every planner has {log.runs} runs")
        return log
    except ValueError as error:
        raise ConfigError(
            f"no benchmark log of OMPL, or one that is cut off (line {lines.number}): {error}"
        ) from error


def _parse_parameter(line: str) -> tuple[str, str]:
    name, _, value = line.partition(" = ")
    is_text = name.endswith((" VARCHAR", " TEXT"))
    if not (value.isprintable() if is_text else NUMBER.fullmatch(value)):
        raise ValueError(f"{show(line)} is no property of an experiment with its value")
    return name, value


def _parse_planner(lines: LogLines) -> PlannerLog:
    name = lines.match(r"(\S.{0,299})")
    settings = lines.several(r"([0-9]{1,4}) common properties")
    properties = lines.properties(r"([0-9]{1,4}) properties for each run")
    runs = tuple(lines.values(row, properties, "; ") for row in lines.several(r"([0-9]{1,7}) runs"))
    progress: tuple[tuple[dict[str, str], ...], ...] = ()
    progress_properties = lines.properties(r"([0-9]{1,4}) progress properties for each run", "0")
    if progress_properties:
        progress = tuple(
            lines.points(row, progress_properties) for row in lines.several(r"([0-9]{1,7}) runs")
        )
        if len(progress) != len(runs):
            raise ValueError(f"progress of {len(progress)} runs, there are {len(runs)}")
    lines.match(r"(\.)")
    return PlannerLog(name, settings, runs, progress)


def concatenate_logs(logs: Sequence[ExperimentLog]) -> ExperimentLog:
    """Return the log of the runs of several logs, as OMPL would have written it for all at once.

    Args:
        logs: logs of the same problem and the same planners, in the order of the runs.
    """
    first = logs[0]
    return replace(
        first,
        host=HOSTS.join(dict.fromkeys(log.host for log in logs)),
        runs=sum(log.runs for log in logs),
        total_time=sum(log.total_time for log in logs),
        planners=tuple(
            replace(
                parts[0],
                runs=tuple(chain.from_iterable(part.runs for part in parts)),
                progress=tuple(chain.from_iterable(part.progress for part in parts)),
            )
            for parts in zip(*(log.planners for log in logs), strict=True)
        ),
    )


def format_log(log: ExperimentLog) -> str:
    """Return the text of a log, as OMPL writes it; :func:`parse_log` reads it back."""
    lines = [
        log.version,
        f"Experiment {log.name}",
        f"{len(log.parameters)} experiment properties",
        *(f"{name} = {value}" for name, value in log.parameters.items()),
        f"Running on {log.host}",
        f"Starting at {log.date}",
        *(BLOCK_BEGIN, log.setup, BLOCK_END),
        *((BLOCK_BEGIN, log.cpu, BLOCK_END) if log.cpu else ()),
        f"{log.seed} is the random seed",
        f"{log.time_limit:g} seconds per run",
        f"{log.memory_limit:g} MB per run",
        f"{log.runs} runs per planner",
        f"{log.total_time:g} seconds spent to collect the data",
        f"{len(log.enums)} enum type{'' if len(log.enums) == 1 else 's'}",
        *("|".join(enum) for enum in log.enums),
        f"{len(log.planners)} planners",
        *chain.from_iterable(_format_planner(planner) for planner in log.planners),
    ]
    return "\n".join(lines) + "\n"


def _format_planner(planner: PlannerLog) -> Iterator[str]:
    properties = properties_of(planner.runs)
    yield planner.name
    yield f"{len(planner.settings)} common properties"
    yield from planner.settings
    yield f"{len(properties)} properties for each run"
    yield from properties
    yield f"{len(planner.runs)} runs"
    for run in planner.runs:
        yield "".join(f"{run.get(name, '')}; " for name in properties)
    progress_properties = properties_of(chain.from_iterable(planner.progress))
    if progress_properties:
        yield f"{len(progress_properties)} progress properties for each run"
        yield from progress_properties
        yield f"{len(planner.progress)} runs"
        for points in planner.progress:
            yield "".join(
                "".join(f"{point.get(name, '')}," for name in progress_properties) + ";"
                for point in points
            )
    yield "."


def properties_of(rows: Iterable[Mapping[str, str]]) -> list[str]:
    """Return the names of all properties of some runs or points in time, sorted."""
    return sorted(set(chain.from_iterable(rows)))


def number(text: str | None) -> float | None:
    """Return a number of a log, None where it is missing or infinite."""
    value = float(text) if text else inf
    return value if isfinite(value) else None
