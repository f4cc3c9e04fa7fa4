"""A whole benchmark: its folder, its tasks, and what is made of their logs."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path

from ..errors import ConfigError
from .database import write_database
from .logs import parse_log
from .plots import save_plots
from .report import Circumstances, markdown, summary_json
from .runner import run_jobs
from .settings import Settings
from .statistics import results_of
from .tasks import BenchmarkTask
from .worker import Job, check_heatmaps, check_job

_SETTINGS, _LOGS = "settings.json", "logs"


class Benchmark:
    """The tasks of a benchmark and the folder of its results.

    Attributes:
        folder: where the results go.

    Args:
        tasks: to be run.
        settings: what is compared on them.
        folder: made if need be.
        resume: go on with the tasks that have no log yet.

    Raises:
        ConfigError: the folder holds a benchmark that is not to be gone on with, or another one;
            or an option that makes no sense.
        PlannerError: an unknown planner, or one that no hook reaches on this OMPL.
        ModelError: an unusable model file.
        HeatmapError: a task without a heat map where there should be one.
    """

    def __init__(
        self, tasks: Sequence[BenchmarkTask], settings: Settings, folder: Path, resume: bool = False
    ) -> None:
        self.folder = folder
        logs = folder / _LOGS
        self._jobs = [Job(task, settings, logs / f"{task.name}.log") for task in tasks]
        check_job(self._jobs[0])
        for job in self._jobs:
            check_heatmaps(job)
        saved = folder / _SETTINGS
        if saved.is_file() and not resume:
            raise ConfigError(f"{folder} holds a benchmark: go on with --resume, or choose another")
        if saved.is_file() and not settings.is_saved_in(saved):
            raise ConfigError(
                f"{folder} holds a benchmark with other options, see {saved.name}: give the same "
                "ones, or choose another folder"
            )
        try:
            logs.mkdir(parents=True, exist_ok=True)
            settings.save(saved)
        except OSError as error:
            raise ConfigError(f"cannot write to {folder}: {error.strerror or error}") from error

    def run(self, processes: int, show_progress: bool = True) -> dict[str, str]:
        """Run the tasks that have no log yet; arguments and result as for :func:`.run_jobs`."""
        left = [job for job in self._jobs if not job.log.is_file()]
        return run_jobs(left, processes, show_progress)

    def finished_logs(self) -> list[Path]:
        """The logs of the tasks that have been run."""
        return [job.log for job in self._jobs if job.log.is_file()]


def write_results(
    logs: Sequence[Path],
    settings: Settings,
    failures: Mapping[str, str],
    folder: Path,
    command: str,
) -> str:
    """Write database, summary and plots.

    Args:
        logs: at least one.
        settings: of the benchmark.
        failures: tasks that failed, with their last words.
        folder: where to write.
        command: that makes the same numbers again.

    Returns:
        The report in Markdown.
    """
    write_database(logs, folder / "benchmark.db")
    parsed = [parse_log(log.read_text(encoding="utf-8")) for log in logs]
    results = results_of(parsed)
    version = parsed[0].version.split()[-1]
    circumstances = Circumstances(version, len(parsed), settings, failures, command)
    summary = summary_json(results, circumstances)
    (folder / "summary.json").write_text(
        json.dumps(summary, indent=2, allow_nan=False) + "\n", encoding="utf-8"
    )
    report = markdown(results, circumstances)
    (folder / "summary.md").write_text(report, encoding="utf-8")
    save_plots(parsed, results, folder)
    return report
