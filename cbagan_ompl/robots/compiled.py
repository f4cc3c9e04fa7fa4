"""Exact tests of a shape, compiled: the same answers as in Python, many times sooner.

The algorithm is that of :mod:`.shape_checker`, which explains it; the tests hold the two together.
"""

from __future__ import annotations

from functools import partial
from math import cos, inf, pi, sin
from typing import Any

from ..common.compilation import compiled
from .arcs import follow_arc
from .clearance_tables import BLOCKED, CLEAR, STEP, UNKNOWN

TURN = 2 * pi

# Given, so that whole numbers among the coordinates lead to no second compilation.
_SHAPE = "uint16[:, ::1], float64[:, ::1], int64[::1], float64[:, ::1])"
_TABLES = "uint8[:, ::1], int64[::1]," + _SHAPE

# Most parts of a motion that are left to the exact test one by one; beyond that all of it is.
_MOST_GAPS = 32

_follow_arc = compiled(follow_arc)


@compiled
def _note(scratch: Any, gaps: int, low: float, high: float) -> None:
    if gaps < _MOST_GAPS:
        scratch[0, gaps] = low
        scratch[1, gaps] = high
    else:
        # The last one takes in what follows.
        scratch[1, _MOST_GAPS - 1] = high


@compiled
def _region_is_free(  # noqa: C901 - one loop on purpose
    xs: Any, ys: Any, count: int, margin: float, runs: Any, scratch: Any
) -> bool:
    height, width = runs.shape
    top, bottom = ys[0], ys[count - 1]
    if not (top - margin >= 0 and bottom + margin < height):
        return False
    first, last = int(top - margin), int(bottom + margin)
    lefts, rights = scratch[4], scratch[5]
    for row in range(last - first + 1):
        lefts[row], rights[row] = inf, -inf
    chain_x, chain_y = scratch[6], scratch[7]
    for side in (-1.0, 1.0):
        length = 0
        for point in range(count):
            x, y = xs[point], ys[point]
            while length > 1:
                ax, ay = chain_x[length - 2], chain_y[length - 2]
                bx, by = chain_x[length - 1], chain_y[length - 1]
                if side * ((bx - ax) * (y - ay) - (by - ay) * (x - ax)) > 0:
                    break
                length -= 1
            chain_x[length], chain_y[length] = x, y
            length += 1
        for corner in range(max(length - 1, 1)):
            after = min(corner + 1, length - 1)
            u0, v0, u1, v1 = chain_x[corner], chain_y[corner], chain_x[after], chain_y[after]
            slope = (u1 - u0) / (v1 - v0) if v1 > v0 else 0.0
            for row in range(int(v0 - margin), int(v1 + margin) + 1):
                upper, lower = row - margin, row + 1 + margin
                a = u0 + (upper - v0) * slope if upper > v0 else u0
                b = u0 + (lower - v0) * slope if lower < v1 else u1
                lefts[row - first] = min(lefts[row - first], a, b)
                rights[row - first] = max(rights[row - first], a, b)
    for row in range(first, last + 1):
        left, right = lefts[row - first] - margin, rights[row - first] + margin
        if not (left >= 0 and right < width):
            return False
        column = int(left)
        if runs[row, column] <= int(right) - column:
            return False
    return True


@compiled
def _pose_at(motion: Any, arcs: Any, t: float) -> tuple[float, float, float]:
    """Return the pose of a motion, of which there are arcs unless it is straight."""
    u, v, heading, du, dv, turn = motion
    if arcs[0] == 0.0:
        return u + t * du, v + t * dv, heading + t * turn
    left = t * arcs[1]
    for arc in range(int(arcs[0])):
        length, curvature = arcs[2 + 2 * arc], arcs[3 + 2 * arc]
        step = min(left, abs(length))
        left -= step
        u, v, heading = _follow_arc(u, v, heading, step if length > 0 else -step, curvature)
    return u, v, heading % TURN


