"""Where a training run has its tasks from: a data set, or worlds drawn as they are used."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, Protocol

from ..common.parallel import fork_server, interrupts_held
from ..common.validation import check_at_least, require
from ..datasets.dataset import Dataset, Tasks
from ..datasets.synthetic import (
    TASKS_PER_MAP,
    SyntheticSettings,
    concatenate_tasks,
    generate_map_tasks,
)
from ..errors import DatasetError

# Numbers of the parts of an endless source; maps of different parts are different maps.
_TRAINING, _VALIDATION, _TEST = range(3)


class TaskSource(Protocol):
    """What a training run asks of its tasks."""

    side: int
    validation: Tasks
    test: Tasks

    def epoch(self, number: int) -> Tasks:
        """The training tasks of an epoch, counted from 0."""

    def description(self) -> dict[str, Any]:
        """What checkpoints and model files say about the data."""


class DatasetSource:
    """The same tasks in every epoch: those of a data set.

    Args:
        dataset: the set.
        fraction: share of its training tasks that is held back for validation.
        seed: of the split.
    """

    def __init__(self, dataset: Dataset, fraction: float, seed: int) -> None:
        self._training, self.validation = dataset.split(fraction, seed)
        self._dataset = dataset
        self.test = dataset.test
        self.side = dataset.train.size

    def epoch(self, number: int) -> Tasks:
        """The training tasks."""
        return self._training

    def description(self) -> dict[str, Any]:
        """See :meth:`Dataset.description`."""
        return self._dataset.description()


@dataclass(frozen=True)
class SyntheticSchedule:
    """How many worlds a run draws.

    Attributes:
        maps: for each epoch.
        held_back: for validation, and as many for the test.
        jobs: processes that draw while the networks learn.

    Raises:
        ConfigError: a number below 1.
    """

    maps: int = 512
    held_back: int = 64
    jobs: int = 1

    def __post_init__(self) -> None:
        for name in ("maps", "held_back", "jobs"):
            check_at_least(name, getattr(self, name), 1)


class SyntheticSource:
    """New tasks in every epoch, drawn by other processes while the one before is learned.

    To be had from :func:`synthetic_source`, which ends the processes.

    Args:
        settings: what kind of tasks.
        schedule: how many.
        pool: the processes.
    """

    def __init__(
        self, settings: SyntheticSettings, schedule: SyntheticSchedule, pool: ProcessPoolExecutor
    ) -> None:
        self._settings = settings
        self._schedule = schedule
        self._pool = pool
        self._ahead: dict[int, list[Future[Tasks]]] = {}
        self.side = settings.size
        with _deaths_told():
            self.validation, self.test = (
                _drawn(self._submitted(part, 0, schedule.held_back))
                for part in (_VALIDATION, _TEST)
            )

    def epoch(self, number: int) -> Tasks:
        """New tasks; those of the next epoch are begun."""
        with _deaths_told():
            for n in (number, number + 1):
                if n not in self._ahead:
                    self._ahead[n] = self._submitted(_TRAINING, n, self._schedule.maps)
            return _drawn(self._ahead.pop(number))

    def _submitted(self, part: int, epoch: int, count: int) -> list[Future[Tasks]]:
        numbers = range(epoch * count, (epoch + 1) * count)
        with interrupts_held():  # submitting starts the processes
            return [self._pool.submit(generate_map_tasks, self._settings, part, n) for n in numbers]

    def description(self) -> dict[str, Any]:
        """The settings, and how many tasks there are."""
        return {
            "name": "worlds",
            "maps": self._schedule.maps,
            "side": self.side,
            "train_tasks": TASKS_PER_MAP * self._schedule.maps,
            "test_tasks": len(self.test),
            "worlds": self._settings.description(),
        }


def _drawn(worlds: list[Future[Tasks]]) -> Tasks:
    """The tasks of all worlds, once they are drawn."""
    return concatenate_tasks([world.result() for world in worlds])


@contextmanager
def _deaths_told() -> Iterator[None]:
    """A process that has died gives a clear error, whether work is asked of it or awaited."""
    try:
        yield
    except BrokenProcessPool as error:
        raise DatasetError(
            "a process that drew worlds has died, perhaps for lack of memory"
        ) from error


@contextmanager
def synthetic_source(
    settings: SyntheticSettings, schedule: SyntheticSchedule
) -> Iterator[SyntheticSource]:
    """An endless source of tasks, and its processes until the end of the context.

    Args:
        settings: what kind of tasks.
        schedule: how many.

    Raises:
        MissingDependencyError: numba is not installed.
        DatasetError: a process has died.
    """
    require("numba", "train")
    with interrupts_held():
        context = fork_server()
    pool = ProcessPoolExecutor(schedule.jobs, context)
    try:
        yield SyntheticSource(settings, schedule, pool)
    finally:
        pool.shutdown(cancel_futures=True)
