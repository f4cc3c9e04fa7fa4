from __future__ import annotations

import itertools

import pytest

torch = pytest.importorskip("torch")

from cbagan_ompl.networks.attention import (
    CBAM,
    Attention,
    AttentionBlock,
    ChannelAttention,
    SelfAttention,
    SpatialAttention,
)
from cbagan_ompl.networks.discriminator import Discriminator
from cbagan_ompl.networks.generator import Generator

SWITCHES = list(itertools.product([True, False], repeat=3))


@pytest.mark.parametrize("switches", SWITCHES)
@pytest.mark.parametrize("network", ["generator", "discriminator"])
def test_kinds_of_attention(network: str, switches: tuple[bool, bool, bool]) -> None:
    kinds = Attention(*switches)
    module = Generator((8, 8, 8, 8), kinds) if network == "generator" else Discriminator(8, kinds)
    names = [name for name, _ in module.named_parameters()]
    for kind, wanted in zip((".channel.", ".spatial.", ".self_attention."), switches, strict=True):
        assert any(kind in name for name in names) is wanted


def test_attention_follows_the_papers_equations() -> None:
    features = torch.randn(2, 8, 5, 7)
    channel, spatial = ChannelAttention(8), SpatialAttention(8)
    pooled = features.mean((2, 3))
    hidden = torch.relu(pooled @ channel.reduce.weight.T + channel.reduce.bias)
    weights = torch.sigmoid(hidden @ channel.expand.weight.T + channel.expand.bias)
    torch.testing.assert_close(channel(features)[:, :, 0, 0], weights)
    pixel = features[:, :, 3, 4]
    hidden = torch.relu(pixel @ spatial.reduce.weight.T + spatial.reduce.bias)
    weights = torch.sigmoid(hidden @ spatial.expand.weight.T + spatial.expand.bias)
    torch.testing.assert_close(spatial(features)[:, :, 3, 4], weights)


def test_attention_block_is_residual_around_both() -> None:
    features, block = torch.randn(2, 8, 5, 7), AttentionBlock(8, CBAM)
    attended = block.channel(features) * features
    expected = features + block.spatial(attended) * attended
    torch.testing.assert_close(block(features), expected)
    assert AttentionBlock(8, Attention(False, False))(features) is features


def test_self_attention_follows_its_definition() -> None:
    features, layer = torch.randn(2, 16, 3, 4), SelfAttention(16)
    assert torch.equal(layer(features), features), "it starts as the identity"
    torch.nn.init.constant_(layer.factor, 0.7)
    pixels = features[1].flatten(1).T
    projected = pixels @ layer.project.weight[:, :, 0, 0].T + layer.project.bias
    query, key, value = projected[:, :2], projected[:, 2:4], projected[:, 4:]
    attended = torch.softmax(query @ key.T / 2**0.5, dim=1) @ value
    added = attended @ layer.expand.weight[:, :, 0, 0].T + layer.expand.bias
    expected = features[1] + 0.7 * added.T.reshape(16, 3, 4)
    torch.testing.assert_close(layer(features)[1], expected)
