"""The arcs of the shortest curves of robots with a turning radius, compiled.

Without reverse gear: L. E. Dubins, "On curves of minimal length with a constraint on average
curvature", American Journal of Mathematics 79 (1957), https://doi.org/10.2307/2372560. With it:
J. A. Reeds and L. A. Shepp, "Optimal paths for a car that goes both forwards and backwards",
Pacific Journal of Mathematics 145 (1990), https://doi.org/10.2140/pjm.1990.145.367, whose section 8
has the formulas.
"""

from __future__ import annotations

from functools import partial
from math import acos, asin, atan2, cos, pi, sin
from typing import Any

from ..common.compilation import compiled
from .arcs import follow_arc

TURN = 2 * pi

# Differences by rounding, in turning radii and radians.
_TOLERANCE = 1e-6
# How far below zero a length may be by rounding, in turning radii.
_ROUNDING = 1e-14

_follow_arc = compiled(follow_arc)


@compiled
def _wrap(angle: float) -> float:
    """Return an angle in [-pi, pi]."""
    return (angle + pi) % TURN - pi


@compiled
def _wrap_positive(angle: float) -> float:
    """Return an angle in [0, 2 pi), 0 for what is below it by rounding."""
    angle %= TURN
    return 0.0 if TURN - angle < 0.5 * _TOLERANCE else angle


@compiled
def _is_kept(arcs: Any, lengths: Any, curvatures: Any) -> bool:
    """Return whether a curve is the one that is kept, but for arcs that are 0 long.

    Arguments as for :func:`_keep`.
    """
    place, left = 0, arcs[2]
    for arc in range(len(lengths)):
        length = lengths[arc]
        while abs(length) > _TOLERANCE:
            while abs(left) <= _TOLERANCE:
                place += 1
                if place == int(arcs[0]):
                    return False
                left = arcs[2 + 2 * place]
            if arcs[3 + 2 * place] != curvatures[arc] or left * length < 0:
                return False
            step = min(abs(left), abs(length))
            step = step if length > 0 else -step
            left, length = left - step, length - step
    return True


@compiled
def _keep(arcs: Any, lengths: Any, curvatures: Any) -> None:
    """Keep a curve if it has the length and the middle that are looked for.

    Args:
        arcs: see :func:`find_curve`, for the turning radius 1.
        lengths: of the arcs, negative where driven backwards.
        curvatures: of the arcs, positive to the left.
    """
    total = 0.0
    for length in lengths:
        total += abs(length)
    if abs(total - arcs[1]) > _TOLERANCE or (arcs[0] > 0 and _is_kept(arcs, lengths, curvatures)):
        return
    x = y = heading = 0.0
    left = total / 2
    for arc in range(len(lengths)):
        step = min(left, abs(lengths[arc]))
        left -= step
        x, y, heading = _follow_arc(
            x, y, heading, step if lengths[arc] > 0 else -step, curvatures[arc]
        )
    error = abs(x - arcs[12]) + abs(y - arcs[13]) + abs(_wrap(heading - arcs[14]))
    if not error < _TOLERANCE:
        return
    # Two different curves: it is not known which one.
    arcs[15] += 1.0
    arcs[0] = len(lengths)
    for arc in range(len(lengths)):
        arcs[2 + 2 * arc], arcs[3 + 2 * arc] = lengths[arc], curvatures[arc]


@compiled
def _find_dubins(x: float, y: float, turn: float, arcs: Any) -> None:
    """Look for the curve among the Dubins curves from (0, 0, 0), for the turning radius 1.

    Args:
        x: where it ends.
        y: where it ends.
        turn: heading at its end.
        arcs: see :func:`_keep`.
    """
    for left in (1.0, -1.0):  # and the mirror image
        up, angle = left * y, left * turn
        dx, dy = x - sin(angle), up - 1 + cos(angle)
        gap, toward = (dx * dx + dy * dy) ** 0.5, atan2(dy, dx)
        first = _wrap_positive(toward)
        last = _wrap_positive(angle - first)
        _keep(arcs, (first, gap, last), (left, 0.0, left))
        if gap <= 4:
            middle = TURN - 2 * asin(gap / 4)
            first = _wrap_positive(toward + middle / 2)
            last = _wrap_positive(angle - first + middle)
            _keep(arcs, (first, middle, last), (left, -left, left))
        dx, dy = x + sin(angle), up - 1 - cos(angle)
        straight = dx * dx + dy * dy - 4
        if straight >= 0:
            straight = straight**0.5
            first = _wrap_positive(atan2(dy, dx) + atan2(2.0, straight))
            last = _wrap_positive(first - angle)
            _keep(arcs, (first, straight, last), (left, 0.0, -left))


