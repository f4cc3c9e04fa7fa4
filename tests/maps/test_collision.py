"""The exact segment check against exact arithmetic and dense sampling."""

from __future__ import annotations

from fractions import Fraction
from itertools import pairwise
from math import floor

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cbagan_ompl.maps.collision import segment_is_free


def random_free(rng, height, width, blocked=0.3):
    free = rng.random((height, width)) > blocked
    free[0, 0] = True
    return free


def pixels_on_the_way(u0, v0, u1, v1):
    """All pixels that a segment passes through, in exact arithmetic; all four at a corner."""
    u0, v0, u1, v1 = (Fraction(x) for x in (u0, v0, u1, v1))

    def at(t):
        return u0 + t * (u1 - u0), v0 + t * (v1 - v0)

    def pixel(t):
        u, v = at(t)
        return floor(u), floor(v)

    times = {Fraction(0), Fraction(1)}
    for a, b in ((u0, u1), (v0, v1)):
        if a != b:
            for border in range(floor(min(a, b)), floor(max(a, b)) + 2):
                t = (border - a) / (b - a)
                if 0 <= t <= 1:
                    times.add(t)
    times = sorted(times)
    found = {pixel(t) for t in times}
    found |= {pixel((s + t) / 2) for s, t in pairwise(times)}
    for i, t in enumerate(times):
        before = pixel((times[i - 1] + t) / 2) if i else pixel(t)
        after = pixel((times[i + 1] + t) / 2) if i + 1 < len(times) else pixel(t)
        if before[0] != after[0] and before[1] != after[1]:
            found |= {(before[0], after[1]), (after[0], before[1])}
    return found


def segments_to_try(rng, width, height):
    """Random ones, and many through corners, along borders and along the axes and diagonals."""
    top = np.array([width, height, width, height])
    yield from rng.uniform(0, 1, (150, 4)) * top
    quarters = np.floor(rng.uniform(0, 1, (350, 4)) * top * 4) / 4
    yield from quarters
    for u, v, other, _ in quarters[:60]:
        yield u, v, other, v
        if other < height:
            yield u, v, u, other
    for u, v in quarters[:80, :2]:
        for du, dv in ((1, 1), (1, -1), (2, 1), (-1, 2)):
            for length in (1.5, 3.0):
                end = u + du * length, v + dv * length
                if 0 <= end[0] < width and 0 <= end[1] < height:
                    yield u, v, *end


@pytest.mark.parametrize("seed", range(3))
def test_segments_agree_with_exact_arithmetic(seed):
    rng = np.random.default_rng(seed)
    width, height = 13, 9
    free = random_free(rng, height, width, blocked=0.12)
    cells = free.tobytes()
    answers = []
    for segment in segments_to_try(rng, width, height):
        u0, v0, u1, v1 = (float(x) for x in segment)
        visited = pixels_on_the_way(u0, v0, u1, v1)
        expected = all(0 <= c < width and 0 <= r < height and free[r, c] for c, r in visited)
        assert segment_is_free(cells, width, height, u0, v0, u1, v1) == expected, segment
        assert segment_is_free(cells, width, height, u1, v1, u0, v0) == expected, segment
        answers.append(expected)
    assert 0.2 < np.mean(answers) < 0.8  # both answers occur often


def test_long_segments_miss_no_corner():
    # The way from one corner of a large map to near the other, through hundreds of corners, with
    # one blocked pixel beside a late corner.
    size = 4000
    for du, dv in ((1, 1), (3, 2), (7, 5), (1, 3)):
        steps = (size - 2) // max(du, dv)
        free = np.ones((size, size), dtype=bool)
        u0, v0 = 1.0, 1.0
        u1, v1 = 1.0 + du * (steps - 1), 1.0 + dv * (steps - 1)
        column, row = 1 + du * (steps - 2), 1 + dv * (steps - 2)
        free[row - 1, column] = False  # touched at its lower left corner only
        cells = free.tobytes()
        assert not segment_is_free(cells, size, size, u0, v0, u1, v1)
        assert not segment_is_free(cells, size, size, u1, v1, u0, v0)


WIDTH, HEIGHT = 9, 7


def coordinates(size: int) -> st.SearchStrategy[float]:
    """Anywhere in the grid, often on borders and corners of pixels."""
    inside = st.floats(0, size, exclude_max=True)
    return st.one_of(inside, st.integers(0, size - 1).map(float))


masks = st.lists(st.booleans(), min_size=WIDTH * HEIGHT, max_size=WIDTH * HEIGHT)
points = st.tuples(coordinates(WIDTH), coordinates(HEIGHT))


@given(masks, points, points)
def test_no_sampled_point_of_a_free_segment_is_blocked(
    cells: list[bool], start: tuple[float, float], end: tuple[float, float]
) -> None:
    free = np.array(cells).reshape(HEIGHT, WIDTH)
    if not segment_is_free(free.tobytes(), WIDTH, HEIGHT, *start, *end):
        return
    along = np.linspace(0, 1, 400)[:, None]
    columns, rows = np.floor(np.array(start) + along * np.subtract(end, start)).astype(int).T
    assert free[rows, columns].all()


@given(masks, points, points)
def test_a_blocked_segment_comes_close_to_a_blocked_pixel(
    cells: list[bool], start: tuple[float, float], end: tuple[float, float]
) -> None:
    free = np.array(cells).reshape(HEIGHT, WIDTH)
    if segment_is_free(free.tobytes(), WIDTH, HEIGHT, *start, *end):
        return
    sampled = np.array(start) + np.linspace(0, 1, 400)[:, None] * np.subtract(end, start)
    rows, columns = np.nonzero(~free)
    corners = np.stack((columns, rows), axis=-1)[:, None]
    gaps = np.maximum(np.maximum(corners - sampled, sampled - corners - 1), 0)
    # Two sampled points are less than 0.03 pixels apart.
    assert np.hypot(*np.moveaxis(gaps, -1, 0)).min() < 0.03


@given(masks, points, points)
def test_both_directions_agree_off_the_borders(
    cells: list[bool], start: tuple[float, float], end: tuple[float, float]
) -> None:
    data = bytes(cells)
    there = segment_is_free(data, WIDTH, HEIGHT, *start, *end)
    back = segment_is_free(data, WIDTH, HEIGHT, *end, *start)
    sampled = np.array(start) + np.linspace(0, 1, 400)[:, None] * np.subtract(end, start)
    # A segment along a border belongs to one side of it, whichever way it is walked.
    if np.abs(sampled - np.round(sampled)).min() > 1e-9:
        assert there == back
