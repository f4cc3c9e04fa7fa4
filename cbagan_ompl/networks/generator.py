"""The generator of the paper: map, points and noise in, the image of the promising region out."""

from __future__ import annotations

from collections.abc import Sequence

import torch
from torch import Tensor, nn

from .attention import CBAM, Attention
from .blocks import ResidualBlock, Trunk, UpBlock, stride_of


class Generator(nn.Module):
    """The generator of the CBAGAN-RRT paper (https://arxiv.org/abs/2305.10442).

    Stems for map, points and noise, residual stages down and up again, 1x1 to an image. The paper
    gives the stems (3x3, to 16, 16 and 32 channels, ReLU), the number of stages (four down, four
    up) and the last layer (1x1 to three channels, tanh). The text does not give, and chosen here
    are:

    * the widths: most weights sit in the coarse stages, which see the whole map and cost little
      time; the last stage runs at full size with the 16 channels of a stem;
    * additive skips between stages of equal size, so that walls stay sharp;
    * batch norm in every residual block, and at the end of it the attention block that the paper
      draws for the discriminators; only the last stage has none, where it would cost most;
    * self-attention, for SAGAN, at a quarter of the size of the images and below.

    Args:
        widths: channels after each of the stages down; the stages up mirror them.
        attention: see :class:`~.attention.AttentionBlock`.
        stem: channels of the map stem, of the point stem, and of the last stage.
        noise_stem: channels of the noise stem.
    """

    def __init__(
        self,
        widths: Sequence[int] = (32, 64, 96, 128),
        attention: Attention = CBAM,
        stem: int = 16,
        noise_stem: int = 32,
    ) -> None:
        super().__init__()
        self.stride = stride_of(1, widths)
        self.map_stem = nn.Conv2d(3, stem, 3, padding=1)
        self.point_stem = nn.Conv2d(3, stem, 3, padding=1)
        self.noise_stem = nn.Conv2d(1, noise_stem, 3, padding=1)
        fine = attention.without_self_attention()
        self.down1 = ResidualBlock(2 * stem + noise_stem, widths[0], 2, fine)
        self.trunk = Trunk(widths, attention)
        self.up1 = UpBlock(widths[0], stem, Attention(False, False))
        self.head = nn.Conv2d(stem, 3, 1)

    def forward(self, map_image: Tensor, point_image: Tensor, noise: Tensor) -> Tensor:
        """Return the image of the region, values in (-1, 1).

        Args:
            map_image: (B, 3, H, W) in [-1, 1], see :mod:`~.encoding`; H and W must be multiples of
                the stride.
            point_image: (B, 3, H, W) in [-1, 1].
            noise: (B, 1, H, W), standard normal in training, zero at inference.

        Returns:
            (B, 3, H, W).
        """
        map_features = torch.relu(self.map_stem(map_image))
        point_features = torch.relu(self.point_stem(point_image))
        noise_features = torch.relu(self.noise_stem(noise))
        half = self.down1(torch.cat((map_features, point_features, noise_features), 1))
        return torch.tanh(self.head(self.up1(self.trunk(half), map_features + point_features)))
