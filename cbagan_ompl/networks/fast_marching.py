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

# Buckets of the queue, which are used again and again, and their width. All together they are
# wider than the largest cost.
_BUCKETS, _BUCKET_WIDTH = 128, 0.25

# Distances that fall by less are as good as before.
_TOLERANCE = np.float32(1e-5)


# Of indices that are not negative: of all others numba asks each time whether they are.
_Index = np.uintp


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
        (B, 2, 4, h, w): by endpoint and node; 1e4 where no path leads, or no short one.

    Example:
        >>> linked = link_bits(np.full((1, 4, 1, 3), [[[0xFFFF]], [[0]], [[0]], [[0]]], np.int32))
        >>> costs = np.ones((1, 4, 1, 3), np.float32)
        >>> march_all(costs, linked, np.array([0]), np.array([2]))[0, :, 0, 0].tolist()
        [[0.0, 1.0, 2.0], [2.0, 1.0, 0.0]]
    """
    batch, nodes, height, width = costs.shape
    distances = np.full((batch, 2, nodes, height, width), UNREACHED, np.float32)
    for task in range(batch):
        for field, (source, target) in enumerate(((start, goal), (goal, start))):
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
        for node in range(nodes):
            for row in range(height):
                for column in range(width):
                    if codes[task, node, row, column]:
                        _link(codes[task], linked[task], node, row, column)
    return linked


@compiled
def _link(
    codes: NDArray[np.int32], linked: NDArray[np.uint16], here: int, row: int, column: int
) -> None:  # pragma: no cover
    """Link a node with those of the patches to its right and below, in place."""
    nodes, height, width = codes.shape
    # The pixels on the right as those on the left, and those at the bottom as those at the top.
    right = (codes[here, row, column] & 0x8888) >> 3
    bottom = (codes[here, row, column] & 0xF000) >> 12
    for there in range(nodes):
        if column + 1 < width and right & codes[there, row, column + 1]:
            linked[here, row, column] |= 1 << (4 + there)
            linked[there, row, column + 1] |= 1 << here
        if row + 1 < height and bottom & codes[there, row + 1, column]:
            linked[here, row, column] |= 1 << (12 + there)
            linked[there, row + 1, column] |= 1 << (8 + here)


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
    cells = height * width
    result = np.zeros((batch, fields, 2, nodes, height, width), np.float32)
    for task in range(batch):
        bits = linked[task].ravel()
        for field in range(fields):
            values = distances[task, field].ravel()
            across = result[task, field, 0].ravel()
            along = result[task, field, 1].ravel()
            for node in range(len(values)):
                if bits[node] == 0 or values[node] >= UNREACHED:
                    continue
                cell = node % cells
                u = _fall(values, values[node], bits[node], cells, cell - 1, cell + 1)
                v = _fall(values, values[node], bits[node] >> 8, cells, cell - width, cell + width)
                length = np.sqrt(u * u + v * v)
                if length > 0:
                    across[node] = u / length
                    along[node] = v / length
    return result


@compiled
def _fall(
    values: NDArray[np.float32], value: np.float32, bits: int, cells: int, before: int, after: int
) -> np.float32:  # pragma: no cover
    """Return by how much the distance falls along an axis, negative towards the patch before."""
    first = _least(values, bits, cells, before)
    second = _least(values, bits >> 4, cells, after)
    fall = max(value - min(first, second), np.float32(0))
    return -fall if first < second else fall


@compiled
def _least(
    values: NDArray[np.float32], bits: int, cells: int, cell: int
) -> np.float32:  # pragma: no cover
    """Return the least distance of the linked nodes of a patch.

    Args:
        values: of all nodes.
        bits: the four lowest say which nodes are linked.
        cells: number of patches.
        cell: index of the patch.
    """
    bits &= 15
    if bits == 1:  # nearly always
        return np.float32(values[_Index(cell)])
    best = UNREACHED
    for part in range(4):
        if (bits >> part) & 1:
            best = min(best, values[_Index(part * cells + cell)])
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
    """Find the distances from a node, in place.

    All in one function, since numba counts references to arrays at each call of another.

    Args:
        costs: of all nodes.
        linked: the same.
        source: the node.
        target: the node that counts for how far distances are found.
        values: of all nodes, :data:`UNREACHED`.
        width: columns of patches.
    """
    # Each bucket is a list of entries, each a node and the entry behind. A node whose distance
    # falls gets another entry; its bucket says which one counts. This touches less memory than
    # lists from which nodes can be taken.
    heads = np.full(_BUCKETS, -1, np.int32)
    entries = np.empty((4 * len(costs), 2), np.int32)
    bucket_of = np.full(len(costs), -1, np.int32)
    steps, cells = (-1, 1, -width, width), len(costs) // 4
    values[source], bucket_of[source] = 0, 0
    heads[0], entries[0, 0], entries[0, 1] = 0, source, -1
    unused, ever_used, in_use = -1, 1, 1  # the first unused entry, and numbers of entries
    number, limit = 0, np.float32(1e30)
    while in_use > 0 and number * _BUCKET_WIDTH <= limit:
        slot = _Index(number & (_BUCKETS - 1))
        entry = heads[slot]
        if entry < 0:
            if values[target] <= number * _BUCKET_WIDTH:
                limit = np.float32(REACH * values[target] + REACH_SLACK)
            number += 1
            continue
        node, heads[slot] = entries[_Index(entry), 0], entries[_Index(entry), 1]
        entries[_Index(entry), 1], unused, in_use = unused, entry, in_use - 1
        if bucket_of[_Index(node)] != number:
            continue
        bucket_of[_Index(node)] = -1
        links, patch = int(linked[_Index(node)]), node if node < cells else node % cells
        for direction in range(4):
            beside, nodes = patch + steps[direction], (links >> (4 * direction)) & 15
            other = beside - cells
            while nodes:
                is_linked, other, nodes = nodes & 1, other + cells, nodes >> 1
                if not is_linked or values[_Index(other)] <= values[_Index(node)]:
                    continue
                side = _least_beside(values, linked[_Index(other)], cells, beside, width, direction)
                new = _distance(values[_Index(node)], side, costs[_Index(other)])
                if new >= values[_Index(other)] - _TOLERANCE:
                    continue
                values[_Index(other)] = new
                bucket = max(number, int(new * np.float32(1 / _BUCKET_WIDTH)))
                before = bucket_of[_Index(other)]
                # With many entries in use it waits where it is: it is visited later, but it is.
                waits = before >= 0 and in_use > 2 * len(costs)
                if before != bucket and not waits:
                    bucket_of[_Index(other)], slot = bucket, _Index(bucket & (_BUCKETS - 1))
                    entry, unused, ever_used = _take_entry(entries, unused, ever_used)
                    entries[_Index(entry), 0], entries[_Index(entry), 1] = other, heads[slot]
                    heads[slot], in_use = entry, in_use + 1
    _forget_far(values, limit)


@compiled
def _take_entry(
    entries: NDArray[np.int32], unused: int, ever_used: int
) -> tuple[int, int, int]:  # pragma: no cover
    """Return an entry, and what the first unused one and the number of those ever used become."""
    if unused < 0:
        return ever_used, unused, ever_used + 1
    return unused, int(entries[_Index(unused), 1]), ever_used


@compiled
def _forget_far(values: NDArray[np.float32], limit: np.float32) -> None:  # pragma: no cover
    """Take distances above a limit for those of nodes that no path reaches."""
    for node in range(len(values)):
        if values[node] > limit:
            values[node] = UNREACHED


@compiled
def _least_beside(
    values: NDArray[np.float32], links: int, cells: int, patch: int, width: int, direction: int
) -> np.float32:  # pragma: no cover
    """Return the least distance of the nodes linked along the other axis than a direction's."""
    if direction < 2:
        before, after, links = patch - width, patch + width, links >> 8
    else:
        before, after = patch - 1, patch + 1
    return min(_least(values, links, cells, before), _least(values, links >> 4, cells, after))


@compiled
def _distance(
    value: np.float32, side: np.float32, cost: np.float32
) -> np.float32:  # pragma: no cover
    """Return the distance of a node from those beside it, one along each axis.

    The solution d of (d - value)^2 + (d - side)^2 = cost^2, or of d - value = cost if one of them
    is too large.
    """
    difference = abs(value - side)
    if difference >= cost:
        return np.float32(min(value, side) + cost)
    root = np.sqrt(np.float32(2) * cost * cost - difference * difference)
    return np.float32(np.float32(0.5) * (value + side + root))
