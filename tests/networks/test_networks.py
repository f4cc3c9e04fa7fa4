from __future__ import annotations

import itertools
import subprocess
import sys

import numpy as np
import pytest

torch = pytest.importorskip("torch")

from cbagan_ompl import ConfigError
from cbagan_ompl.networks.attention import (
    CBAM,
    Attention,
    AttentionBlock,
    ChannelAttention,
    SelfAttention,
    SpatialAttention,
)
from cbagan_ompl.networks.discriminator import Discriminator
from cbagan_ompl.networks.encoding import map_image, point_image, region_image, region_probability
from cbagan_ompl.networks.generator import Generator
from cbagan_ompl.training.config import NETWORKS, PRESETS, TrainingConfig
from cbagan_ompl.training.gan import attention_of, make_generator

SWITCHES = list(itertools.product([True, False], repeat=3))


def parameters(module: torch.nn.Module) -> int:
    return sum(parameter.numel() for parameter in module.parameters())


@pytest.mark.parametrize("preset", sorted(PRESETS))
def test_generator_is_smaller_than_the_papers(preset: str) -> None:
    assert parameters(make_generator(PRESETS[preset])) <= 880_000


@pytest.mark.parametrize(
    ("network", "generator", "discriminator"),
    [
        ("cbagan", 807_242, 415_036),
        ("sa", 795_402, 397_780),
        ("ca", 801_475, 406_505),
        ("none", 789_635, 389_249),
        ("sagan", 1_243_348, 471_618),
    ],
)
def test_sizes_of_the_networks(network: str, generator: int, discriminator: int) -> None:
    config = TrainingConfig().with_network(network)
    assert parameters(make_generator(config)) == generator
    assert parameters(Discriminator(attention=attention_of(config))) == discriminator


def test_every_network_is_tested_for_its_size() -> None:
    assert len(NETWORKS) == 5
    with pytest.raises(ConfigError, match=r"'unet'.*cbagan, sa, ca, none, sagan"):
        TrainingConfig().with_network("unet")


@pytest.mark.parametrize("size", [(16, 16), (48, 32)])
def test_generator_keeps_height_and_width(size: tuple[int, int]) -> None:
    generator = Generator((4, 4, 6, 8)).eval()
    image = generator(torch.zeros(2, 3, *size), torch.zeros(2, 3, *size), torch.zeros(2, 1, *size))
    assert image.shape == (2, 3, *size)
    assert image.abs().max() < 1


@pytest.mark.parametrize("switches", SWITCHES)
@pytest.mark.parametrize("network", ["generator", "discriminator"])
def test_kinds_of_attention(network: str, switches: tuple[bool, bool, bool]) -> None:
    kinds = Attention(*switches)
    module = Generator((8, 8, 8, 8), kinds) if network == "generator" else Discriminator(8, kinds)
    names = [name for name, _ in module.named_parameters()]
    for kind, wanted in zip((".channel.", ".spatial.", ".whole."), switches, strict=True):
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
    seen = torch.softmax(query @ key.T / 2**0.5, dim=1) @ value
    added = seen @ layer.expand.weight[:, :, 0, 0].T + layer.expand.bias
    expected = features[1] + 0.7 * added.T.reshape(16, 3, 4)
    torch.testing.assert_close(layer(features)[1], expected)


def test_discriminator_judges_patches() -> None:
    logits = Discriminator(4)(torch.zeros(2, 3, 64, 64), torch.zeros(2, 3, 64, 64))
    assert logits.shape == (2, 1, 7, 7)


def test_region_image_and_probability_are_inverse() -> None:
    region = torch.rand(2, 1, 3, 4)
    torch.testing.assert_close(region_probability(region_image(region)), region)
    green = region_image(torch.ones(1, 1, 1, 1)).flatten().tolist()
    white = region_image(torch.zeros(1, 1, 1, 1)).flatten().tolist()
    assert (green, white) == ([-1, 1, -1], [1, 1, 1])


def test_map_image_is_white_where_free() -> None:
    free = torch.tensor([[[[1.0, 0.0]]]])
    assert map_image(free)[0, :, 0].T.tolist() == [[1, 1, 1], [-1, -1, -1]]


def test_point_image_has_a_blue_start_and_a_red_goal() -> None:
    image = point_image(torch.tensor([[3.5, 2.5]]), torch.tensor([[9.5, 5.5]]), 8, 13)[0]
    assert image.shape == (3, 8, 13)
    assert image[:, 2, 3].tolist() == [-1, -1, 1]
    assert image[:, 5, 9].tolist() == [1, -1, -1]
    assert image[:, 0, 12].tolist() == [1, 1, 1]
    assert (image[0, :, :7] < 0).sum() == 9


def test_spots_move_with_the_fraction_of_a_pixel() -> None:
    goal = torch.tensor([[20.0, 20.0]])
    left, right = (point_image(torch.tensor([[u, 8.0]]), goal, 32, 32) for u in (8.1, 8.4))
    assert not torch.equal(left, right)


def test_the_package_does_not_import_torch() -> None:
    code = (
        "import sys, cbagan_ompl, cbagan_ompl.cli.train, cbagan_ompl.evaluation.metrics;"
        "from cbagan_ompl.inference.predictor import load_model;"
        "sys.exit('torch' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_without_torch_the_message_says_what_to_install(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    from cbagan_ompl import MissingDependencyError
    from cbagan_ompl.inference.predictor import load_model

    monkeypatch.setitem(sys.modules, "torch", None)
    with pytest.raises(MissingDependencyError, match=r"pip install 'cbagan-ompl\[torch\]'"):
        load_model()


def test_encoding_matches_a_slow_reference() -> None:
    start, goal = (5.2, 3.9), (10.0, 9.0)
    image = point_image(torch.tensor([start]), torch.tensor([goal]), 12, 16)[0].numpy()
    for row, column in np.ndindex(12, 16):
        distance = np.hypot(column + 0.5 - start[0], row + 0.5 - start[1])
        assert image[0, row, column] == pytest.approx(
            1 - 2 * np.clip(2.5 - distance, 0, 1), abs=1e-5
        )
