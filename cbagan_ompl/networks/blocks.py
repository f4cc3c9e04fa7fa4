"""What generators are made of: residual blocks, and the stages that halve and double the size."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import torch
from torch import Tensor, nn
from torch.nn import functional

from .attention import Attention, AttentionBlock


def stride_of(patch: int, widths: Sequence[int]) -> int:
    """What the height and the width of a generator's images are multiples of.

    Args:
        patch: side of what the generator reads as one place, in pixels.
        widths: channels after each of its stages on the way down, of which each halves the size.
    """
    return int(patch * 2 ** len(widths))


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


class Trunk(nn.Module):
    """The stages after the first one, down and up again: from half the size to half the size.

    Args:
        widths: channels after each of the stages on the way down, the first one included; the way
            up mirrors them.
        attention: see :class:`AttentionBlock`. Self-attention, for SAGAN, is left out where the
            features have half of the side.
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
        """(B, widths[0], h, w) -> the same shape."""
        skips = [half]
        for down in self.downs:
            skips.append(down(skips[-1]))
        features = skips.pop()
        for up in self.ups:
            features = up(features, skips.pop())
        return features
