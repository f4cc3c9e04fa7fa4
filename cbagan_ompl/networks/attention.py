"""Channel, spatial and self-attention, and the block that applies those that a network has."""

from __future__ import annotations

from typing import NamedTuple

import torch
from torch import Tensor, nn
from torch.nn import functional


class Attention(NamedTuple):
    """The kinds of attention that a network has.

    Channel and spatial attention make CBAGAN, and leaving out one or both gives the rows of the
    paper's ablation; self-attention alone makes SAGAN.
    """

    channel: bool = True
    spatial: bool = True
    self_attention: bool = False

    def without_self_attention(self) -> Attention:
        """For large features: the cost of self-attention grows with the square of their pixels."""
        return self._replace(self_attention=False)


#: The paper's: channel and spatial attention.
CBAM = Attention()


class ChannelAttention(nn.Module):
    """One weight in (0, 1) for each channel: eq. channel_attention_eqn of the paper.

    Global average pool, 1x1 convolution, ReLU, 1x1 convolution, sigmoid. On a single place a 1x1
    convolution is a linear layer, and faster as one.

    Args:
        channels: channels C of the features.
        reduction: the hidden layer has C / reduction channels (at least 4), as in CBAM; the
            paper gives no number.
    """

    def __init__(self, channels: int, reduction: int = 8) -> None:
        super().__init__()
        hidden = max(4, channels // reduction)
        self.reduce = nn.Linear(channels, hidden)
        self.expand = nn.Linear(hidden, channels)

    def forward(self, features: Tensor) -> Tensor:
        """Weights of shape (B, C, 1, 1) for features of shape (B, C, H, W)."""
        pooled = features.mean(dim=(2, 3))
        return torch.sigmoid(self.expand(torch.relu(self.reduce(pooled))))[:, :, None, None]


class SpatialAttention(nn.Module):
    """One weight in (0, 1) for each pixel: eq. spatial_attention_eqn of the paper.

    1x1 convolution, ReLU, 1x1 convolution, sigmoid; a 1x1 convolution is a linear layer at every
    place, and faster as one. The paper does not say how many maps come out; one map shared by all
    channels is what CBAM has, and keeps the roles of the two attentions apart (which channel,
    which place).

    Args:
        channels: channels C of the features.
        reduction: the hidden layer has C / reduction channels (at least 4).
    """

    def __init__(self, channels: int, reduction: int = 8) -> None:
        super().__init__()
        hidden = max(4, channels // reduction)
        self.reduce = nn.Linear(channels, hidden)
        self.expand = nn.Linear(hidden, 1)

    def forward(self, features: Tensor) -> Tensor:
        """Weights of shape (B, 1, H, W) for features of shape (B, C, H, W)."""
        places = features.permute(0, 2, 3, 1)
        return torch.sigmoid(self.expand(torch.relu(self.reduce(places)))).permute(0, 3, 1, 2)


class SelfAttention(nn.Module):
    """Every pixel looks at every other: the layer of SAGAN (Zhang et al., 2019).

    Queries and keys have C / 8 channels, values C / 2, all by 1x1 convolutions. The result is
    added to the features with a learned factor that starts at 0. Scores are divided by the root
    of the number of channels, which SAGAN leaves out.

    Args:
        channels: channels C of the features.
    """

    def __init__(self, channels: int) -> None:
        super().__init__()
        self.sizes = [channels // 8, channels // 8, channels // 2]
        self.project = nn.Conv2d(channels, sum(self.sizes), kernel_size=1)
        self.expand = nn.Conv2d(self.sizes[2], channels, kernel_size=1)
        self.factor = nn.Parameter(torch.zeros(()))

    def forward(self, features: Tensor) -> Tensor:
        """Features of the same shape (B, C, H, W)."""
        batch, channels, height, width = features.shape
        pixels = self.project(features).flatten(2).transpose(1, 2)
        query, key, value = pixels.split(self.sizes, dim=2)
        seen = functional.scaled_dot_product_attention(query, key, value).transpose(1, 2)
        added: Tensor = self.expand(seen.reshape(batch, channels // 2, height, width))
        return features + self.factor * added


class AttentionBlock(nn.Module):
    """Channel attention, then spatial attention (eq. ca and sa), with a residual around both.

    A network with self-attention applies it first. Without any attention the block passes its
    input through unchanged.

    Args:
        channels: channels of the features, in and out.
        attention: the kinds to apply.
    """

    def __init__(self, channels: int, attention: Attention) -> None:
        super().__init__()
        self.whole = SelfAttention(channels) if attention.self_attention else None
        self.channel = ChannelAttention(channels) if attention.channel else None
        self.spatial = SpatialAttention(channels) if attention.spatial else None

    def forward(self, features: Tensor) -> Tensor:
        """Features of the same shape (B, C, H, W)."""
        if self.whole is not None:
            features = self.whole(features)
        attended = features
        if self.channel is not None:
            attended = self.channel(attended) * attended
        if self.spatial is not None:
            attended = self.spatial(attended) * attended
        if self.channel is None and self.spatial is None:
            return features
        return features + attended
