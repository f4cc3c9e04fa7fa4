from __future__ import annotations

import pytest

torch = pytest.importorskip("torch")

from cbagan_ompl.networks.config import NETWORKS, NetworkConfig
from cbagan_ompl.networks.factory import make_discriminator, make_generator
from cbagan_ompl.networks.generator import Generator
from cbagan_ompl.training.config import PRESETS

SIZES = [
    ("cbagan", 807_242, 415_036),
    ("sa", 795_402, 397_780),
    ("ca", 801_475, 406_505),
    ("none", 789_635, 389_249),
    ("sagan", 1_243_348, 471_618),
]


def parameters(module: torch.nn.Module) -> int:
    return sum(parameter.numel() for parameter in module.parameters())


@pytest.mark.parametrize("preset", sorted(PRESETS))
def test_generator_is_smaller_than_the_papers(preset: str) -> None:
    assert parameters(make_generator(PRESETS[preset].network)) <= 880_000


@pytest.mark.parametrize(("network", "generator", "discriminator"), SIZES)
def test_sizes_of_the_networks(network: str, generator: int, discriminator: int) -> None:
    config = NetworkConfig().variant(network)
    assert parameters(make_generator(config)) == generator
    assert parameters(make_discriminator(config)) == discriminator


def test_every_network_is_tested_for_its_size() -> None:
    assert [name for name, *_ in SIZES] == list(NETWORKS)


def test_the_default_options_are_the_papers_generator() -> None:
    model = make_generator(NetworkConfig())
    assert isinstance(model, Generator)
    assert model.map_stem.kernel_size == (3, 3)
