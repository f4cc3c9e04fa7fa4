"""Evaluation of predictions on the tasks of a data set."""

from __future__ import annotations

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

_BATCH = 32
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
            thread, median) and ``batched_ms`` (milliseconds for a task in batches, mean); empty
            for other predictions.
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

    def evaluate_model(self, name: str, predictor: Predictor) -> Evaluation:
        """Score a network at the size of the data set's images, and measure its run time."""
        batches = [slice(first, first + _BATCH) for first in range(0, len(self.tasks), _BATCH)]
        started = perf_counter()
        predicted = np.concatenate([self._predict(predictor, batch) for batch in batches])
        batched = (perf_counter() - started) / len(self.tasks)
        model = {
            "parameters": predictor.record["parameters"],
            "inference_ms": 1000 * self._time_single(predictor),
            "batched_ms": 1000 * batched,
        }
        return self.evaluate(name, predicted, model)

    def _predict(self, predictor: Predictor, batch: slice) -> NDArray[np.bool_]:
        values = predictor.probabilities(
            self._free[batch], self.tasks.start[batch], self.tasks.goal[batch]
        )
        return np.asarray(values >= REGION_THRESHOLD)

    def _time_single(self, predictor: Predictor) -> float:
        """Return the median time of a single task in seconds."""
        seconds = []
        for i in range(_WARM_UP_CALLS + _TIMED_CALLS):
            task = i % len(self.tasks)
            started = perf_counter()
            self._predict(predictor, slice(task, task + 1))
            seconds.append(perf_counter() - started)
        return median(seconds[_WARM_UP_CALLS:])
