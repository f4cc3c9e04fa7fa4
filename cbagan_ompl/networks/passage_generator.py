"""The generator of the bundled model: learned costs, exact passages, and directions of travel."""

from __future__ import annotations

from collections.abc import Sequence

import torch
from torch import Tensor, nn
from torch.nn import functional

from .attention import Attention
from .blocks import Trunk, stride_of
from .encoding import free_space, region_image, spot_centres
from .passages import (
    NODES,
    PATCH,
    component_table,
    directions,
    distance_fields,
    endpoint_nodes,
    patch_codes,
    unit_vectors,
)

# Features that the distances of a patch give, see PassageGenerator.paint.
_DISTANCE_FEATURES = 12


class PassageGenerator(nn.Module):
    """A generator that learns what it costs to travel, and finds the distances by itself.

    From the map alone the stages of the paper's generator give the features of each patch, and the
    costs of its nodes (:mod:`.passages`). With these costs the distances D_s and D_g of all nodes
    from start and goal are found exactly: T = D_s + D_g is the cost of the best path through a
    node, T* the least of all. The last layers paint the region and the directions of travel from
    the features of the patches and

        e = (T - T*) / (0.05 (T* + 1) + 0.25),

    for which 2^-e is the label that the networks are trained with, had all costs been right. Within
    a patch e changes as the distances do. What is painted in a node does not reach the others of
    its patch, on the other side of a wall.

    Args:
        widths: channels of the stages down; the stages up mirror them.
        attention: see :class:`~.attention.AttentionBlock`.
        stem: channels of the patches.
        white_obstacles: leave obstacles white in the image.
        rounds: limit of the rounds of :func:`~.passages.distance_fields`.
    """

    def __init__(
        self,
        widths: Sequence[int],
        attention: Attention,
        stem: int,
        white_obstacles: bool,
        rounds: int = 4096,
    ) -> None:
        super().__init__()
        self.patch, self.stride = PATCH, stride_of(PATCH, widths)
        self.cell = 2 * PATCH
        self.white_obstacles = white_obstacles
        self.rounds = rounds
        width = widths[0]
        self.map_stem = nn.Conv2d(3, stem, PATCH, PATCH)
        self.merge = nn.Conv2d(stem, width, 2, 2)
        self.noise_stem = nn.Conv2d(1, width, self.cell, self.cell)
        # At full strength noise drowns the map, for its weights never shrink to nothing.
        self.noise_gain = 0.1
        self.norm = nn.BatchNorm2d(width)
        self.trunk = Trunk(widths, attention)
        self.split = nn.Conv2d(width, 4 * stem, 1)
        self.refine = _convolution(stem, stem)
        self.costs = nn.Conv2d(stem, NODES, 1)
        self.fuse = _convolution(stem + _DISTANCE_FEATURES, stem)
        self.head = nn.Linear(stem, PATCH**2 + 2)
        self.gain = nn.Parameter(torch.ones(1))
        self.table: Tensor
        self.offsets: Tensor
        self.register_buffer("table", component_table(), persistent=False)
        # Of the pixels of a patch from its centre, in patches: (2, 16), to the right and down.
        offsets = (torch.arange(PATCH) + 0.5) / PATCH - 0.5
        grid = torch.stack((offsets.repeat(PATCH), offsets.repeat_interleave(PATCH)))
        self.register_buffer("offsets", grid, persistent=False)
        with torch.no_grad():  # begin with equal costs, and the region that they give
            self.costs.weight.mul_(0.1)
            self.head.weight.mul_(0.1)

    def forward(
        self, map_image: Tensor, point_image: Tensor, noise: Tensor
    ) -> tuple[Tensor, Tensor]:
        """Return the image of the region, and the directions of travel.

        Args:
            map_image: (B, 3, H, W), see :mod:`~.encoding`.
            point_image: (B, 3, H, W), the same.
            noise: (B, 1, H, W), standard normal.

        Returns:
            (B, 3, H, W) in [-1, 1], and (B, 2, H / 4, W / 4): unit vectors (u, v), v down, 0 where
            no path leads.
        """
        free = free_space(map_image)
        map_features = torch.relu(self.map_stem(map_image))
        merged = self.merge(map_features) + self.noise_stem(self.noise_gain * noise)
        features, costs = self.encode(map_features, torch.relu(self.norm(merged)))
        codes = self.codes(free)
        start, goal = spot_centres(point_image)
        distances, towards = self.distances(
            costs, codes, endpoint_nodes(start, codes), endpoint_nodes(goal, codes)
        )
        region, direction = self.paint(features, costs, codes, distances, towards, free)
        return region_image(region), direction

    def codes(self, free: Tensor) -> Tensor:
        """Return the nodes of each patch, see :func:`.passages.patch_codes`."""
        return patch_codes(free, self.table)

    def encode(self, map_features: Tensor, half: Tensor) -> tuple[Tensor, Tensor]:
        """Return the features and the costs of the patches: what depends on the map alone.

        Args:
            map_features: (B, stem, h, w), from the map stem.
            half: (B, width, h / 2, w / 2), from those of 2 x 2 patches and the noise.

        Returns:
            (B, stem, h, w), and (B, 4, h, w) float32, positive.
        """
        patches = functional.pixel_shuffle(self.split(self.trunk(half)), 2)
        features = self.refine(torch.relu(patches + map_features))
        costs = self.costs(features).float().clamp(-2.0, 3.0).exp()
        return features, costs

    def distances(
        self, costs: Tensor, codes: Tensor, start: Tensor, goal: Tensor
    ) -> tuple[Tensor, Tensor]:
        """Return the distances of all nodes, and the directions in which they fall.

        See :mod:`.passages`: (B, 2, 4, h, w) and (B, 2, 2, 4, h, w), from start and goal.
        """
        if not torch.jit.is_scripting():  # type: ignore[attr-defined]
            return _march(costs, codes, start, goal)
        fields = distance_fields(costs, codes, start, goal, self.rounds)
        return fields, directions(fields, codes)

    def paint(
        self,
        features: Tensor,
        costs: Tensor,
        codes: Tensor,
        distances: Tensor,
        towards: Tensor,
        free: Tensor,
    ) -> tuple[Tensor, Tensor]:
        """Return the probability of the region, and the directions of travel.

        Args:
            features: from :meth:`encode`.
            costs: the same.
            codes: from :meth:`codes`.
            distances: from :meth:`distances`.
            towards: the same.
            free: (B, 1, H, W) in [0, 1], 1 where free.

        Returns:
            (B, 1, H, W) in [0, 1], and (B, 2, h, w) as of :meth:`forward`.
        """
        lowered = lowered_pixels(costs, codes, distances)
        return self.paint_pixels(features, costs, lowered, distances, towards, free)

    def paint_pixels(
        self,
        features: Tensor,
        costs: Tensor,
        lowered: Tensor,
        distances: Tensor,
        towards: Tensor,
        free: Tensor,
    ) -> tuple[Tensor, Tensor]:
        """Return region and directions; arguments and result as of :meth:`paint`.

        Args:
            features: as there.
            costs: as there.
            lowered: from :func:`lowered_pixels`.
            distances: as there.
            towards: as there.
            free: as there.
        """
        excess, best, unit = _excess(costs, distances)
        least, node = excess.min(1, keepdim=True)
        size = [-1, 4, -1, -1, -1]
        towards = towards.flatten(1, 2).gather(2, node.unsqueeze(1).expand(size)).squeeze(2)
        to_goal = towards[:, 2:]
        cost = costs.gather(1, node)
        slope = (towards[:, :2] + to_goal) * (-cost / unit)
        known = distances[:, 0].gather(1, node)
        own = _label_logit(least)
        inputs = torch.cat(
            (
                features,
                torch.exp2(-least),
                torch.exp2(-0.25 * least),
                0.25 * own,
                (known / (best + 1.0)).clamp(0.0, 2.0),
                0.1 * (best + 1.0).log2().expand_as(least),
                towards,
                slope,
                0.5 * cost.log(),
            ),
            1,
        )
        # With the channels last a linear layer is a 1x1 convolution, and faster.
        painted = self.head(self.fuse(inputs).permute(0, 2, 3, 1)).float()
        within = torch.matmul(slope.permute(0, 2, 3, 1), self.offsets)
        pixels = least.permute(0, 2, 3, 1) + within
        tiles = painted[..., :16] + self.gain * _label_logit(pixels) + lowered
        batch, height, width = tiles.size(0), tiles.size(1), tiles.size(2)
        tiles = torch.sigmoid(tiles).view(batch, height, width, 4, 4).transpose(2, 3)
        region = tiles.reshape(free.size())
        vectors = painted[..., 16:].permute(0, 3, 1, 2) + to_goal
        vectors = unit_vectors(vectors) * (distances[:, 1].gather(1, node) < 1e4)
        return (region * free if self.white_obstacles else region), vectors


