"""Headings of heat maps, and poses sampled around them."""

from __future__ import annotations

from math import cos, inf, nan, pi, sin
from typing import Any

import numpy as np
import pytest

from cbagan_ompl import ConfigError, GridMap, HeadingSpread, Heatmap, HeatmapError, TaskError
from cbagan_ompl.sampling.headings import HeadingSampler, sample_headings

FREE = np.ones((32, 64), bool)


def differences(headings: np.ndarray, heading: float) -> np.ndarray:
    return np.angle(np.exp(1j * (headings - heading)))


@pytest.mark.parametrize(
    "heading",
    [np.zeros((64, 32)), np.zeros(3), 0.0, np.full((32, 64), inf), [["a"]], [[1], [1, 2]], [[None]],
     np.zeros((32, 64), complex), np.zeros((32, 64), bool), "north"],
)  # fmt: skip
def test_bad_headings(heading: Any) -> None:
    with pytest.raises(HeatmapError, match="heading"):
        Heatmap(FREE, GridMap(FREE), heading)
    with pytest.raises(HeatmapError, match="heading"):
        Heatmap.uniform(GridMap(FREE)).with_heading(heading)


def test_headings_are_kept() -> None:
    grid = GridMap(FREE)
    heading = np.full(FREE.shape, 3 * pi / 2)
    heading[0, 0] = nan
    heatmap = Heatmap(FREE, grid, heading)
    assert heatmap.heading is not None
    assert heatmap.heading.dtype == np.float32
    assert np.isnan(heatmap.heading[0, 0])
    assert heatmap.heading[1, 1] == pytest.approx(-pi / 2)
    with pytest.raises(ValueError, match="read-only"):
        heatmap.heading[0, 0] = 1
    assert heatmap.with_heading(None).heading is None
    assert Heatmap.uniform(grid).heading is None


def test_a_repaired_region_keeps_its_headings() -> None:
    values = np.zeros(FREE.shape, np.float32)
    values[:, :10] = values[:, -10:] = 1
    heatmap = Heatmap(values, GridMap(FREE), np.ones(FREE.shape))
    joined = heatmap.connected((5, 5), (60, 5))
    assert joined is not heatmap
    assert np.array_equal(joined.heading, heatmap.heading)


@pytest.mark.parametrize("yaw", [0.0, 0.7, -2.5])
def test_frames(yaw: float) -> None:
    """A ROS map has y up and is turned; the heading is that of the world."""
    grid = GridMap(FREE, 0.5, (3.0, -2.0, yaw))
    goal = grid.to_world((60.5, 4.5))
    heatmap = Heatmap.uniform(grid).directed(goal)
    pixel = 20.5, 28.5
    x, y = grid.to_world(pixel)
    assert heatmap.heading is not None
    heading = float(heatmap.heading[28, 20])
    exact = np.arctan2(goal[1] - y, goal[0] - x)
    assert abs(differences(np.array(heading), exact)) < 0.3
    assert -pi <= heading <= pi
    there = grid.to_pixel((x + 5 * cos(heading), y + 5 * sin(heading)))
    assert there[0] > pixel[0]
    assert there[1] < pixel[1]


def test_image_frame_points_down() -> None:
    heatmap = Heatmap.uniform(GridMap(FREE)).directed((5.0, 30.0))
    assert heatmap.heading is not None
    assert heatmap.heading[5, 5] == pytest.approx(pi / 2, abs=0.3)


def test_several_goals() -> None:
    heatmap = Heatmap.uniform(GridMap(FREE)).directed([(1, 16), (63, 16)])
    assert heatmap.heading is not None
    assert abs(heatmap.heading[16, 10]) > 2.8
    assert abs(heatmap.heading[16, 50]) < 0.3


@pytest.mark.parametrize("goal", [(1, 2, 3), (nan, 1), (100, 1), "goal", None, [], [(1, 2, 3)]])
def test_bad_goals(goal: Any) -> None:
    with pytest.raises(TaskError, match="goal"):
        Heatmap.uniform(GridMap(FREE)).directed(goal)


def test_sampled_poses() -> None:
    heading = np.where(np.arange(64) < 32, 1.0, nan) * np.ones(FREE.shape)
    heatmap = Heatmap(FREE, GridMap(FREE), heading)
    poses = heatmap.sample_poses(4000, rng=1)
    assert poses.shape == (4000, 3)
    assert (np.abs(poses[:, 2]) <= pi).all()
    known = poses[:, 0] < 32
    near = np.abs(differences(poses[:, 2], 1.0)) < 0.8
    # Two standard deviations of 80 %, and the part of the uniform ones that falls there.
    assert near[known].mean() == pytest.approx(0.8 * 0.954 + 0.2 * 0.8 / pi, abs=0.04)
    assert near[~known].mean() == pytest.approx(0.8 / pi, abs=0.04)
    assert np.array_equal(poses, heatmap.sample_poses(4000, rng=1))
    assert heatmap.sample_poses(0).shape == (0, 3)


