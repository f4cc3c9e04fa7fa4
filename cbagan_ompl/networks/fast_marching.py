"""The distances of :mod:`.passages`, compiled.

The nodes are visited in about the order of their distance, as in fast marching: J. A. Sethian, "A
fast marching level set method for monotonically advancing fronts", PNAS 93(4), 1996,
https://doi.org/10.1073/pnas.93.4.1591. The queue has buckets, and a node whose distance falls is
visited again, so that the result does not depend on the width of the buckets.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..common.compilation import compiled

#: Distances are found up to this factor of the one between the endpoints, and this much more.
REACH, REACH_SLACK = 1.5, 4.0

#: Distance of the nodes that no path reaches.
UNREACHED = np.float32(1e4)

_BUCKETS = 128
_BUCKET_WIDTH = 0.25


def march_all(
    costs: NDArray[np.float32],
    linked: NDArray[np.uint16],
    start: NDArray[np.int64],
    goal: NDArray[np.int64],
) -> NDArray[np.float32]:
    """Return the distances of several tasks.

    Args:
        costs: (B, 4, h, w), see :func:`.passages.distance_fields`; contiguous.
        linked: (B, 4, h, w), see :func:`link_bits`.
        start: (B,), see :func:`.passages.endpoint_nodes`.
        goal: (B,), the same.

    Returns:
        (B, 2, 4, h, w).
    """
    batch, nodes, height, width = costs.shape
    distances = np.full((batch, 2, nodes, height, width), UNREACHED, np.float32)
    for task in range(batch):
        for field in range(2):
            source, target = (start, goal) if field == 0 else (goal, start)
            _march(
                costs[task].ravel(),
                linked[task].ravel(),
                int(source[task]),
                int(target[task]),
                distances[task, field].ravel(),
                width,
            )
    return distances


@compiled
def link_bits(codes: NDArray[np.int32]) -> NDArray[np.uint16]:  # pragma: no cover
    """Return the links of each node as bits.

    Args:
        codes: (B, 4, h, w), see :func:`.passages.patch_codes`.

    Returns:
        (B, 4, h, w): bit 4 * direction + node is 1 where this node of the neighbouring patch is
        linked; directions are left, right, above, below.
    """
    batch, nodes, height, width = codes.shape
    linked = np.zeros(codes.shape, np.uint16)
    for task in range(batch):
        for here in range(nodes):
            for row in range(height):
                for column in range(width):
                    code = codes[task, here, row, column]
                    if code == 0:
                        continue
                    for there in range(nodes):
                        if column + 1 < width:
                            other = codes[task, there, row, column + 1]
                            if ((code & 0x8888) >> 3) & other:
                                linked[task, here, row, column] |= 1 << (4 + there)
                                linked[task, there, row, column + 1] |= 1 << here
                        if row + 1 < height:
                            other = codes[task, there, row + 1, column]
                            if ((code & 0xF000) >> 12) & other:
                                linked[task, here, row, column] |= 1 << (12 + there)
                                linked[task, there, row + 1, column] |= 1 << (8 + here)
    return linked


@compiled
def descent_directions(
    distances: NDArray[np.float32], linked: NDArray[np.uint16]
) -> NDArray[np.float32]:  # pragma: no cover
    """Return the directions of steepest descent, see :func:`.passages.directions`.

    Args:
        distances: (B, 2, 4, h, w), see :func:`march_all`.
        linked: (B, 4, h, w), see :func:`link_bits`.

    Returns:
        (B, 2, 2, 4, h, w): unit vectors (u, v), v down; 0 where nothing is known.
    """
    batch, fields, nodes, height, width = distances.shape
    result = np.zeros((batch, fields, 2, nodes, height, width), np.float32)
    near = np.empty(4, np.float32)
    for task in range(batch):
        for field in range(fields):
            values = distances[task, field]
            for node in range(nodes):
                for row in range(height):
                    for column in range(width):
                        value, bits = values[node, row, column], linked[task, node, row, column]
                        if bits == 0 or value >= UNREACHED:
                            continue
                        near[:] = UNREACHED
                        for direction in range(4):
                            y = row + (direction == 3) - (direction == 2)
                            x = column + (direction == 1) - (direction == 0)
                            for part in range(nodes):
                                if (bits >> (4 * direction + part)) & 1:
                                    near[direction] = min(near[direction], values[part, y, x])
                        u = max(value - min(near[0], near[1]), np.float32(0))
                        v = max(value - min(near[2], near[3]), np.float32(0))
                        length = np.sqrt(u * u + v * v)
                        if length > 0:
                            u, v = u / length, v / length
                            result[task, field, 0, node, row, column] = (
                                -u if near[0] < near[1] else u
                            )
                            result[task, field, 1, node, row, column] = (
                                -v if near[2] < near[3] else v
                            )
    return result


@compiled
def _pair_min(
    values: NDArray[np.float32], bits: int, cells: int, first: int, second: int
) -> np.float32:  # pragma: no cover
    """Return the least distance of the linked nodes of two patches.

    Args:
        values: of all nodes.
        bits: of the links, those of the two patches in the eight lowest.
        cells: number of patches.
        first: index of the first patch.
        second: index of the second one.
    """
    best = UNREACHED
    for part in range(4):
        if (bits >> part) & 1:
            best = min(best, values[part * cells + first])
        if (bits >> (4 + part)) & 1:
            best = min(best, values[part * cells + second])
    return best


@compiled
def _march(
    costs: NDArray[np.float32],
    linked: NDArray[np.uint16],
    source: int,
    target: int,
    values: NDArray[np.float32],
    width: int,
) -> None:  # pragma: no cover
    """Find the distances from a node, in place."""
    cells = len(costs) // 4
    capacity = 1024
    nodes = np.empty(capacity, np.int32)
    following = np.empty(capacity, np.int32)
    heads = np.full(_BUCKETS, -1, np.int32)
    queued = np.full(len(costs), -1, np.int32)
    steps = np.array((-1, 1, -width, width))
    unused, used, waiting = -1, 1, 1
    values[source] = 0
    nodes[0], following[0], heads[0], queued[source] = source, -1, 0, 0
    number, limit = 0, np.float32(1e30)
    while waiting > 0 and number * _BUCKET_WIDTH <= limit:
        entry = heads[number % _BUCKETS]
        if entry < 0:
            number += 1
            continue
        heads[number % _BUCKETS] = following[entry]
        node = nodes[entry]
        following[entry], unused = unused, entry
        waiting -= 1
        if queued[node] != number:
            continue  # it is in an earlier bucket, or was
        queued[node] = -1
        value = values[node]
        if node == target:
            limit = np.float32(REACH * value + REACH_SLACK)
        cell = node % cells
        bits = linked[node]
        for direction in range(4):
            there = (bits >> (4 * direction)) & 15
            if there == 0:
                continue
            other = cell + steps[direction]
            for part in range(4):
                if not (there >> part) & 1:
                    continue
                neighbour = other + part * cells
                cost = costs[neighbour]
                if values[neighbour] <= value:
                    continue
                if direction < 2:
                    side = _pair_min(
                        values, linked[neighbour] >> 8, cells, other - width, other + width
                    )
                else:
                    side = _pair_min(values, linked[neighbour], cells, other - 1, other + 1)
                difference = abs(value - side)
                if difference < cost:
                    new = (value + side + np.sqrt(2 * cost * cost - difference * difference)) / 2
                else:
                    new = min(value, side) + cost
                new = np.float32(new)
                if new >= values[neighbour] - 1e-5:
                    continue
                values[neighbour] = new
                bucket = max(number, int(new / _BUCKET_WIDTH))
                if queued[neighbour] == bucket:
                    continue
                queued[neighbour] = bucket
                if unused >= 0:
                    entry = unused
                    unused = following[entry]
                else:
                    if used == capacity:
                        nodes = np.concatenate((nodes, np.empty(capacity, np.int32)))
                        following = np.concatenate((following, np.empty(capacity, np.int32)))
                        capacity *= 2
                    entry = used
                    used += 1
                nodes[entry] = neighbour
                following[entry] = heads[bucket % _BUCKETS]
                heads[bucket % _BUCKETS] = entry
                waiting += 1
