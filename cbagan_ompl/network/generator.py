"""The generator: map, points and noise in, the image of the promising region out."""

from __future__ import annotations

from collections.abc import Sequence

import torch
from torch import Tensor, nn
from torch.nn import functional

from .attention import CBAM, Attention, AttentionBlock
from .wavefront import Wavefront

#: The generator halves its features this many times.
STAGES = 4


class ResidualBlock(nn.Module):
    """Two 3x3 convolutions with batch norm and attention, added to a shortcut.

    Args:
        in_channels: channels of the input.
        out_channels: channels of the output.
        stride: 2 halves height and width in the first convolution, 1 keeps them.
        attention: see :class:`AttentionBlock`.
    """

    def __init__(
        self,
        in_channels: int,
        out_channels: int,
        stride: int,
        attention: Attention,
    ) -> None:
        super().__init__()
        self.body = nn.Sequential(
            nn.Conv2d(in_channels, out_channels, 3, stride, padding=1, bias=False),
            nn.BatchNorm2d(out_channels),
            nn.ReLU(inplace=True),
            nn.Conv2d(out_channels, out_channels, 3, padding=1, bias=False),
            nn.BatchNorm2d(out_channels),
            AttentionBlock(out_channels, attention),
        )
        self.shortcut: nn.Module = nn.Identity()
        if stride != 1 or in_channels != out_channels:
            # Averaging before the 1x1 convolution uses all pixels, where a stride drops three of
            # four, and its backward pass is several times as fast on a CPU.
            self.shortcut = nn.Sequential(
                nn.AvgPool2d(stride),
                nn.Conv2d(in_channels, out_channels, 1, bias=False),
                nn.BatchNorm2d(out_channels),
            )

    def forward(self, features: Tensor) -> Tensor:
        """(B, C_in, H, W) -> (B, C_out, H / stride, W / stride)."""
        return torch.relu(self.body(features) + self.shortcut(features))


class UpBlock(nn.Module):
    """Twice the height and width, the skip from the way down added, then a residual block.

    The channels change by a 1x1 convolution before the upsampling, where it costs a quarter.

    Args:
        in_channels: channels of the coarse features.
        out_channels: channels of the output, and of the skip.
        attention: see :class:`AttentionBlock`.
    """

    def __init__(
        self,
        in_channels: int,
        out_channels: int,
        attention: Attention,
    ) -> None:
        super().__init__()
        self.project = nn.Conv2d(in_channels, out_channels, 1)
        self.block = ResidualBlock(out_channels, out_channels, 1, attention)

    def forward(self, features: Tensor, skip: Tensor) -> Tensor:
        """(B, C_in, H, W) and (B, C_out, 2 H, 2 W) -> (B, C_out, 2 H, 2 W)."""
        upsampled = functional.interpolate(self.project(features), scale_factor=2.0, mode="nearest")
        result: Tensor = self.block(upsampled + skip)
        return result


