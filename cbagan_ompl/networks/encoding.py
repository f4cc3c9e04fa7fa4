"""Maps, points and regions as images for the networks, and back.

The one module that knows the colours: training and the exported model both call these functions,
so they stay within what TorchScript can compile. Images are (B, 3, H, W), red, green, blue, in
[-1, 1]:

* map image: white where free, black where blocked;
* point image: a blue spot at the start and a red one at the goal, on white;
* region image: green where the region is, on white.
"""

from __future__ import annotations

import torch
from torch import Tensor

#: Radius of the start and goal spots in pixels. A single pixel would be lost in the first stride.
SPOT_RADIUS = 2.0


def map_image(free: Tensor) -> Tensor:
    """Return a map as an image.

    Args:
        free: (B, 1, H, W) in [0, 1], 1 where free.

    Returns:
        (B, 3, H, W) in [-1, 1].
    """
    return (2 * free - 1).expand(-1, 3, -1, -1)


def free_space(image: Tensor) -> Tensor:
    """Return the free space of a map image: the inverse of :func:`map_image`.

    Args:
        image: (B, 3, H, W) in [-1, 1].

    Returns:
        (B, 1, H, W) in [0, 1], 1 where free.
    """
    return 0.5 + 0.5 * image[:, :1]


def point_image(start: Tensor, goal: Tensor, height: int, width: int) -> Tensor:
    """Return start and goal as an image of two soft spots.

    Args:
        start: (B, 2), pixel coordinates (u, v), u right and v down; the centre of the upper left
            pixel is (0.5, 0.5).
        goal: (B, 2), the same.
        height: H of the image.
        width: W of the image.

    Returns:
        (B, 3, H, W) in [-1, 1].
    """
    blue = spot(start, height, width)
    red = spot(goal, height, width)
    # Red is dark at the start, blue at the goal, green at both.
    return 1 - 2 * torch.cat((blue, torch.maximum(red, blue), red), 1)


def spot(point: Tensor, height: int, width: int, radius: float = SPOT_RADIUS) -> Tensor:
    """Return a disc around each point, whose edge falls from 1 to 0 over one pixel.

    Args:
        point: (B, 2), pixel coordinates (u, v).
        height: H of the image.
        width: W of the image.
        radius: of the disc in pixels. A default, since TorchScript reads no module constants.

    Returns:
        (B, 1, H, W) in [0, 1].
    """
    columns = torch.arange(width, dtype=point.dtype, device=point.device) + 0.5
    rows = torch.arange(height, dtype=point.dtype, device=point.device) + 0.5
    across = (columns - point[:, :1]).view(-1, 1, 1, width)
    down = (rows - point[:, 1:]).view(-1, 1, height, 1)
    distance = torch.sqrt(across * across + down * down)
    return torch.clamp(radius + 0.5 - distance, 0.0, 1.0)


def spot_centres(image: Tensor) -> tuple[Tensor, Tensor]:
    """Return start and goal of a point image: the inverse of :func:`point_image`.

    Args:
        image: (B, 3, H, W) in [-1, 1].

    Returns:
        (B, 2) each, pixel coordinates (u, v), exact but for spots that the image cuts off.
    """
    spots = 0.5 - 0.5 * image.float()
    columns = torch.arange(image.size(3), dtype=torch.float32, device=image.device) + 0.5
    rows = torch.arange(image.size(2), dtype=torch.float32, device=image.device) + 0.5
    mass = spots.sum((2, 3))
    across, down = (spots.sum(2) * columns).sum(2) / mass, (spots.sum(3) * rows).sum(2) / mass
    points = torch.stack((across, down), 2)
    return points[:, 0], points[:, 2]


def region_image(region: Tensor) -> Tensor:
    """Return a region as the image that the generator learns to produce: green on white.

    Args:
        region: (B, 1, H, W) in [0, 1], 1 inside.

    Returns:
        (B, 3, H, W) in [-1, 1].
    """
    outside = 1 - 2 * region
    return torch.cat((outside, torch.ones_like(outside), outside), 1)


def region_probability(image: Tensor) -> Tensor:
    """Return how far each pixel is from white to green: the inverse of :func:`region_image`.

    Args:
        image: (B, 3, H, W) in [-1, 1].

    Returns:
        (B, 1, H, W) in [0, 1].
    """
    return 0.5 - 0.25 * (image[:, 0:1] + image[:, 2:3])
