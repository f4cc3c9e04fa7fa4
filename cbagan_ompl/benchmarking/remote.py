"""Running the tasks of a benchmark on other machines, with which this one shares no file."""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import replace
from pathlib import Path

from tqdm import tqdm

from ..common.files import read_bytes, write_atomically
from ..common.parallel import Executor, ProcessDeath, ProcessDied
from ..common.text import one_line
from ..errors import ConfigError, HeatmapError
from ..inference.copies import Files, read_copy, write_files
from .inputs import model_files
from .runner import run_jobs
from .tasks import heatmap_path
from .worker import Job


def run_jobs_remotely(
    jobs: Sequence[Job], executor: Executor, show_progress: bool = True
) -> dict[str, str]:
    """Run jobs on an executor; maps, heat maps and models go there, the logs are written here.

    All runs on a task are done by one process, whatever number of machines there are.

    Args:
        jobs: the tasks, of one benchmark.
        executor: where they run.
        show_progress: show a progress bar with the remaining time.

    Returns:
        For each task that failed, by its name, the end of its output.

    Raises:
        KeyboardInterrupt: after an interrupt; the tasks that were running are terminated.
        ConfigError: a log cannot be written.
        ModelError: a model cannot be read.
        HeatmapError: a heat map cannot be read.
        ClusterError: the cluster cannot do the work.
    """
    if not jobs:
        return {}
    calls = _Calls(jobs)
    models = {sampler: read_copy(path) for sampler, path in model_files(jobs[0].settings).items()}
    failures: dict[str, str] = {}
    bar = tqdm(
        total=sum(job.settings.runs for job in jobs),
        unit="round",
        disable=not show_progress,
        dynamic_ncols=True,
    )
    with bar, closing(executor.completed(_run_job, calls, (models,))) as completed:
        for name, result in completed:
            job = calls.jobs[name]
            if isinstance(result, ProcessDeath):
                failures[name] = result.reason
                said = one_line(result.reason.splitlines()[-1])
                bar.write(f"task {name} failed: {said}", sys.stderr)
            else:
                write_atomically(job.log, result, ConfigError)
            bar.update(job.settings.runs)
    return failures


class _Calls(Mapping[str, tuple[Job, Mapping[str, Files]]]):
    """The arguments of each job by its name; heat maps are read when they are sent."""

    def __init__(self, jobs: Sequence[Job]) -> None:
        self.jobs = {job.task.name: job for job in jobs}

    def __getitem__(self, name: str) -> tuple[Job, Mapping[str, Files]]:
        job = self.jobs[name]
        return job, _read_heatmaps(job)

    def __iter__(self) -> Iterator[str]:
        return iter(self.jobs)

    def __len__(self) -> int:
        return len(self.jobs)


def _read_heatmaps(job: Job) -> Mapping[str, Files]:
    """Return the heat maps of a task by sampler."""
    paths = {
        sampler: heatmap_path(folder, job.task)
        for sampler, folder in job.settings.heatmap_dirs.items()
    }
    return {sampler: {path.name: read_bytes(path, HeatmapError)} for sampler, path in paths.items()}


def _run_job(models: Mapping[str, Files], job: Job, heatmaps: Mapping[str, Files]) -> str:
    """Run a job in a folder of this machine's own, and return its log."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        settings = replace(
            job.settings,
            models={
                sampler: str(write_files(folder / "models" / str(i), files))
                for i, (sampler, files) in enumerate(models.items())
            },
            heatmap_dirs={
                sampler: str(write_files(folder / "heatmaps" / str(i), files).parent)
                for i, (sampler, files) in enumerate(heatmaps.items())
            },
        )
        log = folder / "log"
        failures = run_jobs([replace(job, settings=settings, log=log)], 1, show_progress=False)
        if failures:
            raise ProcessDied(failures[job.task.name])
        return log.read_text(encoding="utf-8")
