"""Evaluation of predictions on the tasks of a data set."""

from __future__ import annotations

import platform
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from statistics import median
from time import perf_counter
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..datasets.dataset import Tasks
from ..errors import DatasetError
from ..sampling.heatmap import REGION_THRESHOLD
from .bootstrap import bootstrap_weights, percentile_interval
from .frechet import frechet_distance
from .metrics import TaskScores, task_scores

if TYPE_CHECKING:
    from ..inference.predictor import Predictor

#: Tasks that a network predicts at once.
BATCH = 32
_TIMED_CALLS, _WARM_UP_CALLS = 100, 10

#: Features of regions, (N, H, W) -> (N, F).
Features = Callable[[NDArray[np.bool_]], NDArray[np.float64]]


@dataclass(frozen=True)
class Evaluation:
    """Scores of one prediction.

    Attributes:
        name: of the predictor.
        predicted: (N, S, S), true in the predicted region.
        tasks: counts for each task.
        scores: see :meth:`cbagan_ompl.evaluation.metrics.TaskScores.means`.
        intervals: 95 % bootstrap intervals of the scores.
        frechet: Frechet distance to the true regions.
        model: for a network ``parameters``, ``inference_ms`` (milliseconds for a task on one CPU
            thread, median) and ``batched_ms`` (milliseconds for a task in batches, mean), with the
            machines that they were measured on, ``inference_host`` and ``batched_hosts``; empty for
            other predictions.
    """

    name: str
    predicted: NDArray[np.bool_]
    tasks: TaskScores
    scores: Mapping[str, float]
    intervals: Mapping[str, tuple[float, float]]
    frechet: float
    model: Mapping[str, Any]

    def to_dict(self) -> dict[str, Any]:
        """Return the scores as they are written to JSON."""
        return {
            "scores": dict(self.scores),
            "intervals": {name: list(limits) for name, limits in self.intervals.items()},
            "frechet": self.frechet,
            **self.model,
        }


@dataclass(frozen=True)
class BatchPredictions:
    """Regions that a network predicted in batches.

    Attributes:
        regions: (N, S, S), true in the region.
        seconds: that it took for all of them.
        hosts: the machines that it ran on.
    """

    regions: NDArray[np.bool_]
    seconds: float
    hosts: tuple[str, ...]


def predict_batches(
    predictor: Predictor,
    free: NDArray[np.bool_],
    start: NDArray[np.float32],
    goal: NDArray[np.float32],
) -> BatchPredictions:
    """Predict the regions of tasks, :data:`BATCH` at once, on this machine.

    Args:
        predictor: the network.
        free: (N, S, S), true where free.
        start: (N, 2), pixel coordinates.
        goal: (N, 2), the same.
    """
    started = perf_counter()
    regions = [
        _predict(predictor, free[batch], start[batch], goal[batch])
        for batch in (slice(first, first + BATCH) for first in range(0, len(free), BATCH))
    ]
    seconds = perf_counter() - started
    return BatchPredictions(np.concatenate(regions), seconds, (platform.node(),))


def _predict(
    predictor: Predictor,
    free: NDArray[np.bool_],
    start: NDArray[np.float32],
    goal: NDArray[np.float32],
) -> NDArray[np.bool_]:
    return np.asarray(predictor.probabilities(free, start, goal) >= REGION_THRESHOLD)


class Evaluator:
    """Scores of predictions on the same tasks, with the same resamples and features.

    Args:
        tasks: the tasks.
        features: of regions, for the Frechet distance.
        seed: of the resamples.
    """

    def __init__(self, tasks: Tasks, features: Features, seed: int) -> None:
        self.tasks = tasks
        self._truth = tasks.region.astype(np.bool_)
        self._free = tasks.free
        self._features = features
        self._true_features = features(self._truth)
        self._weights = bootstrap_weights(tasks.map_of, seed)

    def evaluate(
        self, name: str, predicted: NDArray[np.bool_], model: Mapping[str, Any] | None = None
    ) -> Evaluation:
        """Score the predicted regions of all tasks.

        Args:
            name: of the predictor.
            predicted: (N, S, S), true in the region.
            model: see :class:`Evaluation`.

        Raises:
            DatasetError: the regions differ in number or size from the true ones.
        """
        if predicted.shape != self._truth.shape:
            actual, expected = (
                f"{count} of {width} x {height} pixels"
                for count, height, width in (predicted.shape, self._truth.shape)
            )
            raise DatasetError(f"{name}: the predictions are {actual}, the labels {expected}")
        tasks = task_scores(predicted, self._truth, self._free, self.tasks.start, self.tasks.goal)
        scores = tasks.means(np.ones(len(predicted)))
        resampled = tasks.means(self._weights)
        return Evaluation(
            name,
            predicted,
            tasks,
            {key: float(value) for key, value in scores.items()},
            {key: percentile_interval(values) for key, values in resampled.items()},
            frechet_distance(self._features(predicted), self._true_features),
            model or {},
        )

    def evaluate_model(
        self, name: str, predictor: Predictor, predicted: BatchPredictions | None = None
    ) -> Evaluation:
        """Score a network at the size of the data set's images, and measure its run time.

        Args:
            name: of the predictor.
            predictor: the network.
            predicted: its predictions, where they have been made already.
        """
        tasks = self.tasks
        if predicted is None:
            predicted = predict_batches(predictor, self._free, tasks.start, tasks.goal)
        model = {
            "parameters": predictor.record["parameters"],
            "inference_ms": 1000 * self._time_single(predictor),
            "inference_host": platform.node(),
            "batched_ms": 1000 * predicted.seconds / len(tasks),
            "batched_hosts": list(predicted.hosts),
        }
        return self.evaluate(name, predicted.regions, model)

    def _time_single(self, predictor: Predictor) -> float:
        """Return the median time of a single task in seconds."""
        seconds = []
        for i in range(_WARM_UP_CALLS + _TIMED_CALLS):
            task = i % len(self.tasks)
            started = perf_counter()
            one = slice(task, task + 1)
            _predict(predictor, self._free[one], self.tasks.start[one], self.tasks.goal[one])
            seconds.append(perf_counter() - started)
        return median(seconds[_WARM_UP_CALLS:])
