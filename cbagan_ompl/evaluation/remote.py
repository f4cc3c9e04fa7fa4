"""Predictions for the tasks of a data set on other machines."""

from __future__ import annotations

import tempfile
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..common.parallel import Executor, run_all
from ..datasets.dataset import Tasks
from ..inference.copies import read_copy, write_files
from .evaluator import BATCH, BatchPredictions, predict_batches

if TYPE_CHECKING:
    from ..inference.predictor import Predictor

# Tasks of a call: whole batches, so that each is what one machine alone would predict at once.
_TASKS = 8 * BATCH


def predict_remotely(
    model: Path, tasks: Tasks, executor: Executor, progress: bool = True
) -> BatchPredictions:
    """Predict the regions of tasks, in the same batches as one machine would.

    Args:
        model: file of the model; its content is sent along.
        tasks: the tasks.
        executor: where the predictions are made.
        progress: show a progress bar.

    Raises:
        ModelError: the file cannot be read or used.
        DatasetError: a process has died twice.
        ClusterError: the cluster cannot do the work.
    """
    files = tuple(read_copy(model).items())
    free = tasks.free
    parts = [slice(first, first + _TASKS) for first in range(0, len(tasks), _TASKS)]
    calls = {
        f"tasks from {part.start}": (free[part], tasks.start[part], tasks.goal[part])
        for part in parts
    }
    predictions = run_all(_predict, calls, executor, "parts", progress, (files,))
    return BatchPredictions(
        np.concatenate([one.regions for one in predictions]),
        sum(one.seconds for one in predictions),
        tuple(sorted({host for one in predictions for host in one.hosts})),
    )


def _predict(
    files: tuple[tuple[str, bytes], ...],
    free: NDArray[np.bool_],
    start: NDArray[np.float32],
    goal: NDArray[np.float32],
) -> BatchPredictions:
    return predict_batches(_load(files), free, start, goal)


@lru_cache(maxsize=1)
def _load(files: tuple[tuple[str, bytes], ...]) -> Predictor:
    from ..inference.predictor import load_model

    with tempfile.TemporaryDirectory() as folder:
        return load_model(write_files(Path(folder) / "model", dict(files)))
