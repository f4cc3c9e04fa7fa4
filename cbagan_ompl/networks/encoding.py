"""How maps, points and regions become images for the networks, and back.

The one place that knows the colours: training and the exported model both call these functions,
which is why they are TorchScript. Images are (B, 3, H, W), red, green, blue, in [-1, 1]:

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
    """The map as an image.

    Args:
        free: (B, 1, H, W) in [0, 1], 1 where free.

    Returns:
        (B, 3, H, W) in [-1, 1].
    """
    return (2 * free - 1).expand(-1, 3, -1, -1)


def free_space(image: Tensor) -> Tensor:
    """The free space of a map image: the inverse of the above.

    Args:
        image: (B, 3, H, W) in [-1, 1].

    Returns:
        (B, 1, H, W) in [0, 1], 1 where free.
    """
    return 0.5 + 0.5 * image[:, :1]


def point_image(start: Tensor, goal: Tensor, height: int, width: int) -> Tensor:
    """Start and goal as an image of two soft spots.

    Args:
        start: (B, 2), pixel coordinates (u, v); the centre of the upper left pixel is (0.5, 0.5).
        goal: (B, 2), the same.
        height: H of the image.
        width: W of the image.

    Returns:
        (B, 3, H, W) in [-1, 1].
    """
    blue = spot(start, height, width)
    red = spot(goal, height, width)
    # Both spots leave green dark; red leaves blue dark and the other way about.
    return 1 - 2 * torch.cat((blue, torch.maximum(red, blue), red), 1)


def spot(point: Tensor, height: int, width: int, radius: float = SPOT_RADIUS) -> Tensor:
    """A disc around each point, its edge one pixel soft.

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


def region_image(region: Tensor) -> Tensor:
    """The image that the generator should draw for a region: green on white.

    Args:
        region: (B, 1, H, W) in [0, 1], 1 inside.

    Returns:
        (B, 3, H, W) in [-1, 1].
    """
    outside = 1 - 2 * region
    return torch.cat((outside, torch.ones_like(outside), outside), 1)


def region_probability(image: Tensor) -> Tensor:
    """How far each pixel of a region image is from white towards green: the inverse of the above.

    Args:
        image: (B, 3, H, W) in [-1, 1].

    Returns:
        (B, 1, H, W) in [0, 1].
    """
    return 0.5 - 0.25 * (image[:, 0:1] + image[:, 2:3])
