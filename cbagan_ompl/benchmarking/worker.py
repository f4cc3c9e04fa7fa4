"""The work on one task: heat maps, OMPL's Benchmark, the log."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from zlib import crc32

from ..common.files import write_atomically
from ..common.text import one_line
from ..errors import ConfigError, show
from ..planning.heatmap_sources import (
    AUTO,
    LEARNED,
    SAMPLERS,
    HeatmapSource,
    ModelOrFile,
    heatmap_source,
    resolve_auto,
)
from ..planning.ompl_benchmark import PlannerVariant, RunOptions, check_variants, run_benchmark
from ..sampling.heatmap import Heatmap
from .logs import GEOMETRIC, ExperimentLog, concatenate_logs, format_log, parse_log
from .measures import (
    AUTO_SOURCE,
    FAMILY,
    MAP,
    add_measures,
    check_measures,
    thresholds,
)
from .settings import Settings
from .tasks import BenchmarkTask, heatmap_file


@dataclass(frozen=True)
class Job:
    """A task to be run.

    Attributes:
        task: the task.
        settings: what is compared on it.
        log: the file that is written at the end: OMPL's log with all measures.
    """

    task: BenchmarkTask
    settings: Settings
    log: Path


def check_job(job: Job) -> None:
    """Raise if a job cannot run, before time is spent.

    Raises:
        PlannerError: an unknown planner, or one that no hook reaches on this OMPL.
        ConfigError: an unknown sampler, or a parameter that a planner does not have.
        ModelError: an unusable model file.
        HeatmapError: no heat map of the task where there should be one.
    """
    workspace, task = job.task.workspace, job.task.task
    endpoints = workspace.check_task(task.start, task.goal)
    check_variants(workspace, endpoints, _variants(job), _options(job))


def check_heatmaps(job: Job) -> None:
    """Raise if a heat map of the task is missing.

    Raises:
        HeatmapError: no heat map of the task where there should be one.
    """
    for folder in job.settings.heatmap_dirs.values():
        heatmap_file(folder, job.task)


class UnwritableLogError(ConfigError):
    """A log that cannot be written, as on a full disk: the next one could not be either."""


def run_job(job: Job, after_round: Callable[[], None]) -> None:
    """Run a task and write its log, whole or not at all.

    Args:
        job: the task.
        after_round: called after each round of runs.

    Raises:
        UnwritableLogError: the log cannot be written.
        CbaganOmplError: as for :func:`check_job`.
    """
    workspace, task = job.task.workspace, job.task.task
    endpoints = workspace.check_task(task.start, task.goal)
    recording = run_benchmark(
        job.task.name, workspace, endpoints, _variants(job), _options(job), after_round
    )
    log = concatenate_logs([parse_log(text) for text in recording.logs])
    log = add_measures(
        _add_task(log, job), recording.runs, task.optimal_cost, thresholds(job.settings.within)
    )
    text = format_log(log)
    check_log(parse_log(text), job)  # what cannot be read again is better not written
    write_atomically(job.log, text, UnwritableLogError)


def check_log(log: ExperimentLog, job: Job) -> None:
    """Raise unless a log is that of a task, with all measures of all runs.

    Args:
        log: from :func:`.parse_log`.
        job: the task.

    Raises:
        ConfigError: something else was run, or a measure is missing or makes no sense.
    """
    settings = job.settings
    wanted = {
        "name": job.task.name,
        "runs": settings.runs,
        "time limit": f"{settings.time:g}",
        "planners": [
            f"{GEOMETRIC}{planner}_{sampler}"
            for planner in settings.planners
            for sampler in settings.samplers
        ],
        **_task_parameters(job),
    }
    found = {
        "name": log.name,
        "runs": log.runs,
        "time limit": f"{log.time_limit:g}",
        "planners": [planner.name for planner in log.planners],
        **log.parameters,
    }
    for name, value in wanted.items():
        if found.get(name) != value:
            raise ConfigError(
                f"the log of {job.task.name} is that of something else: {name} is "
                f"{show(found.get(name))} there, where {show(value)} is wanted"
            )
    try:
        check_measures(log, thresholds(settings.within))
    except ConfigError as error:
        raise ConfigError(f"the log of {job.task.name} is damaged: {error}") from error


def _options(job: Job) -> RunOptions:
    settings = job.settings
    seed = (settings.seed + crc32(job.task.name.encode())) % 2**32
    return RunOptions(
        runs=settings.runs,
        time=settings.time,
        range=settings.range,
        tolerance=job.task.grid.resolution,
        sampler=replace(settings.sampler_options, seed=seed),
    )


def _variants(job: Job) -> list[PlannerVariant]:
    settings = job.settings
    samplers = settings.variants()
    sources = {name: _source(job, name) for name in dict.fromkeys(one.source for one in samplers)}
    return [
        PlannerVariant(
            planner,
            sampler.name,
            sources[sampler.source],
            tuple(dict(settings.parameters.get(planner, {})).items()),
            sampler.changes,
            planner in settings.simplify,
        )
        for planner in settings.planners
        for sampler in samplers
    ]


def _source(job: Job, sampler: str) -> HeatmapSource | None:
    if sampler in job.settings.heatmap_dirs:
        heatmap = heatmap_file(job.settings.heatmap_dirs[sampler], job.task)

        def from_file(*_: object) -> Heatmap:
            return heatmap

        return from_file
    model = job.settings.models.get(sampler)
    if model is not None and sampler in set(SAMPLERS) - {LEARNED}:
        raise ConfigError(f"a model cannot be called {sampler}, this is another sampler's name")
    if sampler == AUTO:
        return heatmap_source(*_resolve_auto(job))[1]
    return heatmap_source(sampler if model is None else LEARNED, model)[1]


def _resolve_auto(job: Job) -> tuple[str, ModelOrFile | None]:
    return resolve_auto(AUTO, job.settings.models.get(LEARNED), job.task.workspace.source)


def _add_task(log: ExperimentLog, job: Job) -> ExperimentLog:
    """Return a log with what the task is, and what makes its heat maps here."""
    made_by = {}
    if AUTO in job.settings.sources:
        made_by[AUTO_SOURCE] = _resolve_auto(job)[0]
    return replace(log, parameters={**log.parameters, **_task_parameters(job), **made_by})


def _task_parameters(job: Job) -> dict[str, str]:
    ends = {"start": job.task.task.start, "goal": job.task.task.goal}
    coordinates = {
        f"{role}_{axis} REAL": f"{value:.9g}"
        for role, values in ends.items()
        for axis, value in zip(("x", "y", "yaw"), values, strict=False)
    }
    return {
        MAP: one_line(job.task.grid.name),
        # A map without a kind forms a group by itself.
        FAMILY: one_line(job.task.task.family or job.task.grid.name),
        "task INTEGER": str(job.task.number),
        **coordinates,
        "goal_tolerance REAL": f"{job.task.grid.resolution:.9g}",
    }
