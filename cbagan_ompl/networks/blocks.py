"""The parts of the generators: residual blocks, and stages that halve and double the size."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import torch
from torch import Tensor, nn
from torch.nn import functional

from .attention import Attention, AttentionBlock


def stride_of(patch: int, widths: Sequence[int]) -> int:
    """Return the number of pixels that height and width of a generator's images are multiples of.

    Args:
        patch: size of the square patches that the generator reads at once, in pixels.
        widths: channels after each of its stages down, each of which halves the size.

    Example:
        >>> stride_of(4, (32, 48, 64))
        32
    """
    return int(patch * 2 ** len(widths))


class ResidualBlock(nn.Module):
    """Two 3x3 convolutions with batch norm and attention, added to a shortcut.

    A residual block as in He et al., "Deep residual learning for image recognition", 2016
    (https://arxiv.org/abs/1512.03385).

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
        """Return (B, out_channels, H / stride, W / stride) for (B, in_channels, H, W)."""
        return torch.relu(self.body(features) + self.shortcut(features))


class UpBlock(nn.Module):
    """Double height and width, add the skip of the stage down, then apply a residual block.

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
        """Return features of the skip's shape.

        Args:
            features: (B, in_channels, H, W).
            skip: (B, out_channels, 2 H, 2 W).
        """
        upsampled = functional.interpolate(self.project(features), scale_factor=2.0, mode="nearest")
        result: Tensor = self.block(upsampled + skip)
        return result


class Trunk(nn.Module):
    """The stages after the first one, down and up again: from half the size to half the size.

    Args:
        widths: channels after each of the stages down, the first one included; the stages up
            mirror them.
        attention: see :class:`AttentionBlock`. Self-attention, for SAGAN, is left out at half the
            size of the images, where it would cost most.
    """

    def __init__(self, widths: Sequence[int], attention: Attention) -> None:
        super().__init__()
        steps = list(pairwise(widths))
        self.downs = nn.ModuleList(ResidualBlock(*step, 2, attention) for step in steps)
        self.ups = nn.ModuleList(
            UpBlock(below, above, attention if level else attention.without_self_attention())
            for level, (above, below) in reversed(list(enumerate(steps)))
        )

    def forward(self, half: Tensor) -> Tensor:
        """Return features of the same shape (B, widths[0], h, w)."""
        skips = [half]
        for down in self.downs:
            skips.append(down(skips[-1]))
        features = skips.pop()
        for up in self.ups:
            features = up(features, skips.pop())
        return features
