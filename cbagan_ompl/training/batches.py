"""Training batches: tasks of a data set as tensors, turned and mirrored at random."""

from __future__ import annotations

from dataclasses import dataclass
from math import lcm

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor
from torch.nn import functional

from ..datasets.dataset import Tasks
from ..errors import DatasetError
from ..networks.blocks import stride_of
from .config import TrainingConfig


def check_trainable(side: int, config: TrainingConfig) -> None:
    """Refuse images that the networks cannot take.

    Args:
        side: of the images in pixels.
        config: the recipe.

    Raises:
        DatasetError: it is no multiple of the networks' strides, at every scale of the recipe.
    """
    stride = stride_of(config.patch, config.widths) * lcm(*config.scales)
    if side % stride:
        raise DatasetError(
            f"the networks take images with a side that is a multiple of {stride} pixels; these "
            f"have {side}"
        )


@dataclass(frozen=True)
class Batch:
    """Tensors of B tasks, in the form that the exported model takes.

    Attributes:
        free: (B, 1, S, S) float, 1 where free.
        start: (B, 2) pixel coordinates (u, v).
        goal: (B, 2) the same.
        region: (B, 1, S, S) float in [0, 1], 1 in the region.
    """

    free: Tensor
    start: Tensor
    goal: Tensor
    region: Tensor


def make_batch(
    tasks: Tasks,
    indices: NDArray[np.int64],
    device: torch.device,
    rng: np.random.Generator | None = None,
    *,
    symmetries: bool = False,
    reversal: bool = False,
) -> Batch:
    """Put tasks together as tensors.

    Args:
        tasks: where from.
        indices: which, (B,).
        device: where to.
        rng: draws the augmentation; needed with either of the following.
        symmetries: turn and mirror each task at random.
        reversal: exchange start and goal of each task at random.
    """
    free, region = tasks.maps[tasks.map_of[indices]], tasks.region[indices]
    ends = np.stack((tasks.start[indices], tasks.goal[indices]), axis=1)
    if rng is not None and symmetries:
        turned = [
            transformed(code, free[i], region[i], ends[i])
            for i, code in enumerate(rng.integers(8, size=len(indices)).tolist())
        ]
        free, region, ends = (np.stack(parts) for parts in zip(*turned, strict=True))
    if rng is not None and reversal:
        swap = rng.random(len(indices)) < 0.5
        ends[swap] = ends[swap][:, ::-1]
    return Batch(
        torch.from_numpy(free).to(device).unsqueeze(1).float(),
        torch.from_numpy(ends[:, 0].copy()).to(device),
        torch.from_numpy(ends[:, 1].copy()).to(device),
        torch.from_numpy(region).to(device).unsqueeze(1).float(),
    )


def scaled_down(batch: Batch, factor: int) -> Batch:
    """The tasks on smaller maps: a pixel is free, or in the region, when any of its block is.

    Args:
        batch: with sides that are multiples of the factor.
        factor: at least 1.
    """
    if factor == 1:
        return batch
    return Batch(
        functional.max_pool2d(batch.free, factor),
        batch.start / factor,
        batch.goal / factor,
        functional.max_pool2d(batch.region, factor),
    )


def transformed(
    code: int, free: NDArray[np.uint8], region: NDArray[np.uint8], ends: NDArray[np.float32]
) -> tuple[NDArray[np.uint8], NDArray[np.uint8], NDArray[np.float32]]:
    """One of the 8 symmetries of the square, applied to a task.

    Args:
        code: 0 to 7; bit 0 mirrors left and right, bit 1 top and bottom, bit 2 exchanges the axes.
        free: (S, S).
        region: (S, S).
        ends: (2, 2), start and goal as pixel coordinates (u, v).
    """
    side = free.shape[0]
    if code & 1:
        free, region = free[:, ::-1], region[:, ::-1]
        ends = np.stack((side - ends[:, 0], ends[:, 1]), axis=1)
    if code & 2:
        free, region = free[::-1], region[::-1]
        ends = np.stack((ends[:, 0], side - ends[:, 1]), axis=1)
    if code & 4:
        free, region, ends = free.T, region.T, ends[:, ::-1]
    return free, region, ends
