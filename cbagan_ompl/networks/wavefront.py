"""Distance fields of start and goal over learned costs: how far a detour each cell would be.

The receptive field of convolutions grows with their number, and which door a path takes may be
decided farther away. Value iteration inside a network (Tamar et al., "Value iteration networks",
2016, https://arxiv.org/abs/1602.02867) has no such limit: the distances from each endpoint spread
by steps with shared weights until nothing changes.
"""

from __future__ import annotations

import math

import torch
from torch import Tensor, nn

# What a cell that obstacles fill adds to the logarithm of the costs of the steps from it, before
# anything is learned. Distance fields that spread through walls train the network badly: without it
# runs take several epochs to find out, and with few cost maps some never do.
_INITIAL_WALL_COST = 4.0


class Wavefront(nn.Module):
    """Features of each cell: how much longer the best path through it is than the best path of all.

    For each of C cost maps a 1x1 convolution, and a cost of walls, give the cost of every step
    between neighbouring cells (8-connected). D_s and D_g are the costs of the cheapest paths from
    the start and from the goal. With D*, the cost of the cheapest path of all, the relative detour
    of a cell is d = (D_s + D_g - D*) / (D* + 1), and its features are 2^(-20 d) and 2^(-4 d).

    The distance fields spread without gradients until they no longer change. The gradient of a
    distance is the one of the sum of the costs along its cheapest path.

    Args:
        channels: of the features that the costs are computed from.
        cost_maps: C.
        steps: limit of the steps until the distance fields no longer change.
    """

    def __init__(self, channels: int, cost_maps: int, steps: int = 320) -> None:
        super().__init__()
        self.costs = nn.Conv2d(channels, 4 * cost_maps, 1)
        self.wall_costs = nn.Parameter(torch.full((4 * cost_maps, 1, 1), _INITIAL_WALL_COST))
        self.steps = steps

    def forward(self, features: Tensor, blocked: Tensor, endpoints: Tensor) -> Tensor:
        """Return two features for each cost map: closeness to the best path, sharp and wide.

        Args:
            features: (B, channels, H, W).
            blocked: (B, 1, H, W), fraction of each cell that obstacles cover.
            endpoints: (B, 2, H, W), positive in the cells of the start, and of the goal.

        Returns:
            (B, 2 C, H, W) in [0, 1]; 1 on the cheapest paths. The C sharp ones come first.
        """
        return self.closeness(
            self.distances(self.edge_costs(features, blocked), endpoints), features.size(0)
        )

    def edge_costs(self, features: Tensor, blocked: Tensor) -> Tensor:
        """Return the costs of the steps between neighbouring cells.

        Args:
            features: (B, channels, H, W).
            blocked: (B, 1, H, W), fraction of each cell that obstacles cover.

        Returns:
            (4, H, W, B C), as :func:`step_costs` takes them: C cost maps of each task.
        """
        logarithms: Tensor = self.costs(features).float() + self.wall_costs * blocked
        edges = logarithms.clamp(-3.0, 6.0).exp()
        batch, height, width = edges.size(0), edges.size(2), edges.size(3)
        # Cells first, then tasks and cost maps: every operation works on long rows.
        edges = edges.view(batch, 4, -1, height, width).permute(1, 3, 4, 0, 2)
        return edges.flatten(3)

    def distances(self, edges: Tensor, endpoints: Tensor) -> Tensor:
        """Return the distance fields of start and goal, with gradients in training.

        Args:
            edges: (4, H, W, B C), from :meth:`edge_costs`.
            endpoints: (B, 2, H, W), as for :meth:`forward`.

        Returns:
            (2, H, W, B C).
        """
        costs = step_costs(edges)
        at_endpoint = endpoints.permute(1, 2, 3, 0) > 0
        cost_maps = costs.size(3) // endpoints.size(0)
        source = at_endpoint.unsqueeze(4).expand(-1, -1, -1, -1, cost_maps).flatten(3)
        distance = distance_fields(costs.detach(), source, self.steps)
        return differentiable_distances(distance, costs, source) if self.training else distance

    def closeness(self, distance: Tensor, batch: int) -> Tensor:
        """Return the features of the cells, see :meth:`forward`.

        Args:
            distance: (2, H, W, B C), from :meth:`distances`.
            batch: B.
        """
        height, width = distance.size(1), distance.size(2)
        through = distance.sum(0).view(height, width, batch, -1).permute(2, 3, 0, 1)
        best = through.amin((2, 3), keepdim=True)
        detour = (through - best) / (best + 1.0)
        # 2^(-x) as an exponential function of base e, which ONNX has.
        return torch.exp(-math.log(2) * torch.cat((20.0 * detour, 4.0 * detour), 1))


