"""The distances of :mod:`.fast_marching` with gradients by the costs."""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from ..common.compilation import compiled
from .fast_marching import UNREACHED, descent_directions, link_bits, march_all


class FastMarching(torch.autograd.Function):
    """Distances of all nodes from start and goal, with gradients by the costs, and directions.

    Takes the same as :func:`.passages.distance_fields`, and returns its distances, as far as they
    are of use (:data:`.fast_marching.REACH`), and what
    :func:`.passages.directions` returns for them.
    """

    @staticmethod
    def forward(
        ctx: Any, costs: Tensor, codes: Tensor, start: Tensor, goal: Tensor
    ) -> tuple[Tensor, Tensor]:
        """Return the distances and the directions."""
        cost_values = costs.detach().float().contiguous().numpy()
        linked = link_bits(codes.numpy())
        distances = march_all(cost_values, linked, start.numpy(), goal.numpy())
        ctx.values = cost_values, linked, distances
        towards = torch.from_numpy(descent_directions(distances, linked))
        ctx.mark_non_differentiable(towards)
        return torch.from_numpy(distances), towards

    @staticmethod
    def backward(ctx: Any, gradient: Tensor, _: Tensor) -> tuple[Tensor | None, ...]:
        """Return the gradient by the costs."""
        cost_values, linked, distances = ctx.values
        result = np.zeros_like(cost_values)
        flat = gradient.contiguous().numpy()
        height, width = cost_values.shape[2:]
        for task in range(len(cost_values)):
            for field in range(2):
                values = distances[task, field].ravel()
                order = np.argsort(values)[::-1]
                _descend(
                    cost_values[task].ravel(),
                    linked[task].ravel(),
                    values,
                    order,
                    flat[task, field].ravel().copy(),
                    result[task].ravel(),
                    height,
                    width,
                )
        return torch.from_numpy(result), None, None, None


@compiled
def _descend(
    costs: NDArray[np.float32],
    linked: NDArray[np.uint16],
    values: NDArray[np.float32],
    order: NDArray[np.int64],
    gradient: NDArray[np.float32],
    result: NDArray[np.float32],
    height: int,
    width: int,
) -> None:  # pragma: no cover
    """Add the gradient by the costs, from the farthest node to the nearest.

    Args:
        costs: of all nodes.
        linked: see :func:`link_bits`.
        values: the distances.
        order: of the nodes, farthest first.
        gradient: by the distances; changed.
        result: gradient by the costs, added in place.
        height: of the map, in patches.
        width: of the map, in patches.
    """
    for node in order:
        if gradient[node] == 0 or values[node] >= UNREACHED or values[node] == 0:
            continue
        across, along = _parents(linked, values, node, height * width, width)
        slope, cost = gradient[node], costs[node]
        if across < 0 or along < 0 or abs(values[across] - values[along]) >= cost:
            is_across = along < 0 or (across >= 0 and values[across] < values[along])
            gradient[across if is_across else along] += slope
            result[node] += slope
            continue
        u, v = values[node] - values[across], values[node] - values[along]
        gradient[across] += slope * u / (u + v)
        gradient[along] += slope * v / (u + v)
        result[node] += slope * cost / (u + v)


@compiled
def _parents(
    linked: NDArray[np.uint16], values: NDArray[np.float32], node: int, cells: int, width: int
) -> tuple[int, int]:  # pragma: no cover
    """Return the nearest of the nodes linked along each axis, -1 for none."""
    cell = node % cells
    parents = np.full(2, -1, np.int64)
    for direction in range(4):
        axis = direction // 2
        step = (width if axis else 1) * (1 if direction % 2 else -1)
        for part in range(4):
            other = part * cells + cell + step
            is_linked = (linked[node] >> (4 * direction + part)) & 1
            if is_linked and (parents[axis] < 0 or values[other] < values[parents[axis]]):
                parents[axis] = other
    return parents[0], parents[1]