def lowered_pixels(costs: Tensor, codes: Tensor, distances: Tensor) -> Tensor:
    """Return by how much the node of each pixel is worse than the best one of its patch.

    Programs call the compiled one in :mod:`.lowered_pixels`.

    Args:
        costs: (B, 4, h, w), see :mod:`.passages`.
        codes: the same.
        distances: (B, 2, 4, h, w), the same.

    Returns:
        (B, h, w, 16), at most 0, as logits; of the best one where a pixel belongs to several nodes.
    """
    logits = _label_logit(_excess(costs, distances)[0])
    worse = (logits - logits.amax(1, keepdim=True)) * (codes > 0)
    if not bool((worse < 0).any()):
        return torch.zeros_like(worse[:, :1]).permute(0, 2, 3, 1).expand(-1, -1, -1, 16)
    bits = torch.arange(16, dtype=torch.int32, device=codes.device)
    members = ((codes.unsqueeze(4) >> bits) & 1).float()
    best = (members * (worse + 20.0).unsqueeze(4)).amax(1)
    return torch.where(best > 0, best - 20.0, best)


def _excess(costs: Tensor, distances: Tensor) -> tuple[Tensor, Tensor, Tensor]:
    """Return how much longer the best path through each node is than the best of all.

    Returns:
        (B, 4, h, w), in units in which the label falls to one half; the best distance, and the
        unit, both (B, 1, 1, 1).
    """
    # Both distances count the cost of the node itself.
    through = distances.sum(1) - costs
    best = through.amin((1, 2, 3), keepdim=True)
    unit = 0.05 * (best + 1.0) + 0.25
    return ((through - best) / unit).clamp(0.0, 12.0), best, unit


@torch.jit.unused
def _march(costs: Tensor, codes: Tensor, start: Tensor, goal: Tensor) -> tuple[Tensor, Tensor]:
    """Return the distances with gradients, and the directions."""
    # Here, since numba takes long to import.
    from .marching_gradients import FastMarching

    result: tuple[Tensor, Tensor] = FastMarching.apply(costs, codes, start, goal)  # type: ignore[no-untyped-call]
    return result


def _label_logit(excess: Tensor) -> Tensor:
    """Return the logit of the label 2^-e."""
    return -torch.log(torch.exp2(excess.clamp(0.02, 8.0)) - 1.0)


def _convolution(inputs: int, outputs: int) -> nn.Sequential:
    return nn.Sequential(
        nn.Conv2d(inputs, outputs, 3, padding=1, bias=False), nn.BatchNorm2d(outputs), nn.ReLU()
    )
