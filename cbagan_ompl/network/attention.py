"""Channel and spatial attention, and the block that applies both (after CBAM)."""

from __future__ import annotations

import torch
from torch import Tensor, nn


class ChannelAttention(nn.Module):
    """One weight in (0, 1) for each channel: eq. channel_attention_eqn of the paper.

    Global average pool, 1x1 convolution, ReLU, 1x1 convolution, sigmoid.

    Args:
        channels: channels C of the features.
        reduction: the hidden layer has C / reduction channels (at least 4), as in CBAM; the
            paper gives no number.
    """

    def __init__(self, channels: int, reduction: int = 8) -> None:
        super().__init__()
        hidden = max(4, channels // reduction)
        self.reduce = nn.Conv2d(channels, hidden, kernel_size=1)
        self.expand = nn.Conv2d(hidden, channels, kernel_size=1)

    def forward(self, features: Tensor) -> Tensor:
        """Weights of shape (B, C, 1, 1) for features of shape (B, C, H, W)."""
        pooled = features.mean(dim=(2, 3), keepdim=True)
        return torch.sigmoid(self.expand(torch.relu(self.reduce(pooled))))


class SpatialAttention(nn.Module):
    """One weight in (0, 1) for each pixel: eq. spatial_attention_eqn of the paper.

    1x1 convolution, ReLU, 1x1 convolution, sigmoid. The paper does not say how many maps come
    out; one map shared by all channels is what CBAM has, and keeps the roles of the two
    attentions apart (which channel, which place).

    Args:
        channels: channels C of the features.
        reduction: the hidden layer has C / reduction channels (at least 4).
    """

    def __init__(self, channels: int, reduction: int = 8) -> None:
        super().__init__()
        hidden = max(4, channels // reduction)
        self.reduce = nn.Conv2d(channels, hidden, kernel_size=1)
        self.expand = nn.Conv2d(hidden, 1, kernel_size=1)

    def forward(self, features: Tensor) -> Tensor:
        """Weights of shape (B, 1, H, W) for features of shape (B, C, H, W)."""
        return torch.sigmoid(self.expand(torch.relu(self.reduce(features))))


class AttentionBlock(nn.Module):
    """Channel attention, then spatial attention (eq. ca and sa), with a residual around both.

    The two switches give the four rows of the paper's ablation; with both off the block passes
    its input through unchanged.

    Args:
        channels: channels of the features, in and out.
        channel_attention: apply the channel weights.
        spatial_attention: apply the spatial weights.
    """

    def __init__(
        self, channels: int, channel_attention: bool = True, spatial_attention: bool = True
    ) -> None:
        super().__init__()
        self.channel = ChannelAttention(channels) if channel_attention else None
        self.spatial = SpatialAttention(channels) if spatial_attention else None

    def forward(self, features: Tensor) -> Tensor:
        """Features of the same shape (B, C, H, W)."""
        attended = features
        if self.channel is not None:
            attended = self.channel(attended) * attended
        if self.spatial is not None:
            attended = self.spatial(attended) * attended
        if self.channel is None and self.spatial is None:
            return features
        return features + attended
