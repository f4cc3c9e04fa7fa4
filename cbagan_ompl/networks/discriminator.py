"""The discriminators: does this region image belong to this map, and to these points?"""

from __future__ import annotations

import torch
from torch import Tensor, nn

from .attention import CBAM, Attention, AttentionBlock


class Discriminator(nn.Module):
    """The map discriminator and the point discriminator of the paper, which differ in their input.

    The paper gives the order of the layers, the first width (32), the doubling, and the last
    kernel (2, one channel). Strides are chosen here: 2 in every convolution but the last, so that
    each logit judges one patch and a step stays cheap; 1 in the last.

    Args:
        width: channels of each input after the first convolution; 32 in the paper.
        attention: see :class:`AttentionBlock`; self-attention only in the body.
        patch: images are averaged over patches of this many pixels a side first.
    """

    def __init__(self, width: int = 32, attention: Attention = CBAM, patch: int = 1) -> None:
        super().__init__()
        self.shrink: nn.Module = nn.AvgPool2d(patch) if patch > 1 else nn.Identity()
        self.condition_stem = _stem(width, attention.without_self_attention())
        self.region_stem = _stem(width, attention.without_self_attention())
        self.body = nn.Sequential(
            *_down(2 * width, 4 * width),
            *_down(4 * width, 8 * width),
            AttentionBlock(8 * width, attention),
            nn.Conv2d(8 * width, 2 * width, 1),
            nn.LeakyReLU(0.2, inplace=True),
            nn.Conv2d(2 * width, 1, 2),
        )

    def forward(self, condition: Tensor, region: Tensor) -> Tensor:
        """Logits (B, 1, h, w), one a patch; positive means that the region looks real.

        Args:
            condition: map image or point image, (B, 3, H, W) in [-1, 1].
            region: real or generated region image, (B, 3, H, W) in [-1, 1].
        """
        both = (
            self.condition_stem(self.shrink(condition)),
            self.region_stem(self.shrink(region)),
        )
        logits: Tensor = self.body(torch.cat(both, 1))
        return logits


def _stem(width: int, attention: Attention) -> nn.Sequential:
    return nn.Sequential(
        nn.Conv2d(3, width, 4, stride=2, padding=1),
        nn.LeakyReLU(0.2, inplace=True),
        AttentionBlock(width, attention),
    )


def _down(in_channels: int, out_channels: int) -> tuple[nn.Module, ...]:
    return (
        nn.Conv2d(in_channels, out_channels, 3, stride=2, padding=1, bias=False),
        nn.BatchNorm2d(out_channels),
        nn.LeakyReLU(0.2, inplace=True),
    )
