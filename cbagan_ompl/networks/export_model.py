"""What an exported file computes: from a map of any size to the probability of the region."""

from __future__ import annotations

import torch
from torch import Tensor, nn
from torch.nn import functional

from .encoding import map_image, point_image, region_probability
from .generator import Generator
from .patch_generator import PatchGenerator
from .patch_model import PatchModel


class RegionModel(nn.Module):
    """Encoding, generator and decoding in one module.

    The noise is 0, the centre of what training drew, so that equal inputs give equal outputs.

    Args:
        generator: with its trained weights, in evaluation mode.
    """

    def __init__(self, generator: Generator | PatchGenerator) -> None:
        super().__init__()
        self.stride = generator.stride
        if isinstance(generator, PatchGenerator):
            self.model: nn.Module = PatchModel(generator)
        else:
            self.model = ImageModel(generator)

    def forward(self, free: Tensor, start: Tensor, goal: Tensor) -> Tensor:
        """Probability of the region, (B, 1, H, W) in [0, 1], for any height and width.

        Args:
            free: (B, 1, H, W) in [0, 1], 1 where free.
            start: (B, 2), pixel coordinates (u, v).
            goal: (B, 2), the same.
        """
        height, width = free.size(2), free.size(3)
        # Blocked pixels to the right and below fill up to the strides and are cut off again.
        right, below = -width % self.stride, -height % self.stride
        if right > 0 or below > 0:
            free = functional.pad(free, [0, right, 0, below])
        probability: Tensor = self.model(free, start, goal)
        return probability[:, :, :height, :width]


class ImageModel(nn.Module):
    """A generator with the images that it learned with, for sides that it takes.

    Args:
        generator: with its trained weights, in evaluation mode.
    """

    def __init__(self, generator: Generator | PatchGenerator) -> None:
        super().__init__()
        self.generator = generator

    def forward(self, free: Tensor, start: Tensor, goal: Tensor) -> Tensor:
        """As :meth:`RegionModel.forward`."""
        points = point_image(start, goal, free.size(2), free.size(3))
        image = self.generator(map_image(free), points, torch.zeros_like(free))
        return region_probability(image)
