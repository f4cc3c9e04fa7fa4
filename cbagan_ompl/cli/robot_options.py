"""Options that say what moves, and the positions and poses of a task."""

from __future__ import annotations

import argparse
from typing import Any

from ..errors import ConfigError
from ..robots.footprint_files import parse_footprint
from ..robots.robot import Robot


def add_robot_options(parser: Any) -> None:
    """Add the options of :func:`robot_of` to a parser or a group of one."""
    parser.add_argument(
        "--radius", type=float, metavar="R", help="a disc of this radius (default: a point)"
    )
    parser.add_argument(
        "--footprint",
        metavar="LxW|FILE",
        help="a shape with a heading: a rectangle, length by width as in 4.5x1.8, or a file with "
        "its corners (.yaml as nav2's footprint, .svg)",
    )
    parser.add_argument(
        "--turning-radius",
        type=float,
        metavar="R",
        help="least radius of its curves: plan along Dubins curves (default: it turns on the spot)",
    )
    parser.add_argument(
        "--reverse",
        action="store_true",
        help="it also drives backwards: plan along Reeds-Shepp curves",
    )


def robot_of(args: argparse.Namespace) -> Robot:
    """Return the robot that the arguments ask for.

    Raises:
        ConfigError: a radius and a footprint.
        RobotError: a robot that makes no sense, or an unusable file of a footprint.
    """
    turning = {"turning_radius": args.turning_radius, "reverse": args.reverse}
    if args.footprint is not None:
        if args.radius is not None:
            raise ConfigError("give --radius for a disc or --footprint for another shape, not both")
        return parse_footprint(args.footprint, **turning)
    if args.radius:
        return Robot.disc(args.radius, **turning)
    return Robot.point(**turning)


def endpoint(text: str) -> tuple[float, ...]:
    """Parse a position ``X,Y`` or a pose ``X,Y,YAW``: the type of an option."""
    try:
        values = tuple(float(part) for part in text.split(","))
    except ValueError:
        values = ()
    if len(values) not in (2, 3):
        raise argparse.ArgumentTypeError(
            "expected two numbers as X,Y, such as 12.5,-40, or three as X,Y,YAW, the yaw in "
            f"radians; got {text!r}"
        )
    return values
