"""Options that several commands share: how maps are read, how heat maps are sampled."""

from __future__ import annotations

import argparse
from typing import Any

from ..sampling.adaptation import ADAPTATION_PARTS
from ..sampling.sampler import DEFAULT_UNIFORM_FRACTION, OPTIMIZING_SHARPNESS


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


def add_sampler_options(parser: Any) -> None:
    """Add the options to a parser or a group of one."""
    parser.add_argument(
        "--uniform-fraction",
        type=float,
        default=DEFAULT_UNIFORM_FRACTION,
        metavar="F",
        help=f"share of draws that stays uniform (default: {DEFAULT_UNIFORM_FRACTION})",
    )
    parser.add_argument(
        "--sharpness",
        type=float,
        metavar="P",
        help="power of the heat map that draws follow (default: by planner, "
        f"{OPTIMIZING_SHARPNESS:g} for those that look for the shortest path, 1 for the others)",
    )
    parser.add_argument(
        "--adaptation",
        type=lambda text: () if text == "none" else tuple(text.split(",")),
        default=ADAPTATION_PARTS,
        metavar="A,B",
        help="parts of the adaptation of that share that are on, or none "
        f"(default: all: {','.join(ADAPTATION_PARTS)})",
    )
