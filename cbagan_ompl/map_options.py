"""Options of the command line that say how a map file is read."""

from __future__ import annotations

import argparse
from typing import Any


def add_map_options(parser: Any) -> None:
    """Add the options to a parser or a group of one."""
    parser.add_argument(
        "--threshold",
        type=float,
        metavar="T",
        help="for images: how bright a free pixel is at least, 0 to 1 (default: 0.5)",
    )
    parser.add_argument(
        "--unknown-is-free",
        action="store_true",
        help="for ROS maps: plan through unknown space (default: it is blocked)",
    )


def map_options(args: argparse.Namespace) -> dict[str, Any]:
    """The options of :meth:`cbagan_ompl.GridMap.load` that the arguments ask for."""
    options: dict[str, Any] = {"unknown_is_free": args.unknown_is_free}
    if args.threshold is not None:
        options["threshold"] = args.threshold
    return options
