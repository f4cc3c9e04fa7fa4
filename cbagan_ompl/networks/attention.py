"""Channel, spatial and self-attention, and the block that applies those that a network has.

Channel and spatial attention are those of CBAM (Woo et al., "CBAM: Convolutional block attention
module", 2018, https://arxiv.org/abs/1807.06521) in the form of the CBAGAN-RRT paper
(https://arxiv.org/abs/2305.10442). Self-attention is the layer of SAGAN (Zhang et al.,
"Self-attention generative adversarial networks", 2019, https://arxiv.org/abs/1805.08318).
"""

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
        """Return the other kinds, for large features.

        The cost of self-attention grows with the square of the number of pixels.
        """
        return self._replace(self_attention=False)


#: The paper's: channel and spatial attention.
CBAM = Attention()


class ChannelAttention(nn.Module):
    """One weight in (0, 1) for each channel.

    With the average A(F) of the features F over all pixels and two 1x1 convolutions W1 and W2,
    the weights are f_CA(F) = sigmoid(W2 relu(W1 A(F))). On a single pixel a 1x1 convolution is a
    linear layer, and faster as one.

    Args:
        channels: channels C of the features.
        reduction: the hidden layer has C / reduction channels (at least 4), as in CBAM; the
            CBAGAN-RRT paper gives no number.
    """

    def __init__(self, channels: int, reduction: int = 8) -> None:
        super().__init__()
        hidden = max(4, channels // reduction)
        self.reduce = nn.Linear(channels, hidden)
        self.expand = nn.Linear(hidden, channels)

    def forward(self, features: Tensor) -> Tensor:
        """Return weights of shape (B, C, 1, 1) for features of shape (B, C, H, W)."""
        pooled = features.mean(dim=(2, 3))
        return torch.sigmoid(self.expand(torch.relu(self.reduce(pooled))))[:, :, None, None]


class SpatialAttention(nn.Module):
    """One weight in (0, 1) for each pixel.

    With two 1x1 convolutions W1 and W2 the weights are f_SA(F) = sigmoid(W2 relu(W1 F)). A 1x1
    convolution is a linear layer at every pixel, and faster as one. The CBAGAN-RRT paper does not
    say how many channels W2 has; one weight for all channels is what CBAM has, and keeps the roles
    of the two attentions apart (which channel, which pixel).

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
        """Return weights of shape (B, 1, H, W) for features of shape (B, C, H, W)."""
        pixels = features.permute(0, 2, 3, 1)
        return torch.sigmoid(self.expand(torch.relu(self.reduce(pixels)))).permute(0, 3, 1, 2)


class SelfAttention(nn.Module):
    """Self-attention as in SAGAN: the features of each pixel depend on those of every other one.

    For pixels x with queries Q, keys K (C / 8 channels each) and values V (C / 2 channels), all
    by 1x1 convolutions, the output is x + factor * W(softmax(Q K^T / sqrt(C / 8)) V). The learned
    factor starts at 0. SAGAN does not divide the scores by the root of the number of channels.

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
        """Return features of the same shape (B, C, H, W)."""
        batch, channels, height, width = features.shape
        pixels = self.project(features).flatten(2).transpose(1, 2)
        query, key, value = pixels.split(self.sizes, dim=2)
        attended = functional.scaled_dot_product_attention(query, key, value).transpose(1, 2)
        added: Tensor = self.expand(attended.reshape(batch, channels // 2, height, width))
        return features + self.factor * added


class AttentionBlock(nn.Module):
    """Channel attention, then spatial attention, with a residual connection around both.

    For features F the output is F + F_o with F_c = f_CA(F) * F and F_o = f_SA(F_c) * F_c. A
    network with self-attention applies it first. Without any attention the block passes its input
    through unchanged.

    Args:
        channels: channels of the features, in and out.
        attention: the kinds to apply.
    """

    def __init__(self, channels: int, attention: Attention) -> None:
        super().__init__()
        self.self_attention = SelfAttention(channels) if attention.self_attention else None
        self.channel = ChannelAttention(channels) if attention.channel else None
        self.spatial = SpatialAttention(channels) if attention.spatial else None

    def forward(self, features: Tensor) -> Tensor:
        """Return features of the same shape (B, C, H, W)."""
        if self.self_attention is not None:
            features = self.self_attention(features)
        attended = features
        if self.channel is not None:
            attended = self.channel(attended) * attended
        if self.spatial is not None:
            attended = self.spatial(attended) * attended
        if self.channel is None and self.spatial is None:
            return features
        return features + attended
