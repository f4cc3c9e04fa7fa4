"""Training in several processes at once, as ``torchrun`` starts them, and their devices.

Every process makes the same batches and keeps its shard of each. Batch norm takes its mean and
variance over all shards, so that the gradients are those of one process with the whole batch.
"""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, TypeVar

import torch
from torch import Tensor, distributed, nn

from ..errors import ConfigError, show

T = TypeVar("T")


@dataclass(frozen=True)
class ProcessGroup:
    """The processes of a training run.

    Attributes:
        rank: number of this process.
        size: how many there are.
    """

    rank: int = 0
    size: int = 1

    @property
    def is_leader(self) -> bool:
        """Whether this process is the one that validates and writes files."""
        return self.rank == 0

    def shard(self, batch: Tensor) -> Tensor:
        """Return this process's shard of a batch, (B / size, ...) of (B, ...)."""
        return batch[self.rank :: self.size]

    def means(self, values: Mapping[str, float]) -> dict[str, float]:
        """Return the mean of each value over the processes."""
        if self.size == 1:
            return dict(values)
        mean = torch.tensor(list(values.values()), dtype=torch.float64)
        if distributed.get_backend() == "nccl":
            mean = mean.cuda()
        distributed.all_reduce(mean)
        return dict(zip(values, (mean / self.size).tolist(), strict=True))

    def from_leader(self, value: T | None) -> T:
        """Return the value of the leading process; the others pass None."""
        values = [value]
        if self.size > 1:
            distributed.broadcast_object_list(values)
        assert values[0] is not None
        return values[0]


def pick_device(name: str) -> torch.device:
    """Return the device of a name; ``auto`` is a GPU if there is one.

    Of the processes that ``torchrun`` starts on a machine each gets its own GPU, unless the name
    has a number. The GPU becomes the current one, through which the processes communicate.

    Raises:
        ConfigError: no such device.
    """
    if name == "auto":
        name = "cuda" if torch.cuda.is_available() else "cpu"
    try:
        device = torch.device(name)
        if device.type == "cuda" and device.index is None:
            device = torch.device("cuda", int(os.environ.get("LOCAL_RANK", "0")))
        torch.empty(1, device=device)
        if device.type == "cuda":
            torch.cuda.set_device(device)
        elif device.type == "meta":
            raise ValueError("it computes nothing")
    except Exception as error:  # torch raises many types
        raise ConfigError(f"cannot use device {show(name)}: {error}") from error
    return device


def is_leading_process() -> bool:
    """Return whether this process is the first or the only one; it needs no process group."""
    return os.environ.get("RANK", "0") == "0"


@contextmanager
def process_group(device: torch.device) -> Iterator[ProcessGroup]:
    """Yield the group of the processes that ``torchrun`` started, or of this process alone.

    Args:
        device: where the networks are; decides how the processes communicate.
    """
    if int(os.environ.get("WORLD_SIZE", "1")) == 1:
        yield ProcessGroup()
        return
    distributed.init_process_group("nccl" if device.type == "cuda" else "gloo")
    try:
        yield ProcessGroup(distributed.get_rank(), distributed.get_world_size())
        distributed.barrier()  # none leaves while another one still communicates
    finally:
        distributed.destroy_process_group()


class GlobalBatchNorm(nn.BatchNorm2d):
    """Batch norm over the shards of all processes; each must have the same number of values.

    PyTorch's own (``SyncBatchNorm``) has no CPU version.
    """

    def forward(self, features: Tensor) -> Tensor:
        """Return features of the same shape (B, C, H, W), and of the same type."""
        if not self.training:
            return super().forward(features)
        kind = features.dtype
        # The running statistics are float32, and means over many values would lose digits in less.
        features = features.float()
        count = distributed.get_world_size() * features.numel() // features.shape[1]
        mean = _mean(features)
        deviation = features - mean.view(1, -1, 1, 1)
        variance = _mean(deviation.square())
        with torch.no_grad():
            assert self.running_mean is not None
            assert self.running_var is not None
            assert self.num_batches_tracked is not None
            assert self.momentum is not None
            self.running_mean.lerp_(mean, self.momentum)
            self.running_var.lerp_(variance * count / (count - 1), self.momentum)
            self.num_batches_tracked += 1
        scale = self.weight * torch.rsqrt(variance + self.eps)
        shifted: Tensor = deviation * scale.view(1, -1, 1, 1) + self.bias.view(1, -1, 1, 1)
        return shifted.to(kind)


def _mean(features: Tensor) -> Tensor:
    """Return the mean (C,) of each channel of (B, C, H, W) over all shards, with gradients."""
    total: Tensor = _Sum.apply(features.mean((0, 2, 3)))  # type: ignore[no-untyped-call]
    return total / distributed.get_world_size()


class _Sum(torch.autograd.Function):
    """Sum over the processes. Every process's loss depends on it, so gradients add up as well."""

    @staticmethod
    def forward(context: Any, values: Tensor) -> Tensor:
        return _Sum._sum_over_processes(values)

    @staticmethod
    def backward(context: Any, gradients: Tensor) -> Tensor:
        return _Sum._sum_over_processes(gradients)

    @staticmethod
    def _sum_over_processes(values: Tensor) -> Tensor:
        total = values.clone()
        distributed.all_reduce(total)
        return total


def synchronize_batch_norm(network: nn.Module) -> None:
    """Replace every batch norm inside a network by one over all processes."""
    for name, child in network.named_children():
        if isinstance(child, nn.BatchNorm2d):
            synchronized = GlobalBatchNorm(child.num_features, child.eps)
            synchronized.load_state_dict(child.state_dict())
            setattr(network, name, synchronized)
        else:
            synchronize_batch_norm(child)
