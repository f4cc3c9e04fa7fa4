"""The generator for maps larger than the paper's: patches of pixels, and wavefronts."""

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
    """The paper's generator with what its 64 pixels did not ask for: sight, and speed.

    The map stem reads each patch of P x P pixels as one place, every pixel of it, and the last
    layer paints all of its pixels, so that no pixel is lost. Squares of four places are where the
    points and the noise come in, where the stages of the paper's generator begin and end, and
    where wavefronts (:class:`.wavefront.Wavefront`) spread over the whole map.

    Args:
        widths: channels of the stages on the way down; the way up mirrors them.
        attention: see :class:`.attention.AttentionBlock`.
        stem: channels of the places.
        patch: P.
        metrics: of the wavefronts; none of them with 0.
        white_obstacles: leave obstacles white in the image.
    """

    def __init__(
        self,
        widths: Sequence[int],
        attention: Attention,
        stem: int,
        patch: int,
        metrics: int,
        white_obstacles: bool,
    ) -> None:
        super().__init__()
        self.patch, self.stride = patch, stride_of(patch, widths)
        self.square = 2 * patch
        self.white_obstacles = white_obstacles
        width = widths[0]
        self.map_stem = nn.Conv2d(3, stem, patch, patch)
        self.merge = nn.Conv2d(stem, width, 2, 2)
        self.point_stem = nn.Conv2d(3, width, self.square, self.square)
        self.noise_stem = nn.Conv2d(1, width, self.square, self.square)
        # At full strength noise drowns the map, for its weights never shrink to nothing.
        self.noise_gain = 0.1
        self.norm = nn.BatchNorm2d(width)
        self.trunk = Trunk(widths, attention)
        self.wavefront, self.fuse = None, None
        if metrics:
            self.wavefront = Wavefront(width, metrics)
            self.fuse = nn.Conv2d(2 * metrics, width, 1)
        self.split = nn.Conv2d(width, 4 * stem, 1)
        self.paint = nn.Sequential(
            nn.Conv2d(stem, stem, 3, padding=1, bias=False), nn.BatchNorm2d(stem), nn.ReLU()
        )
        self.head = nn.Linear(stem, patch**2)

    def forward(self, map_image: Tensor, point_image: Tensor, noise: Tensor) -> Tensor:
        """As :meth:`.generator.Generator.forward`."""
        free = free_space(map_image)
        features = self.features(
            torch.relu(self.map_stem(map_image)),
            self.point_stem(point_image) + self.noise_stem(self.noise_gain * noise),
            free,
            squares(point_image, self.square),
        )
        return region_image(self.region(features, free))

    def features(self, of_map: Tensor, of_points: Tensor, free: Tensor, ends: Tensor) -> Tensor:
        """All between the stems and the last layer.

        Args:
            of_map: (B, stem, h, w), what the stem makes of the map.
            of_points: (B, width, h / 2, w / 2), the same of the points and the noise.
            free: (B, 1, H, W) in [0, 1], 1 where free.
            ends: (B, 2, h / 2, w / 2), see :func:`squares`.

        Returns:
            (B, stem, h, w).
        """
        half = torch.relu(self.norm(self.merge(of_map) + of_points))
        features: Tensor = self.trunk(half)
        if self.wavefront is not None and self.fuse is not None:
            blocked = 1 - functional.avg_pool2d(free, self.square)
            fronts = self.wavefront(features, blocked, ends)
            features = torch.relu(features + self.fuse(fronts.to(features.dtype)))
        places = functional.pixel_shuffle(self.split(features), 2)
        painted: Tensor = self.paint(torch.relu(places + of_map))
        return painted

    def region(self, features: Tensor, free: Tensor) -> Tensor:
        """What the last layer makes of the features: the probability of the region.

        Args:
            features: (B, stem, h, w), see :meth:`features`.
            free: (B, 1, H, W) in [0, 1], 1 where free.

        Returns:
            (B, 1, H, W) in [0, 1].
        """
        # On places whose channels come last a linear layer is a 1x1 convolution, and faster.
        batch, height, width = features.size(0), features.size(2), features.size(3)
        tiles = torch.sigmoid(self.head(features.permute(0, 2, 3, 1)))
        tiles = tiles.view(batch, height, width, self.patch, self.patch).transpose(2, 3)
        region = tiles.reshape(free.size())
        return region * free if self.white_obstacles else region


def squares(point_image: Tensor, size: int) -> Tensor:
    """The square of the start and that of the goal.

    Args:
        point_image: (B, 3, H, W), see :mod:`.encoding`.
        size: of a square, in pixels.

    Returns:
        (B, 2, H / size, W / size), 1 where most of the spot of the start is, and of the goal.
    """
    height, width = point_image.size(2) // size, point_image.size(3) // size
    tiles = point_image[:, ::2].reshape(-1, 2, height, size, width * size).sum(3)
    brightness = tiles.reshape(-1, 2, height, width, size).sum(4)
    return (brightness <= brightness.amin((2, 3), keepdim=True)).float()
