"""Images cut into tiles, and layers that read tiles."""

from __future__ import annotations

import torch
from torch import Tensor, nn
from torch.nn import functional


def pad_to_stride(free: Tensor, stride: int) -> Tensor:
    """Return maps with blocked pixels to the right and below, up to multiples of a stride."""
    right, below = -free.size(3) % stride, -free.size(2) % stride
    # A graph for ONNX is traced: it has no branches.
    if torch.jit.is_scripting() and right == 0 and below == 0:  # type: ignore[attr-defined]
        return free
    return functional.pad(free, [0, right, 0, below])


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


def make_free_stem(stem: nn.Conv2d) -> nn.Linear:
    """Return a map stem that reads the pixels of a patch, 1 where free, not three colours."""
    assert stem.bias is not None
    return make_linear(2 * stem.weight.sum(1), stem.bias - stem.weight.sum((1, 2, 3)))


def make_linear(weight: Tensor, bias: Tensor) -> nn.Linear:
    """Return the layer that does to the tiles of :func:`tiles_of` what a convolution does."""
    flat = weight.flatten(1)
    linear = nn.Linear(flat.size(1), flat.size(0))
    with torch.no_grad():
        linear.weight.copy_(flat)
        linear.bias.copy_(bias)
    return linear
