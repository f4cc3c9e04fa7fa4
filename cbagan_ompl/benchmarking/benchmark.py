"""A whole benchmark: its folder, its tasks, and the results that are made of their logs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from ..common.files import make_folder, write_atomically, write_json
from ..errors import ConfigError
from .database import write_database
from .logs import parse_log
from .measures import thresholds
from .plots import save_plots
from .report import Conditions, markdown, summary_json
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
        tasks: the tasks to be run.
        settings: what is compared on them.
        folder: folder of the results; made where it is missing.
        resume: continue with the tasks that have no log yet.

    Raises:
        ConfigError: the folder holds a benchmark and ``resume`` is off, or one with other
            settings; or it cannot be made; or an option that makes no sense.
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
        make_folder(logs)
        settings.save(saved)

    def run(self, processes: int, show_progress: bool = True) -> dict[str, str]:
        """Run the tasks that have no log yet; arguments and result as for :func:`.run_jobs`."""
        remaining = [job for job in self._jobs if not job.log.is_file()]
        return run_jobs(remaining, processes, show_progress)

    def finished_logs(self) -> list[Path]:
        """Return the logs of the tasks that have been run."""
        return [job.log for job in self._jobs if job.log.is_file()]


def write_results(
    logs: Sequence[Path],
    settings: Settings,
    failures: Mapping[str, str],
    folder: Path,
    command: str,
) -> str:
    """Write the database, the summary and the plots.

    Args:
        logs: logs of the tasks, at least one.
        settings: settings of the benchmark.
        failures: for each task that failed the end of its output.
        folder: where to write.
        command: command that repeats the benchmark.

    Returns:
        The report in Markdown.

    Raises:
        ConfigError: a file cannot be written.
    """
    write_database(logs, folder / "benchmark.db")
    parsed = [parse_log(log.read_text(encoding="utf-8")) for log in logs]
    results = results_of(parsed, thresholds(settings.within))
    version = parsed[0].version.split()[-1]
    conditions = Conditions(version, len(parsed), settings, failures, command)
    write_json(folder / "summary.json", summary_json(results, conditions))
    report = markdown(results, conditions)
    write_atomically(folder / "summary.md", report)
    save_plots(parsed, results, settings.within, folder)
    return report