@compiled
def _outer_arcs(u: float, v: float, dx: float, dy: float, angle: float) -> tuple[float, float]:
    """Return the first and last arc of a curve whose two middle arcs are u and v long."""
    difference = _wrap(u - v)
    a, b = sin(u) - sin(difference), cos(u) - cos(difference) - 1
    first = atan2(dy * a - dx * b, dx * a + dy * b)
    if 2 * (cos(difference) - cos(v) - cos(u)) + 3 < 0:
        first += pi
    first = _wrap(first)
    return first, _wrap(first - u + v - angle)


@compiled
def _find_symmetric(x: float, y: float, angle: float, way: float, left: float, arcs: Any) -> None:
    """Keep those curves whose kind is the same from end to start.

    Args:
        x: where they end.
        y: where they end.
        angle: heading at their end.
        way: 1, or -1 to drive all arcs the other way.
        left: 1, or -1 for the mirror image.
        arcs: see :func:`_keep`.
    """
    dx, dy = x - sin(angle), y - 1 + cos(angle)
    first = atan2(dy, dx)
    last = _wrap(angle - first)
    if first >= -_ROUNDING and last >= -_ROUNDING:
        gap = (dx * dx + dy * dy) ** 0.5
        _keep(arcs, (way * first, way * gap, way * last), (left, 0.0, left))
    dx, dy = x + sin(angle), y - 1 - cos(angle)
    square, toward = dx * dx + dy * dy, atan2(dy, dx)
    if square >= 4:
        straight = (square - 4) ** 0.5
        first = _wrap(toward + atan2(2.0, straight))
        last = _wrap(first - angle)
        if first >= -_ROUNDING and last >= -_ROUNDING:
            _keep(arcs, (way * first, way * straight, way * last), (left, 0.0, -left))
        straight = 4 - straight
        if straight <= _ROUNDING:
            first = _wrap(atan2((4 - straight) * dx - 2 * dy, -2 * dx + (straight - 4) * dy))
            last = _wrap(first - angle)
            if first >= -_ROUNDING and last >= -_ROUNDING:
                quarter = -way * pi / 2
                _keep(
                    arcs,
                    (way * first, quarter, way * straight, quarter, way * last),
                    (left, -left, 0.0, left, -left),
                )
    cosine = (2 + square**0.5) / 4
    if cosine <= 1:
        u = acos(cosine)
        first, last = _outer_arcs(u, -u, dx, dy, angle)
        if first >= -_ROUNDING and last <= _ROUNDING:
            _keep(
                arcs,
                (way * first, way * u, -way * u, way * last),
                (left, -left, left, -left),
            )
    cosine = (20 - square) / 16
    if 0 <= cosine <= 1:
        u = -acos(cosine)
        first, last = _outer_arcs(u, u, dx, dy, angle)
        if first >= -_ROUNDING and last >= -_ROUNDING:
            _keep(
                arcs,
                (way * first, way * u, way * u, way * last),
                (left, -left, left, -left),
            )


