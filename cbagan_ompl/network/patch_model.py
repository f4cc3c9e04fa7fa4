"""The exported form of a generator that reads patches: the same function with less work.

The images that the networks learn with say things more than once: a map in three equal colours,
two spots on a sheet of white, a region of which two colours are the same. Drawing, reading and
painting them is a third of the time of an inference.
"""

from __future__ import annotations

import torch
from torch import Tensor, nn

from .encoding import SPOT_RADIUS, point_image
from .generator import Generator, places


class PatchModel(nn.Module):
    """What :class:`.region_model.ImageModel` says, to within rounding.

    Args:
        generator: with its trained weights, in evaluation mode; its patch is above 1.
    """

    def __init__(self, generator: Generator) -> None:
        super().__init__()
        self.generator = generator
        self.patch = generator.patch
        self.place = 2 * generator.patch
        # The spot of a point touches no more places than that along a side.
        self.window = 3
        self.reach = SPOT_RADIUS + 0.5
        self.map_stem = _of_free_space(generator.map_stem)
        self.head = _of_red_and_blue(generator.head)
        self.of_white = _answer(generator.point_stem, torch.ones(1, 3, self.patch, self.patch))
        self.of_silence = _answer(generator.noise_stem, torch.zeros(1, 1, self.patch, self.patch))

    def forward(self, free: Tensor, start: Tensor, goal: Tensor) -> Tensor:
        """As :meth:`.region_model.RegionModel.forward`, for sides that the generator takes."""
        batch, height, width = free.size(0), free.size(2) // self.patch, free.size(3) // self.patch
        tiles = free.view(batch, height, self.patch, width, self.patch).transpose(2, 3)
        of_map = torch.relu(self.map_stem(tiles.flatten(3))).permute(0, 3, 1, 2)
        of_points = torch.empty_like(of_map).copy_(self.of_white)
        ends = torch.zeros(batch, 2, height // 2, width // 2, device=free.device)
        farthest = torch.tensor([width // 2, height // 2], device=free.device) - self.window
        for end, point in enumerate([start, goal]):
            # The whole of a spot, and what a window next to it has of the other one.
            corner = ((point - self.reach) / self.place).floor().clamp(min=0.0)
            corner = torch.minimum(corner, farthest)
            shift, size = self.place * corner, self.place * self.window
            window = point_image(start - shift, goal - shift, size, size)
            paste(torch.relu(self.generator.point_stem(window)), of_points, 2 * corner)
            paste(places(window, self.place)[:, end : end + 1], ends[:, end : end + 1], corner)
        of_noise = self.of_silence.expand(batch, -1, height, width)
        of_noise = of_noise.contiguous(memory_format=torch.channels_last)
        features = self.generator.features(of_map, of_points, of_noise, ends)
        red, blue = torch.tanh(self.head(features.permute(0, 2, 3, 1))).chunk(2, 3)
        tiles = (0.5 - 0.25 * (red + blue)).view(batch, height, width, self.patch, self.patch)
        probability = tiles.transpose(2, 3).reshape(free.size())
        if self.generator.white_obstacles:
            probability = probability * (free + 0.5).floor()
        return probability


def paste(windows: Tensor, images: Tensor, corners: Tensor) -> None:
    """Write a window into each image.

    Args:
        windows: (B, C, h, w).
        images: (B, C, H, W), changed.
        corners: (B, 2), column and row of the upper left corner in the image, whole numbers.
    """
    height, width = windows.size(2), windows.size(3)
    for i in range(windows.size(0)):
        column, row = int(corners[i, 0]), int(corners[i, 1])
        images[i, :, row : row + height, column : column + width] = windows[i]


def _answer(stem: nn.Conv2d, patch: Tensor) -> nn.Parameter:
    with torch.no_grad():
        return nn.Parameter(torch.relu(stem(patch)), requires_grad=False)


def _of_free_space(stem: nn.Conv2d) -> nn.Linear:
    """A map stem that reads the pixels of a patch, 1 where free, in place of three colours."""
    assert stem.bias is not None
    reading = nn.Linear(stem.kernel_size[0] ** 2, stem.out_channels)
    with torch.no_grad():
        reading.weight.copy_(2 * stem.weight.sum(1).flatten(1))
        reading.bias.copy_(stem.bias - stem.weight.sum((1, 2, 3)))
    return reading


def _of_red_and_blue(head: nn.Conv2d) -> nn.Linear:
    """A last layer that leaves out green, which is 1 inside and outside of the region."""
    assert head.bias is not None
    painting = nn.Linear(head.in_channels, head.out_channels // 3 * 2)
    with torch.no_grad():
        for of_two, of_three in ((painting.weight, head.weight), (painting.bias, head.bias)):
            red, _, blue = of_three.chunk(3)
            of_two.copy_(torch.cat((red, blue)).view(of_two.shape))
    return painting
