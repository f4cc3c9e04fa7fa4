"""What a map file says, and how large a map may be."""

from __future__ import annotations

from dataclasses import FrozenInstanceError

import numpy as np
import pytest

from cbagan_ompl import MapError
from cbagan_ompl.maps.raw_map import MAX_PIXELS, MAX_SIDE, RawMap, check_map_size


def test_defaults_are_those_of_an_image() -> None:
    raw = RawMap(np.ones((2, 3), bool), "hall")
    assert (raw.resolution, raw.origin, raw.unknown) == (1.0, None, None)
    with pytest.raises(FrozenInstanceError):
        raw.name = "other"  # type: ignore[misc]


@pytest.mark.parametrize(
    ("width", "height"),
    [
        (1, 1),
        (MAX_SIDE, 1),
        (1, MAX_SIDE),
        (MAX_SIDE, MAX_PIXELS // MAX_SIDE),
        (MAX_PIXELS // MAX_SIDE, MAX_SIDE),
    ],
)
def test_sizes_that_are_read(width: int, height: int) -> None:
    check_map_size(width, height, "hall")


@pytest.mark.parametrize(
    ("width", "height"),
    [
        (MAX_SIDE + 1, 1),
        (1, MAX_SIDE + 1),
        (MAX_SIDE, MAX_PIXELS // MAX_SIDE + 1),
        (2**31, 2**31),
        (10**30, 1),
    ],
)
def test_sizes_that_are_too_large(width: int, height: int) -> None:
    with pytest.raises(MapError, match=f"hall: {width} x {height} pixels; maps up to {MAX_SIDE} "):
        check_map_size(width, height, "hall")
