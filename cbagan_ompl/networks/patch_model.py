"""The exported form of a generator that reads patches: the same function with less work.

The images that the networks learn with say things more than once: a map in three equal colours,
two spots on a sheet of white, a region of which two colours are the same. Drawing, reading and
painting them is a third of the time of an inference.
"""

from __future__ import annotations

import torch
from torch import Tensor, nn

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
        # The spot of a point touches no more squares than that along a side, and no map has fewer.
        self.window = 3
        self.reach = SPOT_RADIUS + 0.5
        self.map_stem = _of_free_space(generator.map_stem)
        self.point_stem = _of_points(generator.point_stem, generator.noise_stem)
        white = self.point_stem(torch.ones(1, 1, 1, self.point_stem.in_features))
        self.of_white = nn.Parameter(white.detach().permute(0, 3, 1, 2), requires_grad=False)

    def forward(self, free: Tensor, start: Tensor, goal: Tensor) -> Tensor:
        """As :meth:`.region_model.RegionModel.forward`, for sides that the generator takes."""
        of_map = torch.relu(self.map_stem(tiles_of(free, self.patch))).permute(0, 3, 1, 2)
        of_points, ends = self.points(start, goal, of_map.size(2) // 2, of_map.size(3) // 2)
        features = self.generator.features(of_map, of_points, free, ends)
        probability: Tensor = self.generator.region(features, free)
        return probability

    def points(self, start: Tensor, goal: Tensor, height: int, width: int) -> tuple[Tensor, Tensor]:
        """What the point and noise stems make of two points and no noise, and their squares.

        Only windows around both ends are drawn, each with the whole spot of one of them and what
        there is of the other one's.

        Args:
            start: (B, 2), pixel coordinates (u, v).
            goal: (B, 2), the same.
            height: of the map, in squares.
            width: of the map, in squares.

        Returns:
            (B, width of the generator, height, width), and (B, 2, height, width) as
            :func:`.patch_generator.squares`.
        """
        batch, side = start.size(0), self.square * self.window
        size = [batch, self.of_white.size(1), height, width]
        of_points = torch.empty(size, device=start.device, memory_format=torch.channels_last)
        of_points.copy_(self.of_white)
        ends = torch.zeros(batch, 2, height, width, device=start.device)
        # The first square of each window, (column, row).
        corners = ((torch.cat((start, goal)) - self.reach) / self.square).floor().clamp(min=0.0)
        corners[:, 0].clamp_(max=width - self.window)
        corners[:, 1].clamp_(max=height - self.window)
        shift = self.square * corners
        windows = point_image(start.repeat(2, 1) - shift, goal.repeat(2, 1) - shift, side, side)
        of_windows = self.point_stem(tiles_of(windows, self.square)).permute(0, 3, 1, 2)
        spots = squares(windows, self.square)
        places: list[list[int]] = corners.long().tolist()
        for i in range(2 * batch):
            task, end = i % batch, i // batch
            left, top = places[i]
            right, bottom = left + self.window, top + self.window
            of_points[task, :, top:bottom, left:right] = of_windows[i]
            ends[task, end, top:bottom, left:right] = spots[i, end]
        return of_points, ends


def tiles_of(images: Tensor, side: int) -> Tensor:
    """Square tiles of images, with all of their values in one row.

    Args:
        images: (B, C, H, W), H and W multiples of ``side``.
        side: of a tile, in pixels.

    Returns:
        (B, H / side, W / side, C side^2): channel by channel, row by row.
    """
    batch, channels, height, width = images.shape
    split = images.view(batch, channels, height // side, side, width // side, side)
    return split.permute(0, 2, 4, 1, 3, 5).flatten(3)


def _of_free_space(stem: nn.Conv2d) -> nn.Linear:
    """A map stem that reads the pixels of a patch, 1 where free, in place of three colours."""
    assert stem.bias is not None
    return _reading(2 * stem.weight.sum(1), stem.bias - stem.weight.sum((1, 2, 3)))


def _of_points(stem: nn.Conv2d, noise_stem: nn.Conv2d) -> nn.Linear:
    """A point stem that reads tiles, with what the noise stem makes of no noise added."""
    assert stem.bias is not None
    assert noise_stem.bias is not None
    return _reading(stem.weight, stem.bias + noise_stem.bias)


def _reading(weight: Tensor, bias: Tensor) -> nn.Linear:
    """The layer that does to the tiles of :func:`tiles_of` what a convolution does to patches."""
    flat = weight.flatten(1)
    reading = nn.Linear(flat.size(1), flat.size(0))
    with torch.no_grad():
        reading.weight.copy_(flat)
        reading.bias.copy_(bias)
    return reading
