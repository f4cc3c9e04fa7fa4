"""What moves: the shape of a robot, and how it may move."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import cos, inf, isfinite, sin
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..common.validation import is_finite_number, positive_number, truth_value
from ..errors import ConfigError, RobotError, show
from .polygons import check_polygon, contains_origin, distance_to_outline, is_convex

#: How a robot moves between two states.
Motion = Literal["straight", "dubins", "reeds-shepp"]

_SPACES: dict[Motion, str] = {
    "straight": "SE2StateSpace",
    "dubins": "DubinsStateSpace",
    "reeds-shepp": "ReedsSheppStateSpace",
}


@dataclass(frozen=True)
class Robot:
    """A robot: a point, a disc or a polygon, with or without a turning radius.

    Make one with :meth:`point`, :meth:`disc`, :meth:`rectangle` or :meth:`polygon`. A shape lies
    in the robot's own frame: x forward, y to the side that a positive yaw turns to, (0, 0) the
    reference point, whose pose (x, y, yaw) is the state that is planned. Lengths are world units.

    How it moves, and the state space, follow from shape and turning radius:

    ================  ==============  ======================  ==============
    shape             turning radius  state space             ``motion``
    ================  ==============  ======================  ==============
    point, disc       none            RealVectorStateSpace    straight
    polygon           none            SE2StateSpace           straight
    any               given           DubinsStateSpace        dubins
    any               and reverse     ReedsSheppStateSpace    reeds-shepp
    ================  ==============  ======================  ==============

    Attributes:
        shape: "point", "disc" or "polygon" (a rectangle is one).
        radius: of a disc; 0 for any other shape.
        corners: the vertices of a polygon, counter-clockwise; empty for any other shape.
        turning_radius: of the tightest curve of the reference point; None where the robot turns
            on the spot, or has no heading.
        reverse: whether it also drives backwards.

    Example:
        >>> car = Robot.rectangle(4.5, 1.8, turning_radius=5.0, reverse=True, offset=1.4)
        >>> car.motion, car.state_space, round(car.circumscribed_radius, 2)
        ('reeds-shepp', 'ReedsSheppStateSpace', 3.76)
        >>> Robot.disc(0.3).has_heading
        False
    """

    shape: Literal["point", "disc", "polygon"] = "point"
    radius: float = 0.0
    corners: tuple[tuple[float, float], ...] = ()
    turning_radius: float | None = None
    reverse: bool = False

    def __post_init__(self) -> None:
        """Check the fields against each other; the constructors have checked each for itself."""
        if self.shape not in ("point", "disc", "polygon"):
            raise RobotError(f"a robot is a point, a disc or a polygon, got {show(self.shape)}")
        if self.turning_radius is not None:
            radius = _positive("turning_radius", self.turning_radius)
            object.__setattr__(self, "turning_radius", radius)
        object.__setattr__(self, "reverse", _truth("reverse", self.reverse))
        if self.reverse and self.turning_radius is None:
            raise RobotError(
                "reverse is for robots with a turning radius; without one a robot moves in every "
                "direction anyway: give turning_radius as well, or leave reverse out"
            )
        if self.shape == "disc":
            object.__setattr__(self, "radius", _positive("radius", self.radius))
        elif self.radius != 0:
            raise RobotError(f"radius is for discs, a {self.shape} has none: {show(self.radius)}")
        if self.shape == "polygon":
            points = check_polygon(self.corners).tolist()
            object.__setattr__(self, "corners", tuple((x, y) for x, y in points))
        elif self.corners:
            raise RobotError(f"corners are for polygons, a {self.shape} has none")

    @classmethod
    def point(cls, turning_radius: float | None = None, reverse: bool = False) -> Robot:
        """Return a robot without size.

        Args:
            turning_radius: world units; None for a robot without heading.
            reverse: whether it also drives backwards; needs a turning radius.

        Raises:
            RobotError: a turning radius that is not above 0, or ``reverse`` without one.

        Example:
            >>> Robot.point().state_space, Robot.point(turning_radius=8.0).state_space
            ('RealVectorStateSpace', 'DubinsStateSpace')
        """
        return cls("point", turning_radius=turning_radius, reverse=reverse)

    @classmethod
    def disc(
        cls, radius: float, turning_radius: float | None = None, reverse: bool = False
    ) -> Robot:
        """Return a disc around the reference point.

        Args:
            radius: of the disc, world units.
            turning_radius: as for :meth:`point`.
            reverse: as for :meth:`point`.

        Raises:
            RobotError: a radius that is not above 0, or as for :meth:`point`.

        Example:
            >>> Robot.disc(0.25).inscribed_radius
            0.25
        """
        return cls("disc", radius, turning_radius=turning_radius, reverse=reverse)

    @classmethod
    def rectangle(
        cls,
        length: float,
        width: float,
        turning_radius: float | None = None,
        reverse: bool = False,
        offset: float | tuple[float, float] = 0.0,
    ) -> Robot:
        """Return a rectangle, its length along x.

        Args:
            length: along the heading, world units.
            width: across, world units.
            turning_radius: as for :meth:`point`.
            reverse: as for :meth:`point`.
            offset: where its centre is as seen from the reference point: a number is that far
                ahead, a pair is (x, y). A car that is steered at the front turns about its rear
                axle, so its centre is ahead of the reference point.

        Raises:
            RobotError: a side that is not above 0, an offset that is no number or pair, or as for
                :meth:`point`.

        Example:
            >>> Robot.rectangle(4.0, 2.0, offset=1.0).vertices.tolist()
            [[-1.0, -1.0], [3.0, -1.0], [3.0, 1.0], [-1.0, 1.0]]
        """
        ahead, aside = _positive("length", length) / 2, _positive("width", width) / 2
        x, y = _pair(offset)
        corners = (
            (x - ahead, y - aside),
            (x + ahead, y - aside),
            (x + ahead, y + aside),
            (x - ahead, y + aside),
        )
        return cls("polygon", 0.0, corners, turning_radius, reverse)

    @classmethod
    def polygon(
        cls, vertices: ArrayLike, turning_radius: float | None = None, reverse: bool = False
    ) -> Robot:
        """Return a robot of any outline, convex or not.

        The reference point may lie outside of it, as for a trailer behind its hitch.

        Args:
            vertices: (N, 2), in order along the outline, either way round; the first need not be
                repeated at the end.
            turning_radius: as for :meth:`point`.
            reverse: as for :meth:`point`.

        Raises:
            RobotError: fewer than three vertices, not finite, no area, an outline that crosses or
                touches itself, or as for :meth:`point`.

        Example:
            >>> Robot.polygon([(0, 0), (3, 0), (0, 3)]).is_convex
            True
        """
        return cls("polygon", 0.0, vertices, turning_radius, reverse)  # type: ignore[arg-type]

    @property
    def has_heading(self) -> bool:
        """Whether the states of the robot have a yaw."""
        return self.shape == "polygon" or self.turning_radius is not None

    @property
    def motion(self) -> Motion:
        """How the robot moves between two states: "straight", "dubins" or "reeds-shepp"."""
        if self.turning_radius is None:
            return "straight"
        return "reeds-shepp" if self.reverse else "dubins"

    @property
    def state_space(self) -> str:
        """The name of the OMPL state space that the robot plans in."""
        return _SPACES[self.motion] if self.has_heading else "RealVectorStateSpace"

    @cached_property
    def vertices(self) -> NDArray[np.float64] | None:
        """The vertices of a polygon, (N, 2), counter-clockwise, read-only; None for a disc."""
        if self.shape != "polygon":
            return None
        vertices = np.array(self.corners)
        vertices.setflags(write=False)
        return vertices

    @cached_property
    def is_convex(self) -> bool:
        """Whether the shape is convex."""
        return self.vertices is None or is_convex(self.vertices)

    @cached_property
    def contains_reference(self) -> bool:
        """Whether the reference point lies in the shape."""
        return self.vertices is None or contains_origin(self.vertices)

    @cached_property
    def inscribed_radius(self) -> float:
        """Radius of the largest disc around the reference point inside the shape, world units.

        A map may be inflated by it without losing a position that the robot can take. It is 0
        where the reference point is not inside of the shape; then the point may even lie over an
        obstacle, which the positions that a heat map and its uniform samples propose leave out.
        """
        if self.vertices is None:
            return self.radius
        return distance_to_outline(self.vertices) if self.contains_reference else 0.0

    @cached_property
    def circumscribed_radius(self) -> float:
        """Radius of the smallest disc around the reference point that holds the shape."""
        return self.radius if self.vertices is None else float(np.hypot(*self.vertices.T).max())

    def outline(self, pose: ArrayLike) -> NDArray[np.float64]:
        """Return the vertices of a polygon at a pose, (N, 2), world.

        Args:
            pose: (x, y, yaw), world.

        Raises:
            RobotError: the robot is no polygon, or the pose is not three finite numbers.

        Example:
            >>> Robot.rectangle(2.0, 1.0).outline((5.0, 5.0, 0.0))[0].tolist()
            [4.0, 4.5]
        """
        if self.vertices is None:
            raise RobotError(f"a {self.shape} has no outline of vertices")
        values = np.asarray(pose).tolist()
        if not (isinstance(values, list) and len(values) == 3 and all(map(isfinite, values))):
            raise RobotError(f"a pose is three finite numbers x, y, yaw, got {show(pose)}")
        x, y, yaw = values
        rotation = np.array([(cos(yaw), sin(yaw)), (-sin(yaw), cos(yaw))])
        return np.asarray(self.vertices @ rotation + (x, y))


def check_robot(robot: object) -> None:
    """Raise if a value is no robot.

    Raises:
        RobotError: it is none; the message says how to make one.

    Example:
        >>> check_robot(Robot.point())
    """
    if not isinstance(robot, Robot):
        raise RobotError(f"expected a Robot, got {show(robot)}; make one with Robot.rectangle(...)")


def _positive(name: str, value: float) -> float:
    try:
        number = positive_number(name, value)
    except ConfigError as error:
        raise RobotError(f"{error}; it is a length in world units") from error
    if not 1 / number < inf:
        raise RobotError(f"{name} is too small to be a length: {show(value)}")
    return number


def _truth(name: str, value: bool) -> bool:
    try:
        return truth_value(name, value)
    except ConfigError as error:
        raise RobotError(str(error)) from error


def _pair(offset: float | tuple[float, float]) -> tuple[float, float]:
    values: Any = (offset, 0.0) if is_finite_number(offset) else offset
    if not (
        isinstance(values, tuple | list | np.ndarray)
        and len(values) == 2
        and all(is_finite_number(value) for value in values)
    ):
        raise RobotError(f"offset is a number or a pair of numbers (x, y), got {show(offset)}")
    return float(values[0]), float(values[1])
