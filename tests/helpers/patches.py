"""Generators that read patches, and maps for them."""

from __future__ import annotations

import torch

from cbagan_ompl.networks.config import NetworkConfig
from cbagan_ompl.networks.factory import make_generator
from cbagan_ompl.networks.patch_generator import PatchGenerator

CONFIG = NetworkConfig(
    widths=(8, 8, 12, 16),
    stem=12,
    patch=4,
    cost_maps=3,
    white_obstacles=True,
    discriminator_width=4,
)


def generator(**options: object) -> PatchGenerator:
    """A generator in evaluation mode, with the same weights each time."""
    torch.manual_seed(0)
    made = make_generator(CONFIG.updated(options)).eval()
    assert isinstance(made, PatchGenerator)
    return made


def clutter(*shape: int) -> torch.Tensor:
    """A random map, 1 where free."""
    return (torch.rand(shape, generator=torch.Generator().manual_seed(1)) > 0.2).float()
