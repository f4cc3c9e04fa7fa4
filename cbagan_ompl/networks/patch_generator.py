"""The generator for maps larger than the paper's: patches of pixels, and a wavefront."""

from __future__ import annotations

from collections.abc import Sequence

import torch
from torch import Tensor, nn
from torch.nn import functional

from .attention import Attention
from .blocks import Trunk, stride_of
from .encoding import free_space, region_image
from .wavefront import Wavefront


class PatchGenerator(nn.Module):
    """The paper's generator, made fast on large maps and able to see all of them.

    The map stem reads each patch of P x P pixels at once, every pixel of it, and the last layer
    writes all of its pixels, so that no pixel is lost. Cells of 2 x 2 patches are where the points
    and the noise come in, where the stages of the paper's generator begin and end, and where the
    wavefront (:class:`~.wavefront.Wavefront`) spreads over the whole map.

    Args:
        widths: channels of the stages down; the stages up mirror them.
        attention: see :class:`~.attention.AttentionBlock`.
        stem: channels of the patches.
        patch: P.
        cost_maps: of the wavefront; with 0 there is none.
        white_obstacles: leave obstacles white in the image.
    """

    def __init__(
        self,
        widths: Sequence[int],
        attention: Attention,
        stem: int,
        patch: int,
        cost_maps: int,
        white_obstacles: bool,
    ) -> None:
        super().__init__()
        self.patch, self.stride = patch, stride_of(patch, widths)
        self.cell = 2 * patch
        self.white_obstacles = white_obstacles
        width = widths[0]
        self.map_stem = nn.Conv2d(3, stem, patch, patch)
        self.merge = nn.Conv2d(stem, width, 2, 2)
        self.point_stem = nn.Conv2d(3, width, self.cell, self.cell)
        self.noise_stem = nn.Conv2d(1, width, self.cell, self.cell)
        # At full strength noise drowns the map, for its weights never shrink to nothing.
        self.noise_gain = 0.1
        self.norm = nn.BatchNorm2d(width)
        self.trunk = Trunk(widths, attention)
        self.wavefront, self.fuse = None, None
        if cost_maps:
            self.wavefront = Wavefront(width, cost_maps)
            self.fuse = nn.Conv2d(2 * cost_maps, width, 1)
        self.split = nn.Conv2d(width, 4 * stem, 1)
        self.refine = nn.Sequential(
            nn.Conv2d(stem, stem, 3, padding=1, bias=False), nn.BatchNorm2d(stem), nn.ReLU()
        )
        self.head = nn.Linear(stem, patch**2)

    def forward(self, map_image: Tensor, point_image: Tensor, noise: Tensor) -> Tensor:
        """Return the image of the region, as :meth:`.generator.Generator.forward`."""
        free = free_space(map_image)
        features = self.features(
            torch.relu(self.map_stem(map_image)),
            self.point_stem(point_image) + self.noise_stem(self.noise_gain * noise),
            free,
            endpoint_cells(point_image, self.cell),
        )
        return region_image(self.region(features, free))

    def features(
        self, map_features: Tensor, point_features: Tensor, free: Tensor, endpoints: Tensor
    ) -> Tensor:
        """Return the features of the patches: all layers between the stems and the last one.

        Args:
            map_features: (B, stem, h, w) of h x w patches, from the map stem.
            point_features: (B, width, h / 2, w / 2), from the point stem and the noise stem.
            free: (B, 1, H, W) in [0, 1], 1 where free.
            endpoints: (B, 2, h / 2, w / 2), see :func:`endpoint_cells`.

        Returns:
            (B, stem, h, w).
        """
        features = self.cell_features(self.merge(map_features) + point_features)
        closeness: Tensor | None = None
        if self.wavefront is not None:
            closeness = self.wavefront(features, self.blocked(free), endpoints)
        return self.patch_features(features, closeness, map_features)

    def cell_features(self, merged: Tensor) -> Tensor:
        """Return the features of the cells before the wavefront, (B, width, h / 2, w / 2).

        Args:
            merged: the sum of the merged map features and the point features, of the same shape.
        """
        features: Tensor = self.trunk(torch.relu(self.norm(merged)))
        return features

    def blocked(self, free: Tensor) -> Tensor:
        """Return the fraction of each cell that obstacles cover, (B, 1, h / 2, w / 2)."""
        return 1 - functional.avg_pool2d(free, self.cell)

    def patch_features(
        self, features: Tensor, closeness: Tensor | None, map_features: Tensor
    ) -> Tensor:
        """Return the features of the patches, as :meth:`features`.

        Args:
            features: from :meth:`cell_features`.
            closeness: of the wavefront, where there is one.
            map_features: as for :meth:`features`.
        """
        if closeness is not None and self.fuse is not None:
            features = torch.relu(features + self.fuse(closeness.to(features.dtype)))
        patches = functional.pixel_shuffle(self.split(features), 2)
        refined: Tensor = self.refine(torch.relu(patches + map_features))
        return refined

    def region(self, features: Tensor, free: Tensor) -> Tensor:
        """Return the probability of the region: the last layer.

        Args:
            features: (B, stem, h, w), see :meth:`features`.
            free: (B, 1, H, W) in [0, 1], 1 where free.

        Returns:
            (B, 1, H, W) in [0, 1].
        """
        # With the channels last a linear layer is a 1x1 convolution, and faster.
        batch, height, width = features.size(0), features.size(2), features.size(3)
        tiles = torch.sigmoid(self.head(features.permute(0, 2, 3, 1)))
        tiles = tiles.view(batch, height, width, self.patch, self.patch).transpose(2, 3)
        size = [batch, 1, height * self.patch, width * self.patch]
        region = tiles.reshape(size)
        return region * free if self.white_obstacles else region


def endpoint_cells(point_image: Tensor, size: int) -> Tensor:
    """Return the cell of the start and that of the goal.

    Args:
        point_image: (B, 3, H, W), see :mod:`~.encoding`.
        size: of a cell, in pixels.

    Returns:
        (B, 2, H / size, W / size), 1 where most of the spot of the start is, and of the goal.
    """
    height, width = point_image.size(2) // size, point_image.size(3) // size
    tiles = point_image[:, ::2].reshape(-1, 2, height, size, width * size).sum(3)
    brightness = tiles.reshape(-1, 2, height, width, size).sum(4)
    return (brightness <= brightness.amin((2, 3), keepdim=True)).float()
