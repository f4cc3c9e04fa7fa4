"""What the studies of trainings share: runs that are repeated only as far as they must be."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import AbstractContextManager
from pathlib import Path

import numpy as np
from scipy.stats import t

from cbagan_ompl.training.checkpoints import load_checkpoint
from cbagan_ompl.training.config import BEST, LAST, TrainingConfig
from cbagan_ompl.training.loop import train
from cbagan_ompl.training.task_sources import TaskSource


def run_scores(
    folder: Path,
    config: TrainingConfig,
    source: AbstractContextManager[TaskSource],
    device: str = "auto",
) -> dict[str, float]:
    """Return the scores of a run on the test tasks, of its best epoch.

    Args:
        folder: of the run. A complete run there is not repeated, an interrupted one is resumed.
        config: the recipe.
        source: of the tasks; entered if they are needed.
        device: to train on.
    """
    if not is_complete(folder):
        with source as tasks:
            train(tasks, config, folder, resume=(folder / LAST).exists(), device=device)
    scores: dict[str, float] = load_checkpoint(folder / BEST)["test"]
    return scores


def is_complete(folder: Path) -> bool:
    """Return whether a run is complete: at its end it adds the scores on the test tasks."""
    path = folder / BEST
    return path.exists() and load_checkpoint(path).get("test") is not None


def student_interval(values: Sequence[float]) -> list[float]:
    """Return the mean over seeds and the ends of Student's interval of 95 %.

    Example:
        >>> [round(end, 2) for end in student_interval([0.5, 0.6, 0.7])]
        [0.6, 0.35, 0.85]
    """
    mean = float(np.mean(values))
    if len(values) < 2:  # one seed says nothing of the others
        return [mean, -np.inf, np.inf]
    spread = float(np.std(values, ddof=1))
    half = float(t.ppf(0.975, len(values) - 1)) * spread / len(values) ** 0.5
    return [mean, mean - half, mean + half]