def step_costs(edges: Tensor) -> Tensor:
    """Return the costs of the eight steps into each cell, in the order of :func:`neighbours`.

    Args:
        edges: (4, H, W, K): of the steps between each cell and the ones to its right, below it,
            below to its right, and below to its left; the same in both directions. Diagonal steps
            are the root of 2 times as long.

    Returns:
        (8, H, W, K). No step comes from outside, whatever its cost says.
    """
    right, below = edges[0], edges[1]
    falling, rising = 2.0**0.5 * edges[2], 2.0**0.5 * edges[3]
    steps = [
        neighbours(_add_frame(falling, 0.0))[0],
        neighbours(_add_frame(below, 0.0))[1],
        neighbours(_add_frame(rising, 0.0))[2],
        neighbours(_add_frame(right, 0.0))[3],
    ]
    steps.extend([right, rising, below, falling])
    return torch.stack(steps)


def neighbours(framed: Tensor) -> list[Tensor]:
    """Return the values of the eight neighbours of each cell, as views.

    Args:
        framed: (..., H + 2, W + 2, K).

    Returns:
        Eight tensors (..., H, W, K), row by row: from the upper left neighbour to the lower right.
    """
    height, width = framed.size(-3) - 2, framed.size(-2) - 2
    views: list[Tensor] = []
    for down, right in [(0, 0), (0, 1), (0, 2), (1, 0), (1, 2), (2, 0), (2, 1), (2, 2)]:
        views.append(framed.narrow(-3, down, height).narrow(-2, right, width))
    return views


def distance_fields(costs: Tensor, source: Tensor, steps: int) -> Tensor:
    """Return the costs of the cheapest paths from the sources, without gradients.

    Args:
        costs: (8, H, W, K), see :func:`step_costs`, positive.
        source: (F, H, W, K), true where the paths of each of F distance fields begin.
        steps: limit of the steps.

    Returns:
        (F, H, W, K); 1e4 in the cells that no path of that many steps reaches.
    """
    with torch.no_grad():
        fields, height, width, rows = source.size(0), source.size(1), source.size(2), source.size(3)
        # Staying is a ninth step. Two operations on the windows around all cells are faster than
        # two for each step.
        staying = torch.zeros_like(costs[:1])
        window_costs = torch.cat((costs[:4], staying, costs[4:]))
        window_costs = window_costs.view(3, 3, 1, height, width, rows)
        unreached = torch.full(source.size(), 1e4, device=costs.device)
        framed = _add_frame(unreached.masked_fill(source, 0.0), 1e4)
        field, row, cell = framed.stride(0), framed.stride(1), framed.stride(2)
        size = [3, 3, fields, height, width, rows]
        windows = framed.as_strided(size, [row, cell, field, row, cell, 1])
        distance = framed[:, 1:-1, 1:-1]
        candidates = torch.empty(size, device=costs.device)
        best, previous = torch.empty_like(unreached), torch.empty_like(unreached)
        for step in range(steps):
            checks = step % 4 == 0
            if checks:
                previous.copy_(distance)
            torch.add(windows, window_costs, out=candidates)
            # Into one long row and from there into the frame: up to a third of the time.
            torch.amin(candidates.view(9, -1), 0, out=best.view(-1))
            distance.copy_(best)
            if checks and torch.equal(best, previous):
                break
        return best


def differentiable_distances(distance: Tensor, costs: Tensor, source: Tensor) -> Tensor:
    """Return the same distances as sums of costs along the cheapest paths, which have gradients.

    Every cell knows its predecessor on its cheapest path. Sums over the last 2^k steps of all
    paths double in length from one k to the next (pointer jumping), so that a few rounds add up
    whole paths.

    Args:
        distance: as from :func:`distance_fields`.
        costs: as for :func:`distance_fields`.
        source: as for :func:`distance_fields`.
    """
    height, width = distance.size(1), distance.size(2)
    costs = costs.unsqueeze(1).expand(-1, distance.size(0), -1, -1, -1)
    with torch.no_grad():
        candidates = torch.stack(neighbours(_add_frame(distance, 1e4))) + costs
        best, direction = candidates.min(0)
        is_root = source | (best >= 1e4)
        cells = torch.arange(height * width, device=costs.device).view(height, width, 1)
        numbers = torch.stack(neighbours(_add_frame(cells, 0.0))).unsqueeze(1)
        predecessor = torch.where(
            is_root, cells, numbers.expand(costs.size()).gather(0, direction[None])[0]
        )
    path = costs.gather(0, direction[None])[0].masked_fill(is_root, 0.0).flatten(1, 2)
    predecessor = predecessor.flatten(1, 2)
    length = 1
    while length < height * width:
        path = path + path.gather(1, predecessor)
        predecessor = predecessor.gather(1, predecessor)
        length *= 2
    return torch.where(distance < 1e4, path.view(distance.size()), distance)


def _add_frame(values: Tensor, border: float) -> Tensor:
    """Return (..., H, W, K) with a border value around: (..., H + 2, W + 2, K)."""
    shape = list(values.shape)
    shape[-3] += 2
    shape[-2] += 2
    framed = torch.full(shape, border, dtype=values.dtype, device=values.device)
    framed.narrow(-3, 1, shape[-3] - 2).narrow(-2, 1, shape[-2] - 2).copy_(values)
    return framed
