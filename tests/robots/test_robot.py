"""Robots: which shapes there are, what follows from them, and what is refused."""

from __future__ import annotations

import pickle
from typing import Any

import numpy as np
import pytest

from cbagan_ompl import Robot, RobotError

SQUARE = [(0, 0), (2, 0), (2, 2), (0, 2)]
L_SHAPE = [(0, 0), (4, 0), (4, 1), (1, 1), (1, 4), (0, 4)]


@pytest.mark.parametrize(
    ("robot", "has_heading", "motion", "space"),
    [
        (Robot.point(), False, "straight", "RealVectorStateSpace"),
        (Robot.disc(2), False, "straight", "RealVectorStateSpace"),
        (Robot.rectangle(2, 1), True, "straight", "SE2StateSpace"),
        (Robot.point(3.0), True, "dubins", "DubinsStateSpace"),
        (Robot.disc(1.0, 3.0, True), True, "reeds-shepp", "ReedsSheppStateSpace"),
        (Robot.polygon(SQUARE, turning_radius=3), True, "dubins", "DubinsStateSpace"),
        (Robot.rectangle(2, 1, 3, True), True, "reeds-shepp", "ReedsSheppStateSpace"),
    ],
)
def test_the_space_follows_from_shape_and_turning_radius(
    robot: Robot, has_heading: bool, motion: str, space: str
) -> None:
    assert (robot.has_heading, robot.motion, robot.state_space) == (has_heading, motion, space)


def test_radii_of_a_rectangle() -> None:
    robot = Robot.rectangle(12, 6)
    assert robot.inscribed_radius == 3
    assert robot.circumscribed_radius == pytest.approx(np.hypot(6, 3))
    car = Robot.rectangle(12, 6, offset=5.0)
    assert car.inscribed_radius == 1
    assert car.circumscribed_radius == pytest.approx(np.hypot(11, 3))
    assert Robot.rectangle(4, 2, offset=(0, 5)).inscribed_radius == 0


def test_a_reference_point_outside_of_the_shape() -> None:
    robot = Robot.polygon(np.array(L_SHAPE) - (2, 2))
    assert not robot.contains_reference
    assert not robot.is_convex
    assert robot.inscribed_radius == 0
    assert Robot.polygon(np.array(L_SHAPE) - (0.5, 0.4)).inscribed_radius == pytest.approx(0.4)


def test_vertices_are_counter_clockwise_whichever_way_they_are_given() -> None:
    for vertices in (SQUARE, SQUARE[::-1], [*SQUARE, SQUARE[0]], [SQUARE[0], *SQUARE]):
        robot = Robot.polygon(vertices)
        assert robot.vertices is not None
        assert len(robot.vertices) == 4
        x, y = robot.vertices.T
        assert (x * np.roll(y, -1) - np.roll(x, -1) * y).sum() > 0
        with pytest.raises(ValueError, match="read-only"):
            robot.vertices[0] = 1


def test_robots_are_values() -> None:
    robot = Robot.rectangle(2, 1, 3.0)
    assert robot == Robot.rectangle(2, 1, 3.0) != Robot.rectangle(2, 1)
    assert len({robot, Robot.rectangle(2.0, 1, 3)}) == 1
    assert robot.circumscribed_radius > 1  # fills a cache, which pickling must not trip over
    assert pickle.loads(pickle.dumps(robot)) == robot


def test_outline_turns_from_x_to_y() -> None:
    outline = Robot.rectangle(4, 2, offset=1.0).outline((10, 20, np.pi / 2))
    assert np.allclose(outline, [(11, 19), (11, 23), (9, 23), (9, 19)])
    for robot, pose in ((Robot.disc(1), (0, 0, 0)), (Robot.rectangle(1, 1), (0, 0))):
        with pytest.raises(RobotError, match=r"outline|pose"):
            robot.outline(pose)


@pytest.mark.parametrize(
    ("vertices", "message"),
    [
        ([], "list of points"),
        (SQUARE[:2], "at least three"),
        ([(0, 0)] * 5, "at least three"),
        ([(0, 0), (1, 1), (2, 2)], "no area"),
        ([(0, 0), (2, 2), (2, 0), (0, 2)], "no area|crosses"),
        ([(0, 0), (4, 4), (4, 0), (0, 3)], "crosses"),
        ([(0, 0), (4, 0), (4, 4), (2, 0), (0, 4)], "touches"),
        ([(0, 0), (4, 0), (4, 4), (4, 2), (0, 2)], "crosses or touches"),
        ([(0, 0), (1, float("nan")), (2, 0)], "finite"),
        ([(0, 0), (1, float("inf")), (2, 0)], "finite"),
        ([(0, 0), (1e200, 0), (0, 1e200)], "no meaning"),
        ([(0, 0, 0), (1, 0, 0), (0, 1, 0)], "shape"),
        ([(0, 0), (1,), (0, 1)], "list of points"),
        ("square", "list of points"),
        ([("0", "0"), ("1", "0"), ("0", "1")], "list of points"),
        ([(True, False), (True, True), (False, True)], "list of points"),
        (None, "list of points"),
        ([(i, i % 2) for i in range(2000)], "at most"),
    ],
)
def test_polygons_that_are_none(vertices: Any, message: str) -> None:
    with pytest.raises(RobotError, match=message):
        Robot.polygon(vertices)


@pytest.mark.parametrize(
    "make",
    [
        lambda: Robot.disc(0),
        lambda: Robot.disc(-1),
        lambda: Robot.disc(float("nan")),
        lambda: Robot.disc("1"),  # type: ignore[arg-type]
        lambda: Robot.rectangle(0, 1),
        lambda: Robot.rectangle(1, float("inf")),
        lambda: Robot.rectangle(1, 1, offset="ahead"),  # type: ignore[arg-type]
        lambda: Robot.rectangle(1, 1, offset=(1, float("nan"))),
        lambda: Robot.rectangle(1, 1, turning_radius=0),
        lambda: Robot.rectangle(1, 1, turning_radius=-2),
        lambda: Robot.point(turning_radius=float("nan")),
        lambda: Robot.point(turning_radius=1e-320),
        lambda: Robot.point(reverse=True),
        lambda: Robot.rectangle(1, 1, 3.0, reverse="yes"),  # type: ignore[arg-type]
        lambda: Robot("ellipse"),  # type: ignore[arg-type]
        lambda: Robot("point", 2.0),
        lambda: Robot("disc", 2.0, ((0, 0), (1, 0), (0, 1))),
    ],
)
def test_values_that_make_no_sense(make: Any) -> None:
    with pytest.raises(RobotError):
        make()
