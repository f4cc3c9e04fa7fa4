"""What an exported file computes: from a map of any size to the probability of the region."""

from __future__ import annotations

import torch
from torch import Tensor, nn

from .encoding import SPOT_RADIUS, map_image, point_image, region_probability
from .generator import Generator
from .passage_generator import PassageGenerator
from .passage_model import PassageModel
from .patch_generator import PatchGenerator, endpoint_cells
from .tiles import make_free_stem, make_linear, pad_to_stride, tiles_of

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
        probability: Tensor = self.model(self.padded(free), start, goal)
        return probability[:, :, :height, :width]

    def padded(self, free: Tensor) -> Tensor:
        """Return a map with blocked pixels to the right and below, up to the stride."""
        return pad_to_stride(free, self.stride)


class SplitModel(RegionModel):
    """A region model with a wavefront, whose parts can be called one by one.

    So a program can keep what depends on the map alone for its next task, and compute the distance
    fields in a quicker way than TorchScript: the exported file has these methods as well as
    :meth:`forward`, which computes the same.
    """

    @torch.jit.export
    def read_map(self, free: Tensor) -> list[Tensor]:
        """Return what depends on the map alone, for :meth:`encode` and :meth:`paint`.

        Args:
            free: (1, 1, H, W) in [0, 1], 1 where free.
        """
        kept: list[Tensor] = self.model.read_map(self.padded(free))  # type: ignore[operator]
        return kept

    @torch.jit.export
    def encode(self, kept: list[Tensor], start: Tensor, goal: Tensor) -> list[Tensor]:
        """Return what the distance fields are computed from.

        Args:
            kept: from :meth:`read_map`.
            start: (B, 2), as for :meth:`forward`.
            goal: (B, 2), the same.

        Returns:
            The costs of the steps between cells, (4, h, w, K), as :func:`.wavefront.step_costs`
            takes them; the cells of the endpoints, (B, 2, h, w), positive there; and features for
            :meth:`paint`.
        """
        encoded: list[Tensor] = self.model.encode(kept, start, goal)  # type: ignore[operator]
        return encoded

    @torch.jit.export
    def paint(self, kept: list[Tensor], features: Tensor, distances: Tensor) -> Tensor:
        """Return the probability of the region, of the map as it is padded to the stride.

        Args:
            kept: from :meth:`read_map`.
            features: from :meth:`encode`.
            distances: (2, h, w, K), from the start and from the goal.
        """
        probability: Tensor = self.model.paint(kept, features, distances)  # type: ignore[operator]
        return probability


