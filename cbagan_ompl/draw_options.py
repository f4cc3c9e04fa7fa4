"""Options of the command line that say how draws follow a heat map."""

from __future__ import annotations

from typing import Any

from .draws import DEFAULT_UNIFORM_FRACTION, OPTIMIZING_SHARPNESS
from .trust import ADAPTATION_PARTS


def add_draw_options(parser: Any) -> None:
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
