"""The distance fields of :mod:`cbagan_ompl.networks.wavefront`, compiled.

Rows are relaxed from the top to the bottom and back, and each row along both of its directions, in
place: what has changed spreads over the whole map in one pass where paths do not turn back. Such
Gauss-Seidel sweeps are those of H. Zhao, "A fast sweeping method for eikonal equations",
Mathematics of Computation 74, 2005, https://doi.org/10.1090/S0025-5718-04-01678-3, on a graph. The
fixed point is the result of Dijkstra's algorithm, to the last bit: the least rounded sum of costs
over all paths.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..common.compilation import compiled

_DIAGONAL = np.float32(2**0.5)

# Of cells that no path reaches.
_UNREACHED = np.float32(1e4)

# Fields that are swept side by side: each waits for the addition before it, not for the others.
_LANES = 4


def distance_fields(
    edges: NDArray[np.float32], endpoints: NDArray[np.floating]
) -> NDArray[np.float32]:
    """Return the costs of the cheapest paths from start and goal over several cost maps.

    Args:
        edges: (4, H, W, K), costs of the steps between each cell and the ones to its right, below
            it, below to its right and below to its left, positive; diagonal ones are the root of 2
            times as long. C cost maps of each of B tasks, K = B C.
        endpoints: (B, 2, H, W), positive in the cells of the start, and of the goal.

    Returns:
        (2, H, W, K), as :func:`cbagan_ompl.networks.wavefront.distance_fields`.

    Example:
        >>> endpoints = np.zeros((1, 2, 1, 3))
        >>> endpoints[0, 0, 0, 0] = endpoints[0, 1, 0, 2] = 1
        >>> distance_fields(np.ones((4, 1, 3, 1), np.float32), endpoints)[0, 0, :, 0].tolist()
        [0.0, 1.0, 2.0]
    """
    _, height, width, count = edges.shape
    lanes = -(-2 * count // _LANES) * _LANES
    costs, framed = _frame(np.ascontiguousarray(edges), endpoints > 0, lanes)
    _sweep(costs, framed, lanes)
    fields = framed.reshape(height, width + 2, lanes)[:, 1:-1, : 2 * count]
    return np.ascontiguousarray(fields.reshape(height, width, 2, count).transpose(2, 0, 1, 3))


@compiled
def _frame(
    edges: NDArray[np.float32], sources: NDArray[np.bool_], lanes: int
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:  # pragma: no cover
    """Return the costs for each field, and the fields before the first sweep, with a border.

    Args:
        edges: (4, H, W, K).
        sources: (B, 2, H, W).
        lanes: L, at least 2 K.

    Returns:
        (4, H, (W + 2) L) and (H, (W + 2) L): all fields of a cell side by side.
    """
    _, height, width, count = edges.shape
    cost_maps = count // sources.shape[0]
    costs = np.full((4, height, width + 2, lanes), _UNREACHED, np.float32)
    fields = np.full((height, width + 2, lanes), _UNREACHED, np.float32)
    for direction in range(4):
        scale = np.float32(1.0) if direction < 2 else _DIAGONAL
        for row in range(height):
            for column in range(width):
                for k in range(count):
                    cost = scale * edges[direction, row, column, k]
                    costs[direction, row, column + 1, k] = cost
                    costs[direction, row, column + 1, count + k] = cost
    for endpoint in range(2):
        for row in range(height):
            for column in range(width):
                for task in range(sources.shape[0]):
                    if sources[task, endpoint, row, column]:
                        first = endpoint * count + task * cost_maps
                        fields[row, column + 1, first : first + cost_maps] = 0.0
    size = (width + 2) * lanes
    return costs.reshape(4, height, size), fields.reshape(height, size)


@compiled
def _sweep(
    costs: NDArray[np.float32], fields: NDArray[np.float32], lanes: int
) -> None:  # pragma: no cover
    """Relax the fields until nothing changes.

    Args:
        costs: (4, H, (W + 2) L), from :func:`_frame`.
        fields: (H, (W + 2) L), changed in place.
        lanes: L.
    """
    height = len(fields)
    right, below, falling, rising = costs[0], costs[1], costs[2], costs[3]
    # Rows whose changes the next row, and the one before, have not seen.
    down, up = np.ones(height, np.bool_), np.ones(height, np.bool_)
    for row in range(height):
        _relax_row(fields[row], right[row], lanes)
    changed = True
    while changed:
        changed = False
        for row in range(height - 1):
            if down[row]:
                down[row] = False
                below_it = row + 1
                if _relax_next(
                    fields[row], fields[below_it], below[row], falling[row], rising[row], lanes
                ):
                    _relax_row(fields[below_it], right[below_it], lanes)
                    down[below_it] = up[below_it] = changed = True
        for row in range(height - 1, 0, -1):
            if up[row]:
                up[row] = False
                above = row - 1
                if _relax_previous(
                    fields[row], fields[above], below[above], falling[above], rising[above], lanes
                ):
                    _relax_row(fields[above], right[above], lanes)
                    down[above] = up[above] = changed = True


@compiled
def _relax_next(
    here: NDArray[np.float32],
    there: NDArray[np.float32],
    below: NDArray[np.float32],
    falling: NDArray[np.float32],
    rising: NDArray[np.float32],
    lanes: int,
) -> bool:  # pragma: no cover
    """Relax a row from the one above it, and return whether it has changed.

    Args:
        here: fields of the upper row, (W + 2) L.
        there: fields of the lower row.
        below: costs of the steps from the upper row, see :func:`distance_fields`.
        falling: the same.
        rising: the same.
        lanes: L.
    """
    # Slices without an offset in the loop: else nothing is computed side by side.
    size = len(here) - 2 * lanes
    target = there[lanes : lanes + size]
    left, middle, right = here[:size], here[lanes : lanes + size], here[2 * lanes :]
    falling, below, rising = falling[:size], below[lanes : lanes + size], rising[2 * lanes :]
    changed = 0
    for i in range(size):
        value = min(left[i] + falling[i], min(middle[i] + below[i], right[i] + rising[i]))
        changed |= value < target[i]
        target[i] = min(value, target[i])
    return changed != 0


@compiled
def _relax_previous(
    here: NDArray[np.float32],
    there: NDArray[np.float32],
    below: NDArray[np.float32],
    falling: NDArray[np.float32],
    rising: NDArray[np.float32],
    lanes: int,
) -> bool:  # pragma: no cover
    """Relax a row from the one below it; ``here`` is the lower row, the costs are the upper one's.

    Returns whether it has changed; arguments as of :func:`_relax_next`.
    """
    size = len(here) - 2 * lanes
    target = there[lanes : lanes + size]
    left, middle, right = here[:size], here[lanes : lanes + size], here[2 * lanes :]
    middle_costs = slice(lanes, lanes + size)
    falling, below, rising = falling[middle_costs], below[middle_costs], rising[middle_costs]
    changed = 0
    for i in range(size):
        value = min(right[i] + falling[i], min(middle[i] + below[i], left[i] + rising[i]))
        changed |= value < target[i]
        target[i] = min(value, target[i])
    return changed != 0


@compiled
def _relax_row(
    row: NDArray[np.float32], costs: NDArray[np.float32], lanes: int
) -> None:  # pragma: no cover
    """Relax a row from left to right and back.

    Args:
        row: fields, (W + 2) L, L a multiple of :data:`_LANES`.
        costs: of the steps from each cell to the right.
        lanes: L.
    """
    cells = row.reshape(-1, lanes)
    steps = costs.reshape(-1, lanes)
    last = len(cells) - 2
    for lane in range(0, lanes, _LANES):
        a, b, c, d = cells[1, lane], cells[1, lane + 1], cells[1, lane + 2], cells[1, lane + 3]
        for i in range(1, last):
            a = min(a + steps[i, lane], cells[i + 1, lane])
            b = min(b + steps[i, lane + 1], cells[i + 1, lane + 1])
            c = min(c + steps[i, lane + 2], cells[i + 1, lane + 2])
            d = min(d + steps[i, lane + 3], cells[i + 1, lane + 3])
            cells[i + 1, lane], cells[i + 1, lane + 1] = a, b
            cells[i + 1, lane + 2], cells[i + 1, lane + 3] = c, d
        for i in range(last - 1, 0, -1):
            a = min(a + steps[i, lane], cells[i, lane])
            b = min(b + steps[i, lane + 1], cells[i, lane + 1])
            c = min(c + steps[i, lane + 2], cells[i, lane + 2])
            d = min(d + steps[i, lane + 3], cells[i, lane + 3])
            cells[i, lane], cells[i, lane + 1] = a, b
            cells[i, lane + 2], cells[i, lane + 3] = c, d
