"""Training batches: tasks of a data set as tensors and as images, turned and mirrored at random."""

from __future__ import annotations

from dataclasses import dataclass
from math import lcm

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor
from torch.nn import functional

from ..datasets.dataset import Tasks
from ..datasets.geodesic_labels import DIRECTION_PATCH
from ..errors import DatasetError
from ..networks.blocks import stride_of
from ..networks.config import MAX_IMAGE_SIZE
from ..networks.discriminator import MIN_PATCHES
from ..networks.encoding import map_image, point_image, region_image
from ..networks.factory import check_weights
from .config import TrainingConfig


def check_trainable(size: int, config: TrainingConfig) -> None:
    """Raise if the networks are too large, or cannot take images of a size.

    Args:
        size: height and width of the images in pixels.
        config: the recipe.

    Raises:
        DatasetError: at some scale of the recipe the size is no multiple of the networks' strides,
            or too small for the discriminators; or larger than any model may take.
        ConfigError: the networks have too many weights.
    """
    network, scales = config.network, config.scales
    check_weights(network)
    if size > MAX_IMAGE_SIZE:
        raise DatasetError(
            f"the networks take images of at most {MAX_IMAGE_SIZE} pixels; these have {size}"
        )
    stride = stride_of(network.patch, network.widths) * lcm(*scales)
    if size % stride:
        raise DatasetError(
            f"the networks take images with a size that is a multiple of {stride} pixels; these "
            f"have {size}"
        )
    # The smallest multiple of the stride whose smallest scale has enough patches.
    smallest = stride * -(-MIN_PATCHES * network.patch * max(scales) // stride)
    if size < smallest and config.adversarial_weight:
        raise DatasetError(
            f"the discriminators take images of at least {smallest} pixels; these have {size}"
        )


@dataclass(frozen=True)
class Batch:
    """Tensors of B tasks, in the form that the exported model takes.

    Attributes:
        free: (B, 1, S, S) float, 1 where free.
        start: (B, 2) pixel coordinates (u, v), u right and v down.
        goal: (B, 2) the same.
        region: (B, 1, S, S) float in [0, 1], 1 in the region.
        direction: (B, 2, S // 4, S // 4), see
            :func:`cbagan_ompl.datasets.geodesic_labels.travel_directions`; 0 where unknown.
    """

    free: Tensor
    start: Tensor
    goal: Tensor
    region: Tensor
    direction: Tensor


@dataclass(frozen=True)
class Images:
    """A batch as the networks see it, (B, 3, S, S) in [-1, 1] each."""

    map: Tensor
    points: Tensor
    region: Tensor


def encode(batch: Batch) -> Images:
    """Return the images of a batch, see :mod:`cbagan_ompl.networks.encoding`."""
    height, width = batch.free.shape[-2:]
    images = (
        map_image(batch.free),
        point_image(batch.start, batch.goal, height, width),
        region_image(batch.region),
    )
    return Images(*(image.contiguous(memory_format=torch.channels_last) for image in images))


def make_batch(
    tasks: Tasks,
    indices: NDArray[np.int64],
    device: torch.device,
    rng: np.random.Generator | None = None,
    *,
    symmetries: bool = False,
    reversal: bool = False,
) -> Batch:
    """Return some tasks as tensors.

    Args:
        tasks: all tasks.
        indices: of the tasks to take, (B,).
        device: of the tensors.
        rng: random numbers of the augmentation; needed with either of the following.
        symmetries: turn and mirror each task at random.
        reversal: exchange start and goal of each task at random.
    """
    free, region = tasks.maps[tasks.map_of[indices]], tasks.region[indices]
    direction = _directions_of(tasks, indices)
    endpoints = np.stack((tasks.start[indices], tasks.goal[indices]), axis=1)
    if rng is not None and symmetries:
        codes = rng.integers(8, size=len(indices)).tolist()
        turned = [
            apply_symmetry(code, free[i], region[i], endpoints[i]) for i, code in enumerate(codes)
        ]
        direction = np.stack([turn_vectors(*pair) for pair in zip(codes, direction, strict=True)])
        free, region, endpoints = (np.stack(parts) for parts in zip(*turned, strict=True))
    if rng is not None and reversal:
        swap = rng.random(len(indices)) < 0.5
        endpoints[swap] = endpoints[swap][:, ::-1]
        direction[swap] = 0  # of the way back nothing is known
    return Batch(
        torch.from_numpy(free).to(device).unsqueeze(1).float(),
        torch.from_numpy(endpoints[:, 0].copy()).to(device),
        torch.from_numpy(endpoints[:, 1].copy()).to(device),
        torch.from_numpy(region).to(device).unsqueeze(1).float(),
        torch.from_numpy(direction).to(device).float(),
    )


def scale_down(batch: Batch, factor: int) -> Batch:
    """Return the tasks on smaller maps: a pixel is free, or in the region, if any of its block is.

    Args:
        batch: its images have a size that is a multiple of the factor.
        factor: at least 1.
    """
    if factor == 1:
        return batch
    return Batch(
        functional.max_pool2d(batch.free, factor),
        batch.start / factor,
        batch.goal / factor,
        functional.max_pool2d(batch.region, factor),
        functional.avg_pool2d(batch.direction, factor),
    )


def _directions_of(tasks: Tasks, indices: NDArray[np.int64]) -> NDArray[np.float16]:
    """Return the directions of travel of some tasks; 0 where they are not known."""
    if tasks.direction is not None:
        return tasks.direction[indices]
    side = tasks.size // DIRECTION_PATCH
    return np.zeros((len(indices), 2, side, side), np.float16)


def turn_vectors(code: int, vectors: NDArray[np.float16]) -> NDArray[np.float16]:
    """Apply one of the 8 symmetries of :func:`apply_symmetry` to vectors (u, v), (2, h, w)."""
    if code & 1:
        vectors = vectors[:, :, ::-1] * np.array([-1, 1], vectors.dtype)[:, None, None]
    if code & 2:
        vectors = vectors[:, ::-1] * np.array([1, -1], vectors.dtype)[:, None, None]
    if code & 4:
        vectors = vectors[::-1].transpose(0, 2, 1)
    return vectors


def apply_symmetry(
    code: int, free: NDArray[np.uint8], region: NDArray[np.uint8], endpoints: NDArray[np.float32]
) -> tuple[NDArray[np.uint8], NDArray[np.uint8], NDArray[np.float32]]:
    """Apply one of the 8 symmetries of the square to a task.

    Args:
        code: 0 to 7; bit 0 mirrors left and right, bit 1 top and bottom, bit 2 exchanges the axes.
        free: (S, S).
        region: (S, S).
        endpoints: (2, 2), start and goal as pixel coordinates (u, v).

    Returns:
        ``free``, ``region`` and ``endpoints`` of the turned task.
    """
    size = free.shape[0]
    if code & 1:
        free, region = free[:, ::-1], region[:, ::-1]
        endpoints = np.stack((size - endpoints[:, 0], endpoints[:, 1]), axis=1)
    if code & 2:
        free, region = free[::-1], region[::-1]
        endpoints = np.stack((endpoints[:, 0], size - endpoints[:, 1]), axis=1)
    if code & 4:
        free, region, endpoints = free.T, region.T, endpoints[:, ::-1]
    return free, region, endpoints
