"""The discriminators: is this region image a real one for this map, or for these points?"""

from __future__ import annotations

import torch
from torch import Tensor, nn

from .attention import CBAM, Attention, AttentionBlock

#: Patches that an image has at least in height and width: three convolutions of stride 2 shrink 10
#: of them to 5, 3 and 2, and the last kernel has the size 2.
MIN_PATCHES = 10


class Discriminator(nn.Module):
    """The map discriminator and the point discriminator, which differ in their input alone.

    The CBAGAN-RRT paper (https://arxiv.org/abs/2305.10442) gives the order of the layers, the
    first width (32), the doubling, and the last kernel (2, one channel). Strides are chosen here:
    2 in every convolution but the last two, so that each logit classifies one part of the image
    and a step stays cheap; 1 in those.

    Args:
        width: channels of each input after the first convolution; 32 in the paper.
        attention: see :class:`AttentionBlock`; self-attention only in the body.
        patch: images are averaged over square patches of this size first, in pixels.
    """

    def __init__(self, width: int = 32, attention: Attention = CBAM, patch: int = 1) -> None:
        super().__init__()
        self.shrink: nn.Module = nn.AvgPool2d(patch) if patch > 1 else nn.Identity()
        self.condition_stem = _make_stem(width, attention.without_self_attention())
        self.region_stem = _make_stem(width, attention.without_self_attention())
        self.body = nn.Sequential(
            *_make_down(2 * width, 4 * width),
            *_make_down(4 * width, 8 * width),
            AttentionBlock(8 * width, attention),
            nn.Conv2d(8 * width, 2 * width, 1),
            nn.LeakyReLU(0.2, inplace=True),
            nn.Conv2d(2 * width, 1, 2),
        )

    def forward(self, condition: Tensor, region: Tensor) -> Tensor:
        """Return logits (B, 1, h, w), one for each part of the image; positive means real.

        Args:
            condition: map image or point image, (B, 3, H, W) in [-1, 1]; H and W are at least
                :data:`MIN_PATCHES` patches.
            region: real or generated region image, (B, 3, H, W) in [-1, 1].
        """
        both = (
            self.condition_stem(self.shrink(condition)),
            self.region_stem(self.shrink(region)),
        )
        logits: Tensor = self.body(torch.cat(both, 1))
        return logits


def _make_stem(width: int, attention: Attention) -> nn.Sequential:
    return nn.Sequential(
        nn.Conv2d(3, width, 4, stride=2, padding=1),
        nn.LeakyReLU(0.2, inplace=True),
        AttentionBlock(width, attention),
    )


def _make_down(in_channels: int, out_channels: int) -> tuple[nn.Module, ...]:
    return (
        nn.Conv2d(in_channels, out_channels, 3, stride=2, padding=1, bias=False),
        nn.BatchNorm2d(out_channels),
        nn.LeakyReLU(0.2, inplace=True),
    )
