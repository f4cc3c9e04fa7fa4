"""The networks that a configuration asks for, with fresh weights from torch's random numbers."""

from __future__ import annotations

import torch

from ..errors import ConfigError
from .attention import Attention
from .config import MAX_WEIGHTS, NetworkConfig
from .discriminator import Discriminator
from .export_model import AnyGenerator
from .generator import Generator
from .passage_generator import PassageGenerator
from .patch_generator import PatchGenerator


def check_weights(config: NetworkConfig) -> None:
    """Raise if the networks have too many weights, before memory is spent for them.

    Raises:
        ConfigError: the generator and the two discriminators have more than
            :data:`.config.MAX_WEIGHTS`.
    """
    with torch.device("meta"):
        generator, discriminator = make_generator(config), make_discriminator(config)
    count, count_of_discriminator = (
        sum(weight.numel() for weight in network.parameters())
        for network in (generator, discriminator)
    )
    count += 2 * count_of_discriminator
    if count > MAX_WEIGHTS:
        raise ConfigError(
            f"the networks have {count:,} weights, the most is {MAX_WEIGHTS:,}; choose smaller "
            "widths"
        )


def make_generator(config: NetworkConfig) -> AnyGenerator:
    """Return the generator of a configuration.

    Example:
        >>> make_generator(NetworkConfig(patch=4, widths=(8, 8, 16))).stride
        32
    """
    attention = attention_of(config)
    if config.patch == 1:
        return Generator(config.widths, attention, config.stem, config.noise_stem)
    if config.passages:
        return PassageGenerator(config.widths, attention, config.stem, config.white_obstacles)
    return PatchGenerator(
        config.widths,
        attention,
        config.stem,
        config.patch,
        config.cost_maps,
        config.white_obstacles,
    )


def make_discriminator(config: NetworkConfig) -> Discriminator:
    """Return a discriminator of a configuration: the map's and the points' have the same form."""
    return Discriminator(config.discriminator_width, attention_of(config), config.patch)


def attention_of(config: NetworkConfig) -> Attention:
    """Return the kinds of attention that a configuration asks for, in all three networks."""
    return Attention(config.channel_attention, config.spatial_attention, config.self_attention)
