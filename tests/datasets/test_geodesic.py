from __future__ import annotations

from math import hypot, pi

import numpy as np
import pytest

from cbagan_ompl.datasets.geodesic import distance_field


@pytest.mark.parametrize("source", [(50, 40), (20, 20), (80, 60)])
def test_distances_in_the_open_are_straight(source: tuple[int, int]) -> None:
    measured = distance_field(np.ones((80, 100), np.bool_), source)
    rows, columns = np.ogrid[:80, :100]
    exact = np.hypot(rows - source[1], columns - source[0])
    assert measured[source[1], source[0]] == 0
    far = exact > 0
    assert (abs(measured - exact)[far] / exact[far]).max() < 0.015


@pytest.mark.parametrize("source", [(0, 0), (99, 3), (50, 0)])
def test_distances_from_a_border_are_straight_on_average(source: tuple[int, int]) -> None:
    # Where no disc without obstacles is around the source, the scheme errs most beside it.
    measured = distance_field(np.ones((80, 100), np.bool_), source)
    rows, columns = np.ogrid[:80, :100]
    exact = np.hypot(rows - source[1], columns - source[0])
    far = exact > 0
    assert abs(measured - exact).max() < 1.6
    assert (abs(measured - exact)[far] / exact[far]).mean() < 0.02


def test_distances_lead_around_a_wall() -> None:
    free = np.ones((256, 256), np.bool_)
    free[:160, 126:130] = False
    # Down to the pixel before the wall's one corner, along its end, and up from the other.
    expected = hypot(125 - 50, 160 - 60) + 5 + hypot(200 - 130, 160 - 60)
    assert distance_field(free, (50, 60))[60, 200] == pytest.approx(expected, rel=0.015)
    assert distance_field(free, (200, 60))[60, 50] == pytest.approx(expected, rel=0.015)


def test_distances_follow_a_narrow_ring() -> None:
    rows, columns = np.mgrid[:101, :101] - 50
    radius = np.hypot(rows, columns)
    half = distance_field((radius > 40) & (radius < 45), (9, 50))[50, 91]
    # No shorter than its inner edge, nor longer than by steps between neighbouring pixels.
    assert 41 * pi < half < 41 * pi * 8 / pi * (2**0.5 - 1)


def test_nothing_leads_through_a_closed_wall() -> None:
    free = np.ones((30, 30), np.bool_)
    free[10:20, 10] = free[10:20, 19] = free[10, 10:20] = free[19, 10:20] = False
    measured = distance_field(free, (14, 14))
    assert np.isfinite(measured[11:19, 11:19]).all()
    outside = np.ones_like(free)
    outside[11:19, 11:19] = False
    assert np.isinf(measured[outside]).all()
    # Nor between two obstacles that meet at their corners.
    free = np.array([[True, False], [False, True]])
    assert np.isinf(distance_field(free, (0, 0))[1, 1])