def make_region_model(generator: AnyGenerator) -> RegionModel | PassageModel:
    """Return what is exported of a generator with its trained weights, in evaluation mode."""
    if isinstance(generator, PassageGenerator):
        return PassageModel(generator).eval()
    is_split = isinstance(generator, PatchGenerator) and generator.wavefront is not None
    return (SplitModel if is_split else RegionModel)(generator).eval()


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
        self.map_stem = make_free_stem(generator.map_stem)
        self.point_stem = _make_point_stem(generator.point_stem, generator.noise_stem)
        white = self.point_stem(torch.ones(1, 1, 1, self.point_stem.in_features))
        self.white_features = nn.Parameter(white.detach().permute(0, 3, 1, 2), requires_grad=False)

    def forward(self, free: Tensor, start: Tensor, goal: Tensor) -> Tensor:
        """Return the probability of the region, as :meth:`RegionModel.forward`."""
        map_features = self.map_features(free)
        point_features, endpoints = self.points(start, goal, map_features)
        features = self.generator.features(map_features, point_features, free, endpoints)
        probability: Tensor = self.generator.region(features, free)
        return probability

    def map_features(self, free: Tensor) -> Tensor:
        """Return the features of the patches of a map, (B, stem, h, w)."""
        return torch.relu(self.map_stem(tiles_of(free, self.patch))).permute(0, 3, 1, 2)

    def read_map(self, free: Tensor) -> list[Tensor]:
        """Return what depends on the map alone, see :meth:`SplitModel.read_map`."""
        map_features = self.map_features(free)
        return [
            map_features,
            self.generator.merge(map_features),
            self.generator.blocked(free),
            free,
        ]

    def encode(self, kept: list[Tensor], start: Tensor, goal: Tensor) -> list[Tensor]:
        """Return what is computed before the distance fields, see :meth:`SplitModel.encode`."""
        assert self.generator.wavefront is not None
        point_features, endpoints = self.points(start, goal, kept[0])
        features = self.generator.cell_features(kept[1] + point_features)
        edges = self.generator.wavefront.edge_costs(features, kept[2])
        return [edges, endpoints, features]

    def paint(self, kept: list[Tensor], features: Tensor, distances: Tensor) -> Tensor:
        """Return what is computed after the distance fields, see :meth:`SplitModel.paint`."""
        assert self.generator.wavefront is not None
        closeness = self.generator.wavefront.closeness(distances, features.size(0))
        patches = self.generator.patch_features(features, closeness, kept[0])
        probability: Tensor = self.generator.region(patches, kept[3])
        return probability

    def points(self, start: Tensor, goal: Tensor, map_features: Tensor) -> tuple[Tensor, Tensor]:
        """Return the features of two points without noise, and the cells of the points.

        Only windows around both endpoints are made as images, each with the whole spot of one
        endpoint and the part of the other one's that lies in it.

        Args:
            start: (B, 2), pixel coordinates (u, v).
            goal: (B, 2), the same.
            map_features: of the patches, (B, stem, 2 h, 2 w), for the size of the map.

        Returns:
            (B, width of the generator, h, w), and (B, 2, h, w) as
            :func:`.patch_generator.endpoint_cells`.
        """
        batch, side = start.size(0), self.cell * self.window
        height, width = map_features.size(2) // 2, map_features.size(3) // 2
        size = height * width
        features = self.white_features.repeat(batch * size, 1, 1, 1)
        # The first cell of each window: those around the starts, then those around the goals.
        corners = ((torch.cat((start, goal)) - self.reach) / self.cell).floor()
        corners = corners.clamp(min=0.0)
        left = torch.minimum(corners[:, :1], torch.full_like(corners[:, :1], width - self.window))
        top = torch.minimum(corners[:, 1:], torch.full_like(corners[:, 1:], height - self.window))
        shift = self.cell * torch.cat((left, top), 1)
        windows = point_image(start.repeat(2, 1) - shift, goal.repeat(2, 1) - shift, side, side)
        window_features = self.point_stem(tiles_of(windows, self.cell))
        window_cells = endpoint_cells(windows, self.cell)
        # The number of each cell of the windows in its map, (2 B, window, window).
        inside = torch.arange(self.window, device=start.device)
        rows, columns = top.long() + inside, left.long() + inside
        numbers = (rows * width).unsqueeze(2) + columns.unsqueeze(1)
        tasks = torch.arange(batch, device=start.device).view(-1, 1, 1)
        task_numbers = (numbers + (size * tasks).repeat(2, 1, 1)).flatten()
        features[task_numbers] = window_features.flatten(0, 2)[:, :, None, None]
        cells = torch.zeros(2 * batch * size, device=start.device)
        cells[(numbers[:batch] + 2 * size * tasks).flatten()] = window_cells[:batch, 0].flatten()
        cells[(numbers[batch:] + 2 * size * tasks + size).flatten()] = window_cells[
            batch:, 1
        ].flatten()
        features = features.view(batch, height, width, -1).permute(0, 3, 1, 2)
        return features, cells.view(batch, 2, height, width)


def _make_point_stem(stem: nn.Conv2d, noise_stem: nn.Conv2d) -> nn.Linear:
    """Return a point stem that reads tiles, with the output of the noise stem for no noise."""
    assert stem.bias is not None
    assert noise_stem.bias is not None
    return make_linear(stem.weight, stem.bias + noise_stem.bias)