def test_poses_without_headings_are_uniform() -> None:
    yaw = Heatmap.uniform(GridMap(FREE)).sample_poses(4000, rng=2)[:, 2]
    counts = np.histogram(yaw, bins=8, range=(-pi, pi))[0]
    assert counts.sum() == 4000
    assert np.abs(counts - 500).max() < 110


def test_headings_stay_below_pi() -> None:
    """OMPL takes a yaw of pi, unlike -pi, to be out of bounds."""
    rng = np.random.default_rng(6)
    still = HeadingSpread(spread=1e-300, uniform_fraction=1e-6)
    for heading in (pi, -pi, 3 * pi, np.nextafter(pi, 0)):
        sampled = sample_headings(np.full(100, heading), still, rng)
        assert (sampled >= -pi).all()
        assert (sampled < pi).all()
        heatmap = Heatmap([[1.0]], GridMap([[1]]), [[heading]])
        one = HeadingSampler(heatmap, still, rng).sample(0.5, 0.5)
        assert -pi <= one < pi


@pytest.mark.parametrize("heading", [-3.0, 0.0, 3.1])
def test_which_poses_follow_the_headings(heading: float) -> None:
    known = np.full(FREE.shape, heading)
    known[:, 40:] = nan
    heatmap = Heatmap(FREE, GridMap(FREE), known)
    forwards, both = (
        HeadingSampler(heatmap, HeadingSpread(), np.random.default_rng(0), reverses)
        for reverses in (False, True)
    )
    for turn in (-0.5, 0.0, 0.5, 2 * pi):
        assert forwards.are_followed(5.0, 5.0, heading + turn)
        assert both.are_followed(5.0, 5.0, heading + turn)
        assert not forwards.are_followed(5.0, 5.0, heading + pi + turn)
        assert both.are_followed(5.0, 5.0, heading + pi + turn)
    for turn in (-pi / 2, 1.0, 2.2):
        assert not forwards.are_followed(5.0, 5.0, heading + turn)
        assert not both.are_followed(5.0, 5.0, heading + turn)
        assert forwards.are_followed(50.0, 5.0, heading + turn), "where nothing is known"
        assert forwards.are_followed(-50.0, 5.0, heading + turn), "off the map"
        off = HeadingSampler(heatmap, HeadingSpread(uniform_fraction=1), np.random.default_rng(0))
        assert off.are_followed(5.0, 5.0, heading + turn)


def test_reversals() -> None:
    spread = HeadingSpread(spread=0.1, uniform_fraction=0.1, reverse_fraction=0.3)
    rng = np.random.default_rng(3)
    known = np.full(5000, 2.0)
    forwards = sample_headings(known, spread, rng)
    both = sample_headings(known, spread, rng, reverses=True)
    back = [np.abs(differences(h, 2.0 - pi)) < 0.4 for h in (forwards, both)]
    assert back[0].mean() < 0.03
    assert back[1].mean() == pytest.approx(0.9 * 0.3 + 0.1 * 0.4 / pi, abs=0.03)


def test_one_by_one_as_many_at_once() -> None:
    """The planner's samples follow the same law as ``sample_poses``."""
    heatmap = Heatmap(FREE, GridMap(FREE), np.full(FREE.shape, -3.0))
    sampler = HeadingSampler(heatmap, HeadingSpread(), np.random.default_rng(4))
    single = np.array([sampler.sample(20.5, 7.5) for _ in range(4000)])
    many = heatmap.sample_poses(4000, rng=5)[:, 2]
    bins = np.linspace(-pi, pi, 13)
    counts = [np.histogram(headings, bins)[0] for headings in (single, many)]
    assert sum(counts[0]) == 4000
    assert np.abs(counts[0] - counts[1]).max() < 160
    outside = np.array([sampler.sample(-5.0, 7.5) for _ in range(2000)])
    assert np.histogram(outside, 4, (-pi, pi))[0].min() > 400


@pytest.mark.parametrize(
    ("name", "value"),
    [("spread", 0), ("spread", -1), ("spread", 4.0), ("spread", nan), ("spread", "wide"),
     ("uniform_fraction", 0), ("uniform_fraction", 1.5), ("uniform_fraction", None),
     ("reverse_fraction", -0.1), ("reverse_fraction", 2), ("reverse_fraction", True),
     ("approach_fraction", -0.1), ("approach_fraction", 1.1), ("approach_fraction", "0.1")],
)  # fmt: skip
def test_bad_spreads(name: str, value: Any) -> None:
    with pytest.raises(ConfigError, match=name):
        HeadingSpread(**{name: value})
