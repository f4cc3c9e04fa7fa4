"""Learning rates over a training run."""

from __future__ import annotations

import math
from collections.abc import Sequence

from .config import TrainingConfig


def learning_rate_factor(config: TrainingConfig, step: int, steps_per_epoch: int) -> float:
    """Return the learning rate of a step as a fraction of the highest one.

    ``exponential`` is decay ^ epoch. ``one-cycle`` rises linearly to 1 over the first
    ``warmup`` of the steps and falls along half a cosine to 0 (Smith and Topin, "Super-convergence:
    very fast training of neural networks using large learning rates", 2018,
    https://arxiv.org/abs/1708.07120; the cosine is PyTorch's).

    Args:
        config: has the schedule.
        step: number of the step, from 0.
        steps_per_epoch: steps in one epoch.

    Example:
        >>> config = TrainingConfig(epochs=2, warmup=0.1)
        >>> [round(learning_rate_factor(config, step, 10), 2) for step in (0, 2, 11, 19)]
        [0.33, 1.0, 0.5, 0.01]
    """
    if config.schedule == "exponential":
        return config.decay ** (step // steps_per_epoch)
    total = config.epochs * steps_per_epoch
    rising = config.warmup * total
    if step < rising:
        return (step + 1) / (rising + 1)
    return 0.5 * (1 + math.cos(math.pi * (step - rising) / (total - rising)))


def plateau_factor(config: TrainingConfig, scores: Sequence[float]) -> float:
    """Return the factor on the learning rates after epochs without a better score.

    The same as PyTorch's ReduceLROnPlateau: the epoch after ``plateau_patience`` epochs without
    a better score lowers them.

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
        if waited > config.plateau_patience:
            factor, waited = factor * config.plateau_factor, 0
    return factor
