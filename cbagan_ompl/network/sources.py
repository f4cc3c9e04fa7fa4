"""Where a training run has its tasks from: a data set, or worlds drawn as they are used."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from concurrent.futures import Future, ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing import get_context
from typing import Any, Protocol

from ..checks import check_at_least, require
from ..datasets.layout import Dataset, Tasks
from ..datasets.worlds import TASKS_PER_MAP, WorldSettings, draw_world, joined_tasks

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
        self.side = dataset.train.side

    def epoch(self, number: int) -> Tasks:
        """The training tasks."""
        return self._training

    def description(self) -> dict[str, Any]:
        """See :meth:`Dataset.description`."""
        return self._dataset.description()


@dataclass(frozen=True)
class WorldSchedule:
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


class WorldSource:
    """New tasks in every epoch, drawn by other processes while the one before is learned.

    To be had from :func:`world_source`, which ends the processes.

    Args:
        settings: what kind of tasks.
        schedule: how many.
        pool: the processes.
    """

    def __init__(
        self, settings: WorldSettings, schedule: WorldSchedule, pool: ProcessPoolExecutor
    ) -> None:
        self._settings = settings
        self._schedule = schedule
        self._pool = pool
        self._ahead: dict[int, list[Future[Tasks]]] = {}
        self.side = settings.size
        self.validation, self.test = (
            joined_tasks([future.result() for future in self._submitted(part, 0, count)])
            for part, count in ((_VALIDATION, schedule.held_back), (_TEST, schedule.held_back))
        )

    def epoch(self, number: int) -> Tasks:
        """New tasks; those of the next epoch are begun."""
        for n in (number, number + 1):
            if n not in self._ahead:
                self._ahead[n] = self._submitted(_TRAINING, n, self._schedule.maps)
        return joined_tasks([future.result() for future in self._ahead.pop(number)])

    def _submitted(self, part: int, epoch: int, count: int) -> list[Future[Tasks]]:
        numbers = range(epoch * count, (epoch + 1) * count)
        return [self._pool.submit(draw_world, self._settings, part, n) for n in numbers]

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


@contextmanager
def world_source(settings: WorldSettings, schedule: WorldSchedule) -> Iterator[WorldSource]:
    """An endless source of tasks, and its processes until the end of the context.

    Args:
        settings: what kind of tasks.
        schedule: how many.

    Raises:
        MissingDependencyError: numba is not installed.
    """
    require("numba", "train")
    pool = ProcessPoolExecutor(schedule.jobs, get_context("forkserver"), _ignore_interrupts)
    try:
        yield WorldSource(settings, schedule, pool)
    finally:
        pool.shutdown(cancel_futures=True)


def _ignore_interrupts() -> None:
    """An interrupt from the terminal is for the parent alone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
