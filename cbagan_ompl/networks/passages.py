"""The free space of a map as a graph of patches that keeps every passage, and distances on it.

A patch of 4 x 4 pixels is a 16-bit number, its code: bit 4 * row + column is 1 where free. Its free
pixels fall into 4-connected components, and those that touch the border of the patch in more than
one place can be passed through. A patch has four nodes: the three largest of these, and all others
together (or, if there are fewer, components that are dead ends). Two nodes of neighbouring patches
are linked where free pixels of both touch across the common side. So paths in the graph are paths
on the map, and the other way round, but for patches that can be passed in five ways at once.
"""

from __future__ import annotations

from functools import cache

import torch
from torch import Tensor

#: Width and height of a patch in pixels.
PATCH = 4

#: Nodes of a patch.
NODES = 4

#: Distance of the nodes that no path reaches.
UNREACHED = 1e4

# The bits of the columns on the left and on the right, and of the rows at the top and the bottom.
_LEFT, _RIGHT, _TOP, _BOTTOM = 0x1111, 0x8888, 0x000F, 0xF000


@cache
def component_table() -> Tensor:
    """Return the codes of the four nodes of each code, (65536, 4) int16, the lowest 16 bits.

    Example:
        >>> (component_table()[0b0000_1111_0000_1011].int() & 0xFFFF).tolist()
        [3840, 3, 8, 0]
    """
    codes = torch.arange(2**16, dtype=torch.int32, device="cpu")
    components, keys = [], []
    rest = codes.clone()
    while rest.any():
        component = _grow(rest & -rest, codes)
        sides = (_LEFT, _RIGHT, _TOP, _BOTTOM)
        contacts = torch.stack([_count_bits(component & side) for side in sides]).sum(0)
        components.append(component)
        keys.append(32 * (contacts > 1) + _count_bits(component))
        rest &= ~component
    order = torch.stack(keys).sort(dim=0, descending=True, stable=True)
    ranked = torch.stack(components).gather(0, order.indices)
    others = (ranked[3:] * (order.values[3:] > 32)).sum(0, dtype=torch.int32)
    last = torch.where(others > 0, others, ranked[3])
    return torch.cat((ranked[:3], last[None])).T.to(torch.int16).contiguous()


def _grow(component: Tensor, codes: Tensor) -> Tensor:
    """Return the 4-connected components that hold the given pixels."""
    while True:
        grown = component | (component << 4) | (component >> 4)
        grown |= ((component & ~_RIGHT) << 1) | ((component & ~_LEFT) >> 1)
        grown &= codes
        if torch.equal(grown, component):
            return grown
        component = grown


def _count_bits(codes: Tensor) -> Tensor:
    return torch.stack([(codes >> bit) & 1 for bit in range(16)]).sum(0)


def patch_codes(free: Tensor, table: Tensor) -> Tensor:
    """Return the four nodes of each patch.

    Args:
        free: (B, 1, H, W) in [0, 1], 1 where free; H and W multiples of :data:`PATCH`.
        table: from :func:`component_table`.

    Returns:
        (B, 4, H / 4, W / 4) int32: the free pixels of each node as a code.
    """
    batch, height, width = free.size(0), free.size(2) // 4, free.size(3) // 4
    powers = torch.tensor([1.0, 2.0, 4.0, 8.0], device=free.device)
    rows = ((free > 0.5).view(batch, 4 * height, width, 4) * powers).sum(3)
    rows = rows.view(batch, height, 4, width)
    codes = rows[:, :, 0] + 16 * rows[:, :, 1] + 256 * rows[:, :, 2] + 4096 * rows[:, :, 3]
    nodes = table[codes.long()].int() & 0xFFFF
    return nodes.permute(0, 3, 1, 2).contiguous()


