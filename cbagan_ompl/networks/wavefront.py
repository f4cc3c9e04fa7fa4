"""Wavefronts from start and goal over learned costs: how far a detour each place would be.

Convolutions see as far as their number; which door a path takes is decided farther away. Value
iteration (as in Tamar et al., "Value iteration networks", 2016) has no such limit: a front spreads
from each end by weight-shared steps until nothing changes.
"""

from __future__ import annotations

import torch
from torch import Tensor, nn

# What a place that obstacles fill adds to the logarithm of the costs of the steps from it, before
# anything is learned. Fronts that flow through walls teach little: without it runs take several
# epochs to find out, and with few metrics some never do.
_WALL_PRICE = 4.0


class Wavefront(nn.Module):
    """Features that say how much longer than the best one the best way through each place is.

    For each of C metrics a 1x1 convolution, and a price of walls, give the cost of every step
    between neighbouring places (8-connected); D_s and D_g are the costs of the cheapest ways from
    the start and from the goal. With the cheapest way of all, D*, the relative detour of a place is
    (D_s + D_g - D*) / (D* + 1).

    Fronts spread without gradients until they stand still. The gradient of a distance is the one
    of the costs along its cheapest way.

    Args:
        channels: of the features that the costs are read from.
        metrics: C.
        steps: limit of the steps until the fronts stand still.
    """

    def __init__(self, channels: int, metrics: int, steps: int = 320) -> None:
        super().__init__()
        self.costs = nn.Conv2d(channels, 4 * metrics, 1)
        self.walls = nn.Parameter(torch.full((4 * metrics, 1, 1), _WALL_PRICE))
        self.steps = steps

    def forward(self, features: Tensor, blocked: Tensor, ends: Tensor) -> Tensor:
        """Two features a metric: closeness to the best way, sharp and wide.

        Args:
            features: (B, channels, H, W).
            blocked: (B, 1, H, W), share of each place that obstacles have.
            ends: (B, 2, H, W), positive where the front of the start begins, and of the goal.

        Returns:
            (B, 2 C, H, W) in [0, 1]; 1 on the cheapest ways.
        """
        edges = (self.costs(features).float() + self.walls * blocked).clamp(-3.0, 6.0).exp()
        batch, height, width = edges.size(0), edges.size(2), edges.size(3)
        # Places first, then tasks and metrics: every operation works on long rows.
        edges = edges.view(batch, 4, -1, height, width).permute(1, 3, 4, 0, 2)
        costs = step_costs(edges.flatten(3))
        begins = ends.permute(1, 2, 3, 0) > 0
        metrics = costs.size(3) // batch
        source = begins.unsqueeze(4).expand(-1, -1, -1, -1, metrics).flatten(3)
        distance = spread(costs.detach(), source, self.steps)
        if self.training:
            distance = with_gradients(distance, costs, source)
        through = distance.sum(0).view(height, width, batch, metrics).permute(2, 3, 0, 1)
        best = through.amin((2, 3), keepdim=True)
        detour = (through - best) / (best + 1.0)
        return torch.cat((torch.exp2(-20.0 * detour), torch.exp2(-4.0 * detour)), 1)


def step_costs(edges: Tensor) -> Tensor:
    """The costs of the eight steps into each place, in the order of :func:`neighbours`.

    Args:
        edges: (4, H, W, K): of the steps between each place and the ones to its right, below it,
            below to its right, and below to its left; the same in both directions. Those across
            corners are the root of 2 times as long.

    Returns:
        (8, H, W, K). From outside no front comes, whatever the step costs.
    """
    right, below = edges[0], edges[1]
    falling, rising = 2.0**0.5 * edges[2], 2.0**0.5 * edges[3]
    steps = [
        neighbours(_framed(falling, 0.0))[0],
        neighbours(_framed(below, 0.0))[1],
        neighbours(_framed(rising, 0.0))[2],
        neighbours(_framed(right, 0.0))[3],
    ]
    steps.extend([right, rising, below, falling])
    return torch.stack(steps)


