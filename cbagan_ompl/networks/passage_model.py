"""What an exported file computes with a generator that learns costs of travel."""

from __future__ import annotations

import torch
from torch import Tensor, nn
from torch.nn.utils.fusion import fuse_conv_bn_weights

from .passage_generator import PassageGenerator
from .passages import endpoint_nodes
from .tiles import make_free_stem, pad_to_stride, tiles_of


class PassageModel(nn.Module):
    """A :class:`PassageGenerator` without its images, in parts that can be called by themselves.

    What :meth:`read_map` returns depends on the map alone. Between it and :meth:`paint` come the
    nodes and the distances, which have no weights: a program computes them by compiled code
    (:mod:`.full_nodes`, :mod:`.fast_marching`, :mod:`.lowered_pixels`).

    Args:
        generator: with its trained weights, in evaluation mode.
    """

    def __init__(self, generator: PassageGenerator) -> None:
        super().__init__()
        self.generator = generator
        self.stride = generator.stride
        self.map_stem = make_free_stem(generator.map_stem)
        self.merge = _make_merge(generator)

    def forward(self, free: Tensor, start: Tensor, goal: Tensor) -> Tensor:
        """Return the probability of the region, as :meth:`RegionModel.forward`."""
        height, width = free.size(2), free.size(3)
        features, costs = self.read_map(free)
        free = pad_to_stride(free, self.stride)
        codes = self.generator.codes(free)
        nodes = endpoint_nodes(start, codes), endpoint_nodes(goal, codes)
        distances, towards = self.generator.distances(costs, codes, nodes[0], nodes[1])
        region = self.generator.paint(features, costs, codes, distances, towards, free)[0]
        return region[:, :, :height, :width]

    @torch.jit.export
    def read_map(self, free: Tensor) -> list[Tensor]:
        """Return the features and the costs of the patches of a map.

        Args:
            free: (B, 1, H, W) in [0, 1], 1 where free, of any size.

        Returns:
            (B, stem, h, w) and (B, 4, h, w), see :meth:`PassageGenerator.encode`; of h x w patches,
            to which the map is padded.
        """
        tiles = tiles_of(pad_to_stride(free, self.stride), 4)
        map_features = torch.relu(self.map_stem(tiles)).permute(0, 3, 1, 2)
        half = torch.relu(self.merge(map_features))
        features, costs = self.generator.encode(map_features, half)
        return [features, costs.contiguous()]

    @torch.jit.export
    def paint(
        self,
        kept: list[Tensor],
        lowered: Tensor,
        distances: Tensor,
        towards: Tensor,
        free: Tensor,
    ) -> list[Tensor]:
        """Return the probability of the region, and the directions of travel.

        Args:
            kept: from :meth:`read_map`.
            lowered: (B, h, w, 16), see :func:`.passage_generator.lowered_pixels`.
            distances: (B, 2, 4, h, w), see :func:`.passages.distance_fields`.
            towards: (B, 2, 2, 4, h, w), see :func:`.passages.directions`.
            free: (B, 1, 4 h, 4 w), 1 where free: the map with its padding.

        Returns:
            (B, 1, 4 h, 4 w) in [0, 1], and (B, 2, h, w): unit vectors (u, v), v down, of each
            patch; 0 where no path leads.
        """
        features, costs = kept[0], kept[1]
        painted = self.generator.paint_pixels(features, costs, lowered, distances, towards, free)
        return [painted[0], painted[1]]


def _make_merge(generator: PassageGenerator) -> nn.Conv2d:
    """Return a convolution that does what three layers do without noise."""
    merge, norm, noise_stem = generator.merge, generator.norm, generator.noise_stem
    assert merge.bias is not None
    assert norm.running_mean is not None
    assert norm.running_var is not None
    assert noise_stem.bias is not None
    weight, bias = fuse_conv_bn_weights(
        merge.weight,
        (merge.bias + noise_stem.bias).detach(),
        norm.running_mean,
        norm.running_var,
        norm.eps,
        norm.weight,
        norm.bias,
    )
    fused = nn.Conv2d(merge.in_channels, merge.out_channels, 2, 2)
    fused.weight, fused.bias = weight, bias
    return fused
