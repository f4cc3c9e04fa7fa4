"""Exact tests of the parts of a motion that tables leave open."""

from __future__ import annotations

from collections.abc import Callable

from .clearance_tables import STEP

#: A motion may be refused where the shape comes nearer to an obstacle than this, in pixels. The
#: tables clear a motion only where it keeps as far away, so that both say the same.
CONSERVATISM = STEP

#: A test that looks farther around the shape than this is not tried, in pixels.
WORTH_A_TEST = 1.5


def pieces_are_free(
    low: float,
    high: float,
    excess_of: Callable[[float], float],
    is_free: Callable[[float, float], bool],
) -> bool:
    """Return whether every piece of a motion that overlaps a part of it passes an exact test.

    Pieces are halves of halves of the whole motion, and the smallest are those whose excess is
    below :data:`CONSERVATISM`. A part outside of which the shape keeps that far from obstacles
    decides as the whole motion would, so answers do not depend on what the tables know.

    Args:
        low: where the part begins, 0 to 1.
        high: where it ends.
        excess_of: how much farther than the shape the test of a piece of some width looks, pixels.
        is_free: the test of a piece. Both halves of one that passes pass as well.
    """
    at, width = low, 1.0
    while excess_of(width) > CONSERVATISM and width / 2 >= high - low:
        width /= 2
    while at < high:
        excess, index = excess_of(width), at // width
        if excess <= WORTH_A_TEST and is_free(index * width, (index + 1) * width):
            at = (index + 1) * width
            if index % 2 and width < 1:
                width *= 2
        elif excess <= CONSERVATISM:
            return False
        else:
            width /= 2
    return True
