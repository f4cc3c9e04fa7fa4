"""The exported form of a generator that reads patches: the same function with less work.

The images that the networks learn with say things more than once: a map in three equal colours,
two spots on a sheet of white, a region of which two colours are the same. Drawing, reading and
painting them is a third of the time of an inference.
"""

from __future__ import annotations

import torch
from torch import Tensor, nn
from torch.nn import functional

from .encoding import SPOT_RADIUS, point_image
from .patch_generator import PatchGenerator, squares


class PatchModel(nn.Module):
    """What :class:`.region_model.ImageModel` says, to within rounding.

    Args:
        generator: with its trained weights, in evaluation mode.
    """

    def __init__(self, generator: PatchGenerator) -> None:
        super().__init__()
        self.generator = generator
        self.patch, self.square = generator.patch, generator.square
        # The spot of a point touches no more squares than that along a side.
        self.window = 3
        self.reach = SPOT_RADIUS + 0.5
        self.map_stem = _of_free_space(generator.map_stem)
        with torch.no_grad():
            white = generator.point_stem(torch.ones(1, 3, self.square, self.square))
            silence = generator.noise_stem(torch.zeros(1, 1, self.square, self.square))
        self.of_silence = nn.Parameter(silence, requires_grad=False)
        self.of_white = nn.Parameter(white + silence, requires_grad=False)

    def forward(self, free: Tensor, start: Tensor, goal: Tensor) -> Tensor:
        """As :meth:`.region_model.RegionModel.forward`, for sides that the generator takes."""
        batch, height, width = free.size(0), free.size(2) // self.patch, free.size(3) // self.patch
        tiles = free.view(batch, height, self.patch, width, self.patch).transpose(2, 3)
        of_map = torch.relu(self.map_stem(tiles.flatten(3))).permute(0, 3, 1, 2)
        size = [batch, self.of_white.size(1), height // 2, width // 2]
        of_points = torch.empty(size, device=free.device, memory_format=torch.channels_last)
        of_points.copy_(self.of_white)
        ends = torch.zeros(batch, 2, height // 2, width // 2, device=free.device)
        # Windows around both ends, with the whole spot of one and what there is of the other.
        points, side = torch.cat((start, goal)), self.square * self.window
        farthest = torch.tensor([width // 2, height // 2], device=free.device) - self.window
        corners = ((points - self.reach) / self.square).floor().clamp(min=0.0)
        corners = torch.minimum(corners, farthest)
        shift = self.square * corners
        windows = point_image(start.repeat(2, 1) - shift, goal.repeat(2, 1) - shift, side, side)
        of_windows = (self.generator.point_stem(windows) + self.of_silence).chunk(2)
        spots = squares(windows, self.square)
        for end, corner in enumerate(corners.chunk(2)):
            paste(of_windows[end], of_points, corner)
            spot = spots[end * batch : (end + 1) * batch, end : end + 1]
            paste(spot, ends[:, end : end + 1], corner)
        blocked = 1 - functional.avg_pool2d(free, self.square)
        features = self.generator.features(of_map, of_points, blocked, ends)
        probability: Tensor = self.generator.region(features, free)
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


def _of_free_space(stem: nn.Conv2d) -> nn.Linear:
    """A map stem that reads the pixels of a patch, 1 where free, in place of three colours."""
    assert stem.bias is not None
    reading = nn.Linear(stem.kernel_size[0] ** 2, stem.out_channels)
    with torch.no_grad():
        reading.weight.copy_(2 * stem.weight.sum(1).flatten(1))
        reading.bias.copy_(stem.bias - stem.weight.sum((1, 2, 3)))
    return reading