@compiled
def _find_others(
    x: float, y: float, angle: float, way: float, left: float, is_turned: bool, arcs: Any
) -> None:
    """Keep the other curves, of three or four arcs; arguments as for :func:`_find_symmetric`.

    Args:
        x: see there.
        y: see there.
        angle: see there.
        way: see there.
        left: see there.
        is_turned: whether the arcs are driven from the last to the first.
        arcs: see :func:`_keep`.
    """
    dx, dy = x - sin(angle), y - 1 + cos(angle)
    gap, toward = (dx * dx + dy * dy) ** 0.5, atan2(dy, dx)
    quarter = -way * pi / 2
    if gap <= 4:
        u = -2 * asin(gap / 4)
        first = _wrap(toward + u / 2 + pi)
        last = _wrap(angle - first + u)
        if first >= -_ROUNDING:
            one, other = (last, first) if is_turned else (first, last)
            _keep(arcs, (way * one, way * u, way * other), (left, -left, left))
    if gap >= 2:
        root = (gap * gap - 4) ** 0.5
        first = _wrap(toward + atan2(root, -2.0))
        last = _wrap(angle - pi / 2 - first)
        if first >= -_ROUNDING and 2 - root <= _ROUNDING and last <= _ROUNDING:
            one, two, three, four = way * first, quarter, way * (2 - root), way * last
            if is_turned:
                _keep(arcs, (four, three, two, one), (left, 0.0, -left, left))
            else:
                _keep(arcs, (one, two, three, four), (left, -left, 0.0, left))
    dx, dy = x + sin(angle), y - 1 - cos(angle)
    gap, first = (dx * dx + dy * dy) ** 0.5, atan2(dx, -dy)
    if gap >= 2:
        last = _wrap(first + pi / 2 - angle)
        if first >= -_ROUNDING and last <= _ROUNDING:
            one, two, three, four = way * first, quarter, way * (2 - gap), way * last
            if is_turned:
                _keep(arcs, (four, three, two, one), (-left, 0.0, -left, left))
            else:
                _keep(arcs, (one, two, three, four), (left, -left, 0.0, -left))


@compiled
def _find_reeds_shepp(x: float, y: float, turn: float, arcs: Any) -> None:
    """Look for it among the Reeds-Shepp curves; arguments as for :func:`_find_dubins`."""
    c, s = cos(turn), sin(turn)
    from_end_x, from_end_y = x * c + y * s, x * s - y * c
    for way in (1.0, -1.0):
        for left in (1.0, -1.0):
            angle = way * left * turn
            _find_symmetric(way * x, left * y, angle, way, left, arcs)
            _find_others(way * x, left * y, angle, way, left, False, arcs)
            _find_others(way * from_end_x, left * from_end_y, angle, way, left, True, arcs)


# Given, so that whole numbers among the coordinates lead to no second compilation.
@partial(compiled, signature=f"boolean({11 * 'float64,'} boolean, float64[::1])")
def find_curve(
    u0: float,
    v0: float,
    heading0: float,
    middle_u: float,
    middle_v: float,
    middle_heading: float,
    u1: float,
    v1: float,
    heading1: float,
    length: float,
    radius: float,
    reverses: bool,
    arcs: Any,
) -> bool:
    """Find the arcs of a curve of which length and middle are known.

    Of the curves between two poses that may be shortest, two are often as long: L+R-L+ and R-L+R-.

    Args:
        u0: where it begins.
        v0: where it begins.
        heading0: where it begins, radians.
        middle_u: after half of its length.
        middle_v: after half of its length.
        middle_heading: after half of its length.
        u1: where it ends.
        v1: where it ends.
        heading1: where it ends.
        length: of the curve.
        radius: the turning radius, in the unit of u and v.
        reverses: whether it is a Reeds-Shepp curve, not a Dubins curve.
        arcs: (N,), N at least 16; set to the number of arcs, the length of the curve, and of each
            of at most five arcs its length, negative where driven backwards, and curvature.

    Returns:
        Whether there is one such curve.
    """
    c, s = cos(heading0), sin(heading0)
    du, dv = (middle_u - u0) / radius, (middle_v - v0) / radius
    arcs[12], arcs[13], arcs[14] = c * du + s * dv, c * dv - s * du, middle_heading - heading0
    arcs[0], arcs[1], arcs[15] = 0.0, length / radius, 0.0
    du, dv = (u1 - u0) / radius, (v1 - v0) / radius
    x, y, turn = c * du + s * dv, c * dv - s * du, _wrap(heading1 - heading0)
    if reverses:
        _find_reeds_shepp(x, y, turn, arcs)
    else:
        _find_dubins(x, y, turn, arcs)
    for arc in range(int(arcs[0])):
        arcs[2 + 2 * arc] *= radius
        arcs[3 + 2 * arc] /= radius
    arcs[1] = length
    return bool(arcs[15] == 1.0)
