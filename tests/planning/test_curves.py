"""The arcs of Dubins and Reeds-Shepp curves are those that OMPL interpolates."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from math import cos, pi, sin
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from cbagan_ompl import GridMap, Robot
from cbagan_ompl.planning import compat
from cbagan_ompl.planning.compat import ob
from cbagan_ompl.planning.states import state_access
from cbagan_ompl.robots.arcs import follow_arc
from cbagan_ompl.robots.compiled_curves import find_curve
from cbagan_ompl.robots.shape_checker import ShapeChecker

RADIUS = 7.0
SPACES: dict[str, Callable[[], Any]] = {
    "Dubins": partial(ob.DubinsStateSpace, RADIUS),
    "Reeds-Shepp": partial(ob.ReedsSheppStateSpace, RADIUS),
}
Pose = tuple[float, float, float]


class Curves:
    """Curves of a space, as OMPL interpolates them, and their arcs."""

    def __init__(self, kind: str) -> None:
        self._space = SPACES[kind]()
        self._reverses = kind == "Reeds-Shepp"
        self._access = state_access(self._space)
        handles = [compat.new_state(self._space) for _ in range(3)]
        self._states = [compat.typed_state(handle) for handle in handles]
        self._handles = handles
        self.arcs: NDArray[np.float64] = np.zeros(16)

    def find(self, start: Pose, end: Pose) -> bool:
        for state, pose in zip(self._states, (start, end), strict=False):
            self._access.write_pose(state, *pose)
        self.length = float(self._space.distance(*self._states[:2]))
        poses = [*start, *self.interpolate(0.5), *end]
        return find_curve(*poses, self.length, RADIUS, self._reverses, self.arcs)

    def interpolate(self, t: float) -> Pose:
        start, end, state = self._states
        self._space.interpolate(start, end, t, state)
        return self._access.read_pose(state)

    def follow(self, start: Pose, t: float) -> Pose:
        left, pose = t * self.length, start
        for length, curvature in self.arcs[2 : 2 + 2 * int(self.arcs[0])].reshape(-1, 2).tolist():
            step = min(left, abs(length))
            left -= step
            pose = follow_arc(*pose, step if length > 0 else -step, curvature)
        return pose


@pytest.mark.parametrize("extent", [0.3, 1.0, 3.0, 10.0])
@pytest.mark.parametrize("kind", SPACES)
def test_arcs_are_those_that_ompl_interpolates(kind: str, extent: float) -> None:
    curves, rng = Curves(kind), np.random.default_rng(1)
    found, numbers = 0, set()
    for _ in range(400):
        poses = rng.uniform(-1, 1, (2, 3)) * (extent * RADIUS, extent * RADIUS, pi)
        start, end = map(tuple, poses.tolist())
        if not curves.find(start, end):
            continue
        found += 1
        numbers.add(int(curves.arcs[0]))
        for t in (0.1, 0.35, 0.65, 0.9):
            x, y, yaw = curves.follow(start, t)
            expected = curves.interpolate(t)
            assert (x, y) == pytest.approx(expected[:2], abs=1e-6)
            assert cos(yaw - expected[2]) == pytest.approx(1.0)
    assert found > 390
    assert numbers == {3} if kind == "Dubins" else len(numbers) > 1


@pytest.mark.parametrize("kind", SPACES)
def test_curves_of_which_arcs_are_missing(kind: str) -> None:
    curves = Curves(kind)
    turned = (RADIUS * sin(1.0), RADIUS * (1 - cos(1.0)), 1.0)
    for end in ((20.0, 0.0, 0.0), turned):
        assert curves.find((0.0, 0.0, 0.0), end)
        for t in (0.2, 0.8):
            assert curves.follow((0.0, 0.0, 0.0), t) == pytest.approx(curves.interpolate(t))


@pytest.mark.parametrize("kind", SPACES)
def test_another_curve_than_the_shortest_is_not_taken_for_it(kind: str) -> None:
    curves = Curves(kind)
    assert curves.find((0.0, 0.0, 0.0), (30.0, 5.0, 1.0))
    poses = 0.0, 0.0, 0.0, *curves.interpolate(0.5), 30.0, 5.0, 1.0
    reverses = kind == "Reeds-Shepp"
    assert find_curve(*poses, curves.length, RADIUS, reverses, curves.arcs)
    assert not find_curve(*poses, curves.length + 0.1, RADIUS, reverses, curves.arcs)
    moved = *poses[:3], poses[3] + 0.1, *poses[4:]
    assert not find_curve(*moved, curves.length, RADIUS, reverses, curves.arcs)


@pytest.mark.parametrize("ros", [False, True])
@pytest.mark.parametrize("kind", SPACES)
def test_compiled_checks_of_curves_give_the_same_answers(kind: str, ros: bool) -> None:
    rng = np.random.default_rng(2)
    free = rng.random((90, 110)) >= 0.002
    grid = GridMap(free, 0.5, (3.0, -2.0, 0.7)) if ros else GridMap(free)
    robot = Robot.rectangle(4 * grid.resolution, 2 * grid.resolution)
    plain, compiled = ShapeChecker(grid, robot), ShapeChecker(grid, robot)
    compiled.compile(curves=True)
    curves = Curves(kind)
    answers = set()
    for _ in range(200):
        points = grid.to_world(rng.uniform(20, 70, 2) + rng.uniform(-10, 10, (2, 2))).tolist()
        start, end = ((x, y, rng.uniform(-pi, pi)) for x, y in points)
        curves.find(start, end)
        curve = curves.interpolate, curves.length, curves.length / RADIUS
        answer = plain.curve_is_free(*curve)
        assert compiled.curve_is_free(*curve, kind == "Reeds-Shepp") == answer
        answers.add(answer)
    assert answers == {True, False}