class Generator(nn.Module):
    """The generator of the paper: stems, four residual stages down, four up, 1x1 to an image.

    The paper gives the stems (3x3, to 16, 16 and 32 channels, ReLU), the number of stages and the
    last layer (1x1 to three channels, tanh). Chosen here, because the text is silent:

    * the widths: most weights sit in the coarse stages, which see the whole map and cost little
      time; the last stage runs at full size with the 16 channels of a stem;
    * additive skips between stages of equal size, so that walls stay sharp;
    * batch norm in every residual block, and at the end of it the attention block that the paper
      draws for the discriminators; only the last stage has none, where it would cost most;
    * self-attention, for SAGAN, where the features have a quarter of the side or less.

    Two options go past the paper, for maps larger than its 64 pixels. With patches of P x P pixels
    the stems read each patch as one place, every pixel of it, and the last layer paints all of its
    pixels: the cost of an image with a P-th of the side, and no pixel lost. With metrics,
    wavefronts (:class:`.wavefront.Wavefront`) spread over the places of the first stage, and what
    they say joins the features on the way up.

    Args:
        widths: channels after each of the four stages on the way down; the way up mirrors them.
        attention: see :class:`AttentionBlock`.
        stem: channels of the map stem, of the point stem, and of the last stage.
        noise_stem: channels of the noise stem.
        patch: P.
        metrics: of the wavefronts; none of them with 0.
        white_obstacles: leave obstacles white in the image.
    """

    def __init__(
        self,
        widths: Sequence[int] = (32, 64, 96, 128),
        attention: Attention = CBAM,
        stem: int = 16,
        noise_stem: int = 32,
        patch: int = 1,
        metrics: int = 0,
        white_obstacles: bool = False,
    ) -> None:
        super().__init__()
        self.patch = patch
        self.white_obstacles = white_obstacles
        self.map_stem = _stem(3, stem, patch)
        self.point_stem = _stem(3, stem, patch)
        self.noise_stem = _stem(1, noise_stem, patch)
        fine = attention.without_self_attention()
        one, two, three, four = widths
        self.down1 = ResidualBlock(2 * stem + noise_stem, one, 2, fine)
        self.down2 = ResidualBlock(one, two, 2, attention)
        self.down3 = ResidualBlock(two, three, 2, attention)
        self.down4 = ResidualBlock(three, four, 2, attention)
        self.up4 = UpBlock(four, three, attention)
        self.up3 = UpBlock(three, two, attention)
        self.up2 = UpBlock(two, one, fine)
        self.up1 = UpBlock(one, stem, Attention(False, False))
        self.head = nn.Conv2d(stem, 3 * patch**2, 1)
        self.wavefront = Wavefront(one, metrics) if metrics else None
        self.fuse = ResidualBlock(one + 2 * metrics, one, 1, fine) if metrics else None

    def forward(self, map_image: Tensor, point_image: Tensor, noise: Tensor) -> Tensor:
        """The image of the region, values in (-1, 1).

        Args:
            map_image: (B, 3, H, W) in [-1, 1], see :mod:`cbagan_ompl.network.encoding`.
            point_image: (B, 3, H, W) in [-1, 1].
            noise: (B, 1, H, W), standard normal in training, zero at inference.

        Returns:
            (B, 3, H, W); H and W must be multiples of :func:`stride_of` the patch.
        """
        features = self.features(
            torch.relu(self.map_stem(map_image)),
            torch.relu(self.point_stem(point_image)),
            torch.relu(self.noise_stem(noise)),
            places(point_image, 2 * self.patch),
        )
        image = torch.tanh(functional.pixel_shuffle(self.head(features), self.patch))
        if self.white_obstacles:
            image = image.masked_fill(map_image[:, :1] < 0, 1.0)
        return image

    def features(self, of_map: Tensor, of_points: Tensor, of_noise: Tensor, ends: Tensor) -> Tensor:
        """All between the stems and the last layer.

        Args:
            of_map: (B, stem, h, w), what the stem makes of the map.
            of_points: the same of the points.
            of_noise: (B, noise_stem, h, w).
            ends: (B, 2, h / 2, w / 2), see :func:`places`.

        Returns:
            (B, stem, h, w).
        """
        half = self.down1(torch.cat((of_map, of_points, of_noise), 1))
        quarter = self.down2(half)
        eighth = self.down3(quarter)
        features = self.up4(self.down4(eighth), eighth)
        features = self.up3(features, quarter)
        features = self.up2(features, half)
        if self.wavefront is not None and self.fuse is not None:
            fronts = self.wavefront(features, ends)
            features = self.fuse(torch.cat((features, fronts.to(features.dtype)), 1))
        painted: Tensor = self.up1(features, of_map + of_points)
        return painted


def stride_of(patch: int) -> int:
    """What the height and the width of the images are multiples of."""
    return int(patch * 2**STAGES)


def _stem(channels: int, width: int, patch: int) -> nn.Conv2d:
    if patch == 1:
        return nn.Conv2d(channels, width, 3, padding=1)
    return nn.Conv2d(channels, width, patch, stride=patch)


def places(point_image: Tensor, size: int) -> Tensor:
    """The place of the start and that of the goal, for places of ``size`` x ``size`` pixels.

    Args:
        point_image: (B, 3, H, W), see :mod:`.encoding`.
        size: of a place.

    Returns:
        (B, 2, H / size, W / size), 1 where most of the spot of the start is, and of the goal.
    """
    height, width = point_image.size(2) // size, point_image.size(3) // size
    tiles = point_image[:, ::2].reshape(-1, 2, height, size, width * size).sum(3)
    brightness = tiles.reshape(-1, 2, height, width, size).sum(4)
    return (brightness <= brightness.amin((2, 3), keepdim=True)).float()