def endpoint_nodes(points: Tensor, codes: Tensor) -> Tensor:
    """Return the nodes that points lie in.

    Args:
        points: (B, 2), pixel coordinates (u, v), u right and v down.
        codes: (B, 4, h, w), see :func:`patch_codes`.

    Returns:
        (B,) int64, indices into the last three axes of the codes, flattened. On a blocked pixel it
        is the first node of its patch.
    """
    height, width = codes.size(2), codes.size(3)
    column = points[:, 0].long().clamp(0, 4 * width - 1)
    row = points[:, 1].long().clamp(0, 4 * height - 1)
    cell = (row // 4) * width + column // 4
    bit = 4 * (row % 4) + column % 4
    masks = codes.flatten(2).gather(2, cell[:, None, None].expand(-1, codes.size(1), 1))[..., 0]
    inside = (masks.long() >> bit[:, None]) & 1
    return inside.argmax(1) * (height * width) + cell


def links(codes: Tensor) -> Tensor:
    """Return which nodes are linked with the ones to their left and right, above and below.

    Args:
        codes: (B, 4, h, w), see :func:`patch_codes`.

    Returns:
        (4, B, 4, 4, h, w) bool: by direction (left, right, above, below), node, and node of the
        neighbouring patch.
    """
    batch, nodes, height, width = codes.shape
    right = torch.zeros(batch, nodes, nodes, height, width, dtype=torch.bool, device=codes.device)
    below = torch.zeros_like(right)
    here, there = codes[:, :, None], codes[:, None]
    touching = ((here[..., :-1] & 0x8888) >> 3) & there[..., 1:]
    right[..., :-1] = touching != 0
    touching = ((here[..., :-1, :] & 0xF000) >> 12) & there[..., 1:, :]
    below[..., :-1, :] = touching != 0
    left, above = torch.zeros_like(right), torch.zeros_like(right)
    left[..., 1:] = right[..., :-1].transpose(1, 2)
    above[..., 1:, :] = below[..., :-1, :].transpose(1, 2)
    return torch.stack((left, right, above, below))


def nearest_neighbours(distance: Tensor, linked: Tensor) -> Tensor:
    """Return the smaller distance of the linked nodes in each direction.

    Args:
        distance: (..., B, 4, h, w).
        linked: see :func:`links`.

    Returns:
        (4, ..., B, 4, h, w), :data:`UNREACHED` where no node is linked.
    """
    framed = torch.nn.functional.pad(distance, [1, 1, 1, 1], value=1e4)
    shifted = torch.stack(
        (
            framed[..., 1:-1, :-2],
            framed[..., 1:-1, 2:],
            framed[..., :-2, 1:-1],
            framed[..., 2:, 1:-1],
        )
    )
    if distance.dim() == 5:
        linked = linked.unsqueeze(1)
    return shifted.unsqueeze(-4).masked_fill(~linked, 1e4).amin(-3)


def distance_fields(
    costs: Tensor, codes: Tensor, start: Tensor, goal: Tensor, rounds: int
) -> Tensor:
    """Return the distances of all nodes from start and goal, without gradients.

    They solve the eikonal equation |grad D| = cost, in rounds over all nodes until none changes.
    :mod:`.fast_marching` does the same, compiled.

    Args:
        costs: (B, 4, h, w) float32, positive: of each node, for a way as long as a patch.
        codes: (B, 4, h, w), see :func:`patch_codes`.
        start: (B,), see :func:`endpoint_nodes`.
        goal: (B,), the same.
        rounds: limit of their number.

    Returns:
        (B, 2, 4, h, w): by endpoint and node; 1e4 where no path leads, or none that is short
        enough to be of use, see :data:`.fast_marching.REACH`.
    """
    with torch.no_grad():
        sources = torch.stack((start, goal))
        size = [2, costs.size(0), costs.size(1), costs.size(2), costs.size(3)]
        distance = torch.full(size, 1e4, device=costs.device)
        distance.flatten(2).scatter_(2, sources[..., None], 0.0)
        linked = links(codes)
        square = 2.0 * costs * costs
        for step in range(rounds):
            near = nearest_neighbours(distance, linked)
            across, along = torch.minimum(near[0], near[1]), torch.minimum(near[2], near[3])
            difference = (across - along).abs()
            both = 0.5 * (across + along + (square - difference * difference).clamp(min=0).sqrt())
            best = torch.where(difference < costs, both, torch.minimum(across, along) + costs)
            best = torch.minimum(best, distance)
            is_done = step % 8 == 0 and torch.equal(best, distance)
            distance = best
            if is_done:
                break
        others = sources.flip(0)[..., None]
        limit = 1.5 * distance.flatten(2).gather(2, others) + 4.0
        is_far = distance > limit[..., None, None]
        return distance.masked_fill(is_far, 1e4).transpose(0, 1).contiguous()


def directions(distance: Tensor, codes: Tensor) -> Tensor:
    """Return the directions of steepest descent.

    Args:
        distance: (B, 2, 4, h, w), see :func:`distance_fields`.
        codes: (B, 4, h, w), see :func:`patch_codes`.

    Returns:
        (B, 2, 2, 4, h, w): unit vectors (u, v), v down, by endpoint, coordinate and node; 0 where
        no node beside it is nearer.
    """
    fields = distance.transpose(0, 1)
    near = nearest_neighbours(fields, links(codes))
    # Towards the nearer of both neighbours, as much as the distance falls.
    u = (fields - torch.minimum(near[0], near[1])).clamp(min=0.0)
    v = (fields - torch.minimum(near[2], near[3])).clamp(min=0.0)
    u = torch.where(near[0] < near[1], -u, u)
    v = torch.where(near[2] < near[3], -v, v)
    vectors = torch.stack((u, v), 1).masked_fill((fields >= 1e4).unsqueeze(1), 0.0)
    return unit_vectors(vectors.flatten(2)).view(vectors.shape).permute(2, 0, 1, 3, 4, 5)


def unit_vectors(vectors: Tensor) -> Tensor:
    """Return vectors (B, 2, ...) with a length of 1; vectors of length 0 as they are."""
    # Much faster than Tensor.norm, which is slow along this axis.
    square = vectors[:, :1] * vectors[:, :1] + vectors[:, 1:] * vectors[:, 1:]
    return vectors * square.clamp(min=1e-12).rsqrt()
