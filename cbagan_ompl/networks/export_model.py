"""What an exported file computes: from a map of any size to the probability of the region."""

from __future__ import annotations

import torch
from torch import Tensor, nn
from torch.nn import functional

from .encoding import SPOT_RADIUS, map_image, point_image, region_probability
from .generator import Generator
from .passage_generator import PassageGenerator
from .passages import endpoint_nodes
from .patch_generator import PatchGenerator, endpoint_cells

#: The generators.
AnyGenerator = Generator | PatchGenerator | PassageGenerator


class RegionModel(nn.Module):
    """Encoding, generator and decoding in one module.

    The noise is 0, the mean of the noise in training, so that equal inputs give equal outputs.

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
        """Return the probability of the region, (B, 1, H, W) in [0, 1], for any height and width.

        Args:
            free: (B, 1, H, W) in [0, 1], 1 where free.
            start: (B, 2), pixel coordinates (u, v), u right and v down.
            goal: (B, 2), the same.
        """
        height, width = free.size(2), free.size(3)
        # Blocked pixels pad to the stride and are cut off again.
        probability: Tensor = self.model(pad_to_stride(free, self.stride), start, goal)
        return probability[:, :, :height, :width]


class PassageModel(nn.Module):
    """A :class:`PassageGenerator` without its images, in parts that can be called by themselves.

    What :meth:`encode` returns depends on the map alone, and :meth:`distances` has no weights: a
    caller may keep the one and compute the other by compiled code
    (:mod:`cbagan_ompl.networks.fast_marching`).

    Args:
        generator: with its trained weights, in evaluation mode.
    """

    def __init__(self, generator: PassageGenerator) -> None:
        super().__init__()
        self.generator = generator
        self.stride = generator.stride
        self.map_stem = _make_free_stem(generator.map_stem)
        no_noise = generator.noise_stem(torch.zeros(1, 1, generator.cell, generator.cell))
        self.no_noise = nn.Parameter(no_noise.detach(), requires_grad=False)

    def forward(self, free: Tensor, start: Tensor, goal: Tensor) -> Tensor:
        """Return the probability of the region, as :meth:`RegionModel.forward`."""
        features, costs, codes = self.encode(free)
        distances, towards = self.distances(costs, codes, start, goal)
        return self.paint(features, costs, codes, distances, towards, free)[0]

    @torch.jit.export
    def encode(self, free: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """Return features, costs and codes of the patches of a map.

        Args:
            free: (B, 1, H, W) in [0, 1], 1 where free, of any size.

        Returns:
            (B, stem, h, w), (B, 3, h, w) and (B, 3, h, w) int32, see :class:`PassageGenerator`; of
            h x w patches, in which the map is padded to the stride.
        """
        free = pad_to_stride(free, self.stride)
        map_features = torch.relu(self.map_stem(tiles_of(free, 4))).permute(0, 3, 1, 2)
        features, costs = self.generator.encode(map_features, self.no_noise)
        return features, costs, self.generator.codes(free)

    @torch.jit.export
    def distances(
        self, costs: Tensor, codes: Tensor, start: Tensor, goal: Tensor
    ) -> tuple[Tensor, Tensor]:
        """Return the distances from start and goal, and the directions in which they fall.

        See :mod:`.passages`: (B, 2, 3, h, w) and (B, 2, 2, 3, h, w).

        Args:
            costs: from :meth:`encode`.
            codes: the same.
            start: (B, 2), pixel coordinates (u, v).
            goal: (B, 2), the same.
        """
        nodes = endpoint_nodes(start, codes), endpoint_nodes(goal, codes)
        return self.generator.distances(costs, codes, nodes[0], nodes[1])

    @torch.jit.export
    def paint(
        self,
        features: Tensor,
        costs: Tensor,
        codes: Tensor,
        distances: Tensor,
        towards: Tensor,
        free: Tensor,
    ) -> tuple[Tensor, Tensor]:
        """Return the probability of the region, and the directions of travel.

        Args:
            features: from :meth:`encode`.
            costs: the same.
            codes: the same.
            distances: from :meth:`distances`.
            towards: the same.
            free: (B, 1, H, W), as for :meth:`encode`.

        Returns:
            (B, 1, H, W) in [0, 1], and (B, 2, h, w): unit vectors (u, v), v down, of each patch; 0
            where no path leads.
        """
        height, width = free.size(2), free.size(3)
        region, direction = self.generator.paint(
            features, costs, codes, distances, towards, pad_to_stride(free, self.stride)
        )
        return region[:, :, :height, :width], direction


def export_module(generator: AnyGenerator) -> RegionModel | PassageModel:
    """Return the module that an exported file holds.

    Args:
        generator: with its trained weights, in evaluation mode.
    """
    if isinstance(generator, PassageGenerator):
        return PassageModel(generator)
    return RegionModel(generator)


def pad_to_stride(free: Tensor, stride: int) -> Tensor:
    """Return maps with blocked pixels to the right and below, up to multiples of a stride."""
    right, below = -free.size(3) % stride, -free.size(2) % stride
    if right > 0 or below > 0:
        return functional.pad(free, [0, right, 0, below])
    return free


class ImageModel(nn.Module):
    """A generator with the images that it was trained with, for sizes that it takes.

    Args:
        generator: with its trained weights, in evaluation mode.
    """

    def __init__(self, generator: Generator | PatchGenerator) -> None:
        super().__init__()
        self.generator = generator

    def forward(self, free: Tensor, start: Tensor, goal: Tensor) -> Tensor:
        """Return the probability of the region, as :meth:`RegionModel.forward`."""
        points = point_image(start, goal, free.size(2), free.size(3))
        image = self.generator(map_image(free), points, torch.zeros_like(free))
        return region_probability(image)


class PatchModel(nn.Module):
    """A generator that reads patches: the result of :class:`ImageModel`, with less work.

    The images that the networks are trained with are redundant: a map in three equal colours, two
    spots on a white image, a region of which two colours are the same. To make, read and decode
    them is a third of the time of an inference. Equal to :class:`ImageModel` but for rounding.

    Args:
        generator: with its trained weights, in evaluation mode.
    """

    def __init__(self, generator: PatchGenerator) -> None:
        super().__init__()
        self.generator = generator
        self.patch, self.cell = generator.patch, generator.cell
        # The spot of a point touches no more cells than that in a row, and no map has fewer.
        self.window = 3
        self.reach = SPOT_RADIUS + 0.5
        self.map_stem = _make_free_stem(generator.map_stem)
        self.point_stem = _make_point_stem(generator.point_stem, generator.noise_stem)
        white = self.point_stem(torch.ones(1, 1, 1, self.point_stem.in_features))
        self.white_features = nn.Parameter(white.detach().permute(0, 3, 1, 2), requires_grad=False)

    def forward(self, free: Tensor, start: Tensor, goal: Tensor) -> Tensor:
        """Return the probability of the region, as :meth:`RegionModel.forward`."""
        map_features = torch.relu(self.map_stem(tiles_of(free, self.patch))).permute(0, 3, 1, 2)
        point_features, endpoints = self.points(
            start, goal, map_features.size(2) // 2, map_features.size(3) // 2
        )
        features = self.generator.features(map_features, point_features, free, endpoints)
        probability: Tensor = self.generator.region(features, free)
        return probability

    def points(self, start: Tensor, goal: Tensor, height: int, width: int) -> tuple[Tensor, Tensor]:
        """Return the features of two points without noise, and the cells of the points.

        Only windows around both endpoints are made as images, each with the whole spot of one
        endpoint and the part of the other one's that lies in it.

        Args:
            start: (B, 2), pixel coordinates (u, v).
            goal: (B, 2), the same.
            height: of the map, in cells.
            width: of the map, in cells.

        Returns:
            (B, width of the generator, height, width), and (B, 2, height, width) as
            :func:`.patch_generator.endpoint_cells`.
        """
        batch, side = start.size(0), self.cell * self.window
        size = [batch, self.white_features.size(1), height, width]
        features = torch.empty(size, device=start.device, memory_format=torch.channels_last)
        features.copy_(self.white_features)
        cells = torch.zeros(batch, 2, height, width, device=start.device)
        # The first cell of each window, (column, row).
        corners = ((torch.cat((start, goal)) - self.reach) / self.cell).floor().clamp(min=0.0)
        corners[:, 0].clamp_(max=width - self.window)
        corners[:, 1].clamp_(max=height - self.window)
        shift = self.cell * corners
        windows = point_image(start.repeat(2, 1) - shift, goal.repeat(2, 1) - shift, side, side)
        window_features = self.point_stem(tiles_of(windows, self.cell)).permute(0, 3, 1, 2)
        window_cells = endpoint_cells(windows, self.cell)
        first_cells: list[list[int]] = corners.long().tolist()
        for i in range(2 * batch):
            task, endpoint = i % batch, i // batch
            left, top = first_cells[i]
            right, bottom = left + self.window, top + self.window
            features[task, :, top:bottom, left:right] = window_features[i]
            cells[task, endpoint, top:bottom, left:right] = window_cells[i, endpoint]
        return features, cells


def tiles_of(images: Tensor, size: int) -> Tensor:
    """Return the square tiles of images, with all values of a tile in one row.

    Args:
        images: (B, C, H, W), H and W multiples of ``size``.
        size: of a tile, in pixels.

    Returns:
        (B, H / size, W / size, C size^2): channel by channel, row by row.
    """
    batch, channels, height, width = images.shape
    split = images.view(batch, channels, height // size, size, width // size, size)
    return split.permute(0, 2, 4, 1, 3, 5).flatten(3)


def _make_free_stem(stem: nn.Conv2d) -> nn.Linear:
    """Return a map stem that reads the pixels of a patch, 1 where free, not three colours."""
    assert stem.bias is not None
    return _make_linear(2 * stem.weight.sum(1), stem.bias - stem.weight.sum((1, 2, 3)))


def _make_point_stem(stem: nn.Conv2d, noise_stem: nn.Conv2d) -> nn.Linear:
    """Return a point stem that reads tiles, with the output of the noise stem for no noise."""
    assert stem.bias is not None
    assert noise_stem.bias is not None
    return _make_linear(stem.weight, stem.bias + noise_stem.bias)


def _make_linear(weight: Tensor, bias: Tensor) -> nn.Linear:
    """Return the layer that does to the tiles of :func:`tiles_of` what a convolution does."""
    flat = weight.flatten(1)
    linear = nn.Linear(flat.size(1), flat.size(0))
    with torch.no_grad():
        linear.weight.copy_(flat)
        linear.bias.copy_(bias)
    return linear
