"""Noise of RRT labels: the agreement of several labels of the same tasks."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..common.parallel import Executor, LocalExecutor, run_all
from ..common.validation import positive_number, whole_number
from ..datasets.dataset import Tasks
from ..datasets.generation import ITERATIONS
from ..errors import ConfigError
from ..maps.grid_map import GridMap
from .metrics import confusion

# Labels of each task: one that is predicted, and an odd number that vote.
_LABELS = 6


def choose_tasks(tasks: Tasks, count: int, seed: int) -> Tasks:
    """Choose tasks at random; they keep their order.

    Args:
        tasks: to choose from.
        count: number of tasks.
        seed: the same seed gives the same tasks.

    Raises:
        ConfigError: there are fewer tasks, or the seed is negative.
    """
    if whole_number("tasks", count, 1) > len(tasks):
        raise ConfigError(f"tasks must be from 1 to {len(tasks)}, got {count}")
    whole_number("seed", seed, 0)
    chosen = np.random.default_rng(seed).choice(len(tasks), count, replace=False)
    return tasks.select(np.sort(chosen))


def label_noise(
    tasks: Tasks,
    runs: int,
    range: float,
    seed: int,
    jobs: int,
    progress: bool = True,
    executor: Executor | None = None,
) -> dict[str, Any]:
    """Label tasks several times with different seeds, and compare the labels.

    Two labels of one task differ because RRT is random, and a network cannot predict which of them
    it is scored with. So the score of one label as a prediction of another (``two labels``) is near
    what a network can reach. A network can do better by leaving out pixels that few labels hold:
    the ``majority``, the pixels that most of five further labels hold, as a prediction of the first
    label estimates the best score that can be reached.

    Args:
        tasks: the tasks.
        runs: of RRT for each label.
        range: longest edge of RRT in pixels.
        seed: the same seed gives the same labels.
        jobs: number of processes.
        progress: show a progress bar.
        executor: where tasks are labelled; by default ``jobs`` processes of this machine.

    Returns:
        ``tasks``, ``runs``, ``range`` and ``seed``, and the IoU and Dice, pooled over all pixels
        and as means over images, of the second label as a prediction of the first
        (``two labels``), of the ``majority``, and of the first label and the majority as
        predictions of the labels of the data set (``own labels and the first``,
        ``own labels and the majority``).

    Raises:
        ConfigError: an argument out of range.
        TaskError: a task whose start or goal is blocked, or which has no path.
        DatasetError: a process has died.
        ClusterError: the cluster cannot do the work.
    """
    whole_number("runs", runs, 1)
    positive_number("range", range)
    whole_number("seed", seed, 0)
    free = tasks.free
    calls = {
        f"task {i}": (free[i], tasks.start[i], tasks.goal[i], runs, range, (seed, i))
        for i in np.arange(len(tasks)).tolist()
    }
    executor = executor or LocalExecutor(jobs)
    labels = np.array(run_all(_label_task, calls, executor, "tasks", progress))
    first, second, others = labels[:, 0], labels[:, 1], labels[:, 1:]
    majority = 2 * others.sum(axis=1) > others.shape[1]
    own = tasks.region.astype(bool)
    return {
        "tasks": len(tasks),
        "runs": runs,
        "range": range,
        "seed": seed,
        "two labels": _score_agreement(second, first),
        "majority": _score_agreement(majority, first),
        "own labels and the first": _score_agreement(first, own),
        "own labels and the majority": _score_agreement(majority, own),
    }


def _label_task(
    free: NDArray[np.bool_],
    start: NDArray[np.float32],
    goal: NDArray[np.float32],
    runs: int,
    range: float,
    seed: tuple[int, int],
) -> NDArray[np.bool_]:
    """Return several labels of one task, (L, S, S)."""
    from ..datasets.rrt_labels import rrt_region

    grid = GridMap(free)
    task = grid.check_task(start, goal)
    seeds = np.random.default_rng(seed).integers(2**32, size=_LABELS).tolist()
    return np.array([rrt_region(grid, task, runs, range, ITERATIONS, s) for s in seeds])


def _score_agreement(predicted: NDArray[np.bool_], truth: NDArray[np.bool_]) -> dict[str, float]:
    counts = confusion(predicted, truth)
    pooled = counts.pool()
    return {
        "iou": float(pooled.iou()),
        "dice": float(pooled.dice()),
        "iou_per_image": float(counts.iou().mean()),
        "dice_per_image": float(counts.dice().mean()),
    }
