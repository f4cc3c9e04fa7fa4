"""Arcs of circles that a robot with a turning radius drives."""

from __future__ import annotations

from math import cos, pi, sin

#: (x, y, yaw), radians.
Pose = tuple[float, float, float]


def follow_arc(x: float, y: float, yaw: float, length: float, curvature: float) -> Pose:
    """Return the pose at the end of an arc of circle.

    Args:
        x: of the pose at its beginning.
        y: of the pose at its beginning.
        yaw: of the pose at its beginning.
        length: of the arc, negative for one that is driven backwards.
        curvature: of the arc, positive where driving forwards increases the yaw.

    Returns:
        (x, y, yaw), yaw in [-pi, pi).

    Example:
        >>> x, y, yaw = follow_arc(0.0, 0.0, 0.0, pi, 0.5)
        >>> round(x, 9), round(y, 9), round(yaw / pi, 9)
        (2.0, 2.0, 0.5)
    """
    half = length * curvature / 2
    # The chord has the direction in the middle of the arc.
    chord = length * (sin(half) / half if half else 1.0)
    middle = yaw + half
    end = (yaw + 2 * half + pi) % (2 * pi) - pi
    return x + chord * cos(middle), y + chord * sin(middle), end
