"""Scores of a generator on tasks, next to those of trivial baselines."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import torch
from numpy.typing import NDArray
from torch import nn

from ..datasets.dataset import Tasks
from ..evaluation.baselines import trivial_baselines
from ..evaluation.metrics import region_scores
from ..networks.encoding import region_probability
from ..sampling.heatmap import REGION_THRESHOLD
from .batches import encode, make_batch
from .gan import Painted


def evaluate(
    generator: nn.Module, tasks: Tasks, device: torch.device, batch_size: int
) -> dict[str, float]:
    """Return scores of a generator, see :func:`cbagan_ompl.evaluation.metrics.region_scores`.

    Args:
        generator: on the device; afterwards in evaluation mode.
        tasks: with their true regions.
        device: to predict on.
        batch_size: tasks at a time.
    """
    predicted = np.concatenate(list(_predict(generator, tasks, device, batch_size)))
    return region_scores(
        predicted, tasks.region >= REGION_THRESHOLD, tasks.free, tasks.start, tasks.goal
    )


@torch.inference_mode()
def _predict(
    generator: nn.Module, tasks: Tasks, device: torch.device, batch_size: int
) -> Iterator[NDArray[np.bool_]]:
    generator.eval()
    for first in range(0, len(tasks), batch_size):
        indices = np.arange(first, min(first + batch_size, len(tasks)))
        batch = make_batch(tasks, indices, device)
        images = encode(batch)
        image = Painted.of(generator(images.map, images.points, torch.zeros_like(batch.free))).image
        yield (region_probability(image)[:, 0] >= REGION_THRESHOLD).cpu().numpy()


def trivial_scores(tasks: Tasks) -> dict[str, dict[str, float]]:
    """Return the scores of the trivial baselines: all free space, and a straight band."""
    truth, free = tasks.region >= REGION_THRESHOLD, tasks.free
    return {
        name: region_scores(predicted, truth, free, tasks.start, tasks.goal)
        for name, predicted in trivial_baselines(tasks).items()
    }