@compiled
def _swept_is_free(
    motion: Any,
    low: float,
    high: float,
    margin: float,
    runs: Any,
    parts: Any,
    starts: Any,
    scratch: Any,
) -> bool:
    xs, ys, arcs = scratch[2], scratch[3], scratch[9]
    for part in range(len(starts) - 1):
        count = 0
        for t in (low, high):
            u, v, heading = _pose_at(motion, arcs, t)
            c, s = (cos(heading), sin(heading)) if scratch[8, 8] != 0.0 else (1.0, 0.0)
            for index in range(starts[part], starts[part + 1]):
                x, y = parts[index, 0], parts[index, 1]
                new_x, new_y = u + c * x - s * y, v + s * x + c * y
                # Sorted by row, then column.
                place = count
                while place > 0 and (
                    ys[place - 1] > new_y or (ys[place - 1] == new_y and xs[place - 1] > new_x)
                ):
                    xs[place], ys[place] = xs[place - 1], ys[place - 1]
                    place -= 1
                xs[place], ys[place] = new_x, new_y
                count += 1
        if not _region_is_free(xs, ys, count, margin, runs, scratch):
            return False
    return True


@compiled
def _test_of(motion: Any, width: float, scratch: Any) -> tuple[float, float]:
    """Return the margin of the test of a piece, and how much farther than the shape it looks."""
    radius, diameter, rounding = scratch[8, 0], scratch[8, 1], scratch[8, 6]
    if scratch[9, 0] > 0.0:  # a curve, tested around the middle of the piece
        return motion[3] * width / 2 + rounding, motion[3] * width / 2**0.5
    angle = abs(motion[5]) * width
    margin = radius * angle * angle / 6
    return margin + rounding, diameter * angle / 4 + 3 * margin


@compiled
def _gap_is_free(
    motion: Any,
    low: float,
    high: float,
    runs: Any,
    parts: Any,
    starts: Any,
    scratch: Any,
    constants: Any,
) -> bool:
    worth_a_test, conservatism = constants[4], constants[5]
    at, width = low, 1.0
    while width / 2 >= high - low and _test_of(motion, width, scratch)[1] > conservatism:
        width /= 2
    while at < high:
        margin, excess = _test_of(motion, width, scratch)
        index = at // width
        start, end = index * width, (index + 1) * width
        if scratch[9, 0] > 0.0:
            start = end = (start + end) / 2
        if excess <= worth_a_test and _swept_is_free(
            motion, start, end, margin, runs, parts, starts, scratch
        ):
            at = (index + 1) * width
            if index % 2 and width < 1:
                width *= 2
        elif excess <= conservatism:
            return False
        else:
            width /= 2
    return True


@compiled
def _motion_is_free(  # noqa: C901 - one loop on purpose
    motion: Any,
    tables: Any,
    counts: Any,
    runs: Any,
    parts: Any,
    starts: Any,
    scratch: Any,
    constants: Any,
) -> int:
    _, _, _, du, dv, turn = motion
    height, width = runs.shape
    ranges = len(counts) // 5
    wanted = gaps = 0
    movement = (du * du + dv * dv) ** 0.5 + constants[0] * abs(turn)
    per_value, look = 2.0, 2.0
    if movement > 0:
        per_value, look = STEP / movement, constants[3] / movement
    done, end, t = 0.0, 1.0, 1.0
    while True:
        at_u, at_v, at = _pose_at(motion, scratch[9], t)
        if not (0 <= at_u < width and 0 <= at_v < height and at >= 0):
            return wanted
        index = int(at * constants[2])
        value = int(tables[counts[index], int(at_v) * width + int(at_u)])
        if value == BLOCKED:
            return wanted
        if value == UNKNOWN:
            index %= ranges
            counts[4 * ranges + index] += 1
            if counts[4 * ranges + index] == constants[7]:
                wanted = 2 * index + 2
        reach = (value - CLEAR) * per_value
        if t == 1.0:
            end, t = (1.0 - reach if value > CLEAR else 1.0), 0.0
            continue
        if value > CLEAR:
            if t - reach > done:
                _note(scratch, gaps, done, t - reach)
                gaps += 1
            t += reach
            done = t
        else:
            t += look
        if t >= end:
            break
    if done < end:
        _note(scratch, gaps, done, end)
        gaps += 1
    for gap in range(min(gaps, _MOST_GAPS)):
        low, high = scratch[0, gap], scratch[1, gap]
        if not _gap_is_free(motion, low, high, runs, parts, starts, scratch, constants):
            return wanted
    return wanted + 1


