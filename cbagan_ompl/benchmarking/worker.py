"""The work on one task."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from zlib import crc32

from ..errors import ConfigError
from ..planning.heatmap_sources import SAMPLERS, HeatmapSource, heatmap_source
from ..planning.ompl_benchmark import PlannerVariant, RunOptions, check_variants, run_benchmark
from ..sampling.heatmap import Heatmap
from .logs import ExperimentLog, format_log, join_logs, parse_log
from .measures import FAMILY, MAP, add_measures
from .settings import LEARNED, Settings
from .tasks import BenchmarkTask, heatmap_file


@dataclass(frozen=True)
class Job:
    """A task to be run.

    Attributes:
        task: the task.
        settings: what is compared on it.
        log: file to be written at the end: OMPL's log with all measures.
    """

    task: BenchmarkTask
    settings: Settings
    log: Path

    @property
    def draft(self) -> Path:
        """File that becomes the log once it is whole."""
        return self.log.with_suffix(".part")


def check_job(job: Job) -> None:
    """Refuse what cannot run, before time is spent.

    Raises:
        PlannerError: an unknown planner, or one that no hook reaches on this OMPL.
        ConfigError: an unknown sampler, or a parameter that a planner does not have.
        ModelError: an unusable model file.
        HeatmapError: no heat map of the task where there should be one.
    """
    grid, task = job.task.grid, job.task.task
    ends = grid.check_task(task.start, task.goal)
    check_variants(grid, ends, _entrants(job), _options(job))


def check_heatmaps(job: Job) -> None:
    """Refuse a task that lacks a heat map of its own.

    Raises:
        HeatmapError: no heat map of the task where there should be one.
    """
    for folder in job.settings.heatmap_dirs.values():
        heatmap_file(folder, job.task)


def run_job(job: Job, after_round: Callable[[], None]) -> None:
    """Run a task and write its log, whole or not at all.

    Args:
        job: the task.
        after_round: called after each round of runs.
    """
    grid, task = job.task.grid, job.task.task
    ends = grid.check_task(task.start, task.goal)
    recording = run_benchmark(job.task.name, grid, ends, _entrants(job), _options(job), after_round)
    log = join_logs([parse_log(text) for text in recording.logs])
    log = add_measures(_described(log, job), recording.runs, task.optimal_cost)
    job.draft.write_text(format_log(log), encoding="utf-8")
    job.draft.replace(job.log)


def _options(job: Job) -> RunOptions:
    settings = job.settings
    return RunOptions(
        runs=settings.runs,
        time=settings.time,
        range=settings.range,
        tolerance=job.task.grid.resolution,
        sampler=settings.sampler_options((settings.seed + crc32(job.task.name.encode())) % 2**32),
    )


def _entrants(job: Job) -> list[PlannerVariant]:
    settings = job.settings
    providers = {sampler: _provider(job, sampler) for sampler in settings.samplers}
    return [
        PlannerVariant(
            planner, sampler, provide, tuple(dict(settings.parameters.get(planner, {})).items())
        )
        for planner in settings.planners
        for sampler, provide in providers.items()
    ]


def _provider(job: Job, sampler: str) -> HeatmapSource | None:
    if sampler in job.settings.heatmap_dirs:
        heatmap = heatmap_file(job.settings.heatmap_dirs[sampler], job.task)

        def from_file(*_: object) -> Heatmap:
            return heatmap

        return from_file
    model = job.settings.models.get(sampler)
    if model is not None and sampler in set(SAMPLERS) - {LEARNED}:
        raise ConfigError(f"a model cannot be called {sampler}, this is another sampler's name")
    return heatmap_source(sampler if model is None else LEARNED, model)[1]


def _described(log: ExperimentLog, job: Job) -> ExperimentLog:
    (start_x, start_y), (goal_x, goal_y) = job.task.task.start, job.task.task.goal
    return replace(
        log,
        parameters={
            **log.parameters,
            MAP: job.task.grid.name,
            # A map without a family is one of its own.
            FAMILY: job.task.task.family or job.task.grid.name,
            "task INTEGER": str(job.task.number),
            "start_x REAL": f"{start_x:.9g}",
            "start_y REAL": f"{start_y:.9g}",
            "goal_x REAL": f"{goal_x:.9g}",
            "goal_y REAL": f"{goal_y:.9g}",
            "goal_tolerance REAL": f"{job.task.grid.resolution:.9g}",
        },
    )