def neighbours(framed: Tensor) -> list[Tensor]:
    """What lies around each place, as views.

    Args:
        framed: (..., H + 2, W + 2, K).

    Returns:
        Eight tensors (..., H, W, K), in reading order: from above to the left to below to the
        right.
    """
    height, width = framed.size(-3) - 2, framed.size(-2) - 2
    views: list[Tensor] = []
    for down, right in [(0, 0), (0, 1), (0, 2), (1, 0), (1, 2), (2, 0), (2, 1), (2, 2)]:
        views.append(framed.narrow(-3, down, height).narrow(-2, right, width))
    return views


def spread(costs: Tensor, source: Tensor, steps: int) -> Tensor:
    """Costs of the cheapest ways from the sources, without gradients.

    Args:
        costs: (8, H, W, K), see :func:`step_costs`, positive.
        source: (F, H, W, K), true where the ways of each of F fronts begin.
        steps: limit of the steps.

    Returns:
        (F, H, W, K); 1e4 where no front has come.
    """
    with torch.no_grad():
        fronts, height, width, rows = source.size(0), source.size(1), source.size(2), source.size(3)
        # Staying is a ninth step. Two operations on the windows around all places are faster than
        # two for each step.
        staying = torch.zeros_like(costs[:1])
        window_costs = torch.cat((costs[:4], staying, costs[4:]))
        window_costs = window_costs.view(3, 3, 1, height, width, rows)
        far = torch.full(source.size(), 1e4, device=costs.device)
        framed = _framed(far.masked_fill(source, 0.0), 1e4)
        front, row, place = framed.stride(0), framed.stride(1), framed.stride(2)
        size = [3, 3, fronts, height, width, rows]
        windows = framed.as_strided(size, [row, place, front, row, place, 1])
        here = framed[:, 1:-1, 1:-1]
        reached = torch.empty(size, device=costs.device)
        arrived, before = torch.empty_like(far), torch.empty_like(far)
        for step in range(steps):
            looks = step % 4 == 0
            if looks:
                before.copy_(here)
            torch.add(windows, window_costs, out=reached)
            # Into one long row and from there into the frame: up to a third of the time.
            torch.amin(reached.view(9, -1), 0, out=arrived.view(-1))
            here.copy_(arrived)
            if looks and torch.equal(arrived, before):
                break
        return arrived


def with_gradients(distance: Tensor, costs: Tensor, source: Tensor) -> Tensor:
    """The same distances as sums of costs along the cheapest ways, which have gradients.

    Every place knows the one before it on its cheapest way. Sums over the last 2^k steps of all
    ways double in length from one k to the next, so that a few rounds add up whole ways.

    Args:
        distance: as from :func:`spread`.
        costs: as for :func:`spread`.
        source: as for :func:`spread`.
    """
    height, width = distance.size(1), distance.size(2)
    costs = costs.unsqueeze(1).expand(-1, distance.size(0), -1, -1, -1)
    with torch.no_grad():
        candidates = torch.stack(neighbours(_framed(distance, 1e4))) + costs
        best, direction = candidates.min(0)
        stays = source | (best >= 1e4)
        places = torch.arange(height * width, device=costs.device).view(height, width, 1)
        numbers = torch.stack(neighbours(_framed(places, 0.0))).unsqueeze(1)
        before = torch.where(
            stays, places, numbers.expand(costs.size()).gather(0, direction[None])[0]
        )
    way = costs.gather(0, direction[None])[0].masked_fill(stays, 0.0).flatten(1, 2)
    before = before.flatten(1, 2)
    length = 1
    while length < height * width:
        way = way + way.gather(1, before)
        before = before.gather(1, before)
        length *= 2
    return torch.where(distance < 1e4, way.view(distance.size()), distance)


def _framed(values: Tensor, border: float) -> Tensor:
    """(..., H, W, K) -> (..., H + 2, W + 2, K), with a value around it."""
    shape = list(values.shape)
    shape[-3] += 2
    shape[-2] += 2
    framed = torch.full(shape, border, dtype=values.dtype, device=values.device)
    framed.narrow(-3, 1, shape[-3] - 2).narrow(-2, 1, shape[-2] - 2).copy_(values)
    return framed
