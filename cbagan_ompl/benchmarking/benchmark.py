"""A whole benchmark: its folder, its tasks, and the results that are made of their logs."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path

from ..common.files import make_folder, write_atomically, write_json
from ..common.parallel import Executor, LocalExecutor
from ..errors import ConfigError
from .database import write_database
from .inputs import check_same, record_inputs
from .logs import ExperimentLog, read_log
from .measures import AUTO_SOURCE, thresholds
from .plots import save_plots
from .remote import run_jobs_remotely
from .report import Conditions, markdown, summary_json
from .runner import run_jobs
from .settings import Settings
from .statistics import results_of
from .tasks import BenchmarkTask
from .worker import Job, check_heatmaps, check_job, check_log

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
            settings, versions, maps or tasks, or something damaged; or it cannot be made; or an
            option that makes no sense.
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
        record = record_inputs(tasks, settings)
        saved = folder / _SETTINGS
        if os.path.lexists(saved):
            if not resume:
                raise ConfigError(
                    f"{folder} holds a benchmark: go on with --resume, or choose another"
                )
            check_same(record, saved)
            for job in self._finished():
                _read_finished(job)
            return
        if os.path.isdir(logs) and any(logs.iterdir()):
            raise ConfigError(
                f"{logs} holds files, and {saved} is missing, which says of what benchmark: choose "
                "another folder, or delete this one"
            )
        make_folder(logs)
        write_json(saved, record)

    def run(self, executor: Executor, show_progress: bool = True) -> dict[str, str]:
        """Run the tasks that have no log yet, each in a process of its own.

        Args:
            executor: where they run.
            show_progress: show a progress bar with the remaining time.

        Returns:
            For each task that failed, by its name, the end of its output.

        Raises:
            KeyboardInterrupt: after an interrupt; the tasks that were running are terminated.
            ConfigError: processes or temporary files cannot be made, or a log cannot be written.
            ModelError: a model cannot be read.
            HeatmapError: a heat map cannot be read.
            ClusterError: the cluster cannot do the work.
        """
        remaining = [job for job in self._jobs if not os.path.lexists(job.log)]
        if isinstance(executor, LocalExecutor):
            return run_jobs(remaining, executor.processes, show_progress)
        return run_jobs_remotely(remaining, executor, show_progress)

    def finished_logs(self, failures: Mapping[str, str]) -> list[ExperimentLog]:
        """Return the logs of the tasks that have been run.

        Args:
            failures: tasks that failed, by name.

        Raises:
            ConfigError: a log is damaged, or some are there and that of a task that did not fail
                is missing.
        """
        finished = self._finished()
        missing = len(self._jobs) - len(finished) - len(failures)
        if finished and missing > 0:
            raise ConfigError(
                f"{missing} of {len(self._jobs)} tasks have no log in {self.folder / _LOGS}: run "
                "them with the same command and --resume"
            )
        return [_read_finished(job) for job in finished]

    def _finished(self) -> list[Job]:
        return [job for job in self._jobs if os.path.lexists(job.log)]


def _read_finished(job: Job) -> ExperimentLog:
    """Return the log of a task, which must be one that :func:`.run_job` wrote for it."""
    try:
        log = read_log(job.log)
        check_log(log, job)
    except ConfigError as error:
        raise ConfigError(f"{error}. Delete {job.log}, then go on with --resume") from error
    return log


def write_results(
    logs: Sequence[ExperimentLog],
    settings: Settings,
    failures: Mapping[str, str],
    folder: Path,
    command: str,
    left_out: Mapping[str, str] | None = None,
) -> str:
    """Write the database, the summary and the plots, each whole or not at all.

    Args:
        logs: logs of the tasks, at least one, with all measures.
        settings: settings of the benchmark.
        failures: for each task that failed the end of its output.
        folder: where to write.
        command: command that repeats the benchmark.
        left_out: why a task cannot be planned for, by its name.

    Returns:
        The report in Markdown.

    Raises:
        ConfigError: a file cannot be written, or the logs are of several versions of OMPL.
    """
    versions = {log.version.split()[-1]: log.name for log in logs}
    if len(versions) > 1:
        raise ConfigError(
            "the tasks were run with several versions of OMPL, which have no summary in common: "
            + ", ".join(f"{name} with {version}" for version, name in versions.items())
        )
    write_database(logs, folder / "benchmark.db")
    results = results_of(logs, thresholds(settings.within))
    conditions = Conditions(
        next(iter(versions)),
        len(logs),
        settings,
        failures,
        command,
        hosts=Counter(log.host for log in logs),
        left_out=left_out or {},
        auto=_count_values(logs, AUTO_SOURCE),
    )
    write_json(folder / "summary.json", summary_json(results, conditions))
    report = markdown(results, conditions)
    write_atomically(folder / "summary.md", report)
    save_plots(logs, results, settings.within, folder)
    return report


def _count_values(logs: Sequence[ExperimentLog], name: str) -> Counter[str]:
    """Return how many logs have each value of a property."""
    return Counter(log.parameters[name] for log in logs if name in log.parameters)