@partial(compiled, signature=f"int64({6 * 'float64,'} {_TABLES}")
def straight_is_free(
    x0: float,
    y0: float,
    yaw0: float,
    x1: float,
    y1: float,
    yaw1: float,
    tables: Any,
    counts: Any,
    runs: Any,
    parts: Any,
    starts: Any,
    scratch: Any,
) -> int:
    """Return whether a straight motion touches nothing, and which table would have helped.

    Args:
        x0: where it begins, world.
        y0: where it begins, world.
        yaw0: where it begins, radians.
        x1: where it ends, world.
        y1: where it ends, world.
        yaw1: where it ends, radians.
        tables: (K, H * W), the tables that are made.
        counts: for each range of headings in four full turns which table is its own, then for each
            range how often its table did not know; counted here.
        runs: (H, W), free pixels to the right of each, itself included.
        parts: (N, 2), the vertices of all convex parts.
        starts: where in ``parts`` each part begins, and the end.
        scratch: (10, M), M at least 32, twice the vertices of a part and the rows of the map. The
            last row is for the arcs of a curve, and the row before holds, as from
            ``ShapeChecker``: radius, diameter, ranges per radian, least
            step, worth a test, conservatism, rounding, after how many uses a table is wanted,
            whether the shape turns, sign and phase of headings, and the six numbers from world to
            pixels.

    Returns:
        1 or 0, plus twice the index from 1 on of the range of headings whose table is wanted.
    """
    constants = scratch[8]
    a, b, c = constants[11], constants[12], constants[13]
    d, e, f = constants[14], constants[15], constants[16]
    u, v = a * x0 + b * y0 + c, d * x0 + e * y0 + f
    du, dv = a * (x1 - x0) + b * (y1 - y0), d * (x1 - x0) + e * (y1 - y0)
    heading, turn = 0.0, 0.0
    if constants[8] != 0.0:
        heading = (constants[9] * yaw0 + constants[10]) % TURN + TURN
        turn = yaw1 - yaw0
        if not -pi <= turn <= pi:
            turn = (turn + pi) % TURN - pi
        turn *= constants[9]
    motion = (u, v, heading, du, dv, turn)
    scratch[9, 0] = 0.0
    return _motion_is_free(motion, tables, counts, runs, parts, starts, scratch, constants)


@partial(compiled, signature=f"boolean({4 * 'float64,'} {_SHAPE}")
def pose_is_free(
    u: float,
    v: float,
    heading: float,
    margin: float,
    runs: Any,
    parts: Any,
    starts: Any,
    scratch: Any,
) -> bool:
    """Return whether a shape with a margin around it touches nothing at a pose.

    Args:
        u: of the pose, pixels.
        v: of the pose, pixels.
        heading: of the pose, in the frame of the pixels.
        margin: added around, pixels.
        runs: see :func:`straight_is_free`, as for those that follow.
        parts: see there.
        starts: see there.
        scratch: see there.
    """
    motion = (u, v, heading, 0.0, 0.0, 0.0)
    scratch[9, 0] = 0.0
    return _swept_is_free(motion, 0.0, 0.0, margin, runs, parts, starts, scratch)


@partial(compiled, signature=f"int64({4 * 'float64,'} {_TABLES}")
def curve_is_free(
    u: float,
    v: float,
    heading: float,
    movement: float,
    tables: Any,
    counts: Any,
    runs: Any,
    parts: Any,
    starts: Any,
    scratch: Any,
) -> int:
    """Return the same as :func:`straight_is_free` for a curve whose arcs are in ``scratch``.

    Args:
        u: where it begins, pixels.
        v: where it begins, pixels.
        heading: where it begins, in the frame of the pixels.
        movement: how far any point of the shape moves over all of it, at most; pixels.
        tables: see :func:`straight_is_free`, as for those that follow.
        counts: see there.
        runs: see there.
        parts: see there.
        starts: see there.
        scratch: its last row as from :func:`.compiled_curves.find_curve`.
    """
    motion = (u, v, heading, movement, 0.0, 0.0)
    return _motion_is_free(motion, tables, counts, runs, parts, starts, scratch, scratch[8])
