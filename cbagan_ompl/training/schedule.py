"""Learning rates over a training run."""

from __future__ import annotations

import math
from collections.abc import Sequence

from .config import TrainingConfig


def learning_rate_factor(config: TrainingConfig, step: int, steps_per_epoch: int) -> float:
    """Share of the highest learning rate that the schedule gives a step.

    Args:
        config: names the schedule.
        step: number of the step, from 0.
        steps_per_epoch: steps in one epoch.
    """
    if config.schedule == "exponential":
        return config.decay ** (step // steps_per_epoch)
    total = config.epochs * steps_per_epoch
    rising = config.warmup * total
    if step < rising:
        return (step + 1) / (rising + 1)
    return 0.5 * (1 + math.cos(math.pi * (step - rising) / (total - rising)))


def plateau_factor(config: TrainingConfig, scores: Sequence[float]) -> float:
    """Factor on the learning rates after epochs that brought nothing (ReduceLROnPlateau).

    Args:
        config: ``plateau_patience`` and ``plateau_factor``.
        scores: validation score of each epoch so far, the higher the better.
    """
    factor, best, waited = 1.0, -math.inf, 0
    if config.plateau_patience == 0:
        return factor
    for score in scores:
        waited = 0 if score > best else waited + 1
        best = max(best, score)
        # As in PyTorch: the patience is borne, the epoch after it is not.
        if waited > config.plateau_patience:
            factor, waited = factor * config.plateau_factor, 0
    return factor
