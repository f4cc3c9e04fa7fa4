"""Heat maps of robots with heading: the way where the robot fits, samples wherever it may be."""

from __future__ import annotations

import numpy as np
import pytest

from cbagan_ompl import GridMap, Heatmap, Predictor, Robot, RobotError, TaskError, load_model, plan
from cbagan_ompl.robots.poses import passable_map, position_map
from cbagan_ompl.robots.shape_checker import ShapeChecker
from cbagan_ompl.sampling.robot_heatmaps import robot_heatmap

ROBOT = Robot.rectangle(12, 6)
START, GOAL = (20.0, 20.0, 0.0), (108.0, 20.0, 0.0)


@pytest.fixture(scope="module")
def two_gaps() -> GridMap:
    """A wall with a gap on the straight way that is too narrow for the robot, and a wide one."""
    free = np.ones((128, 128), bool)
    free[:, 62:66] = False
    free[18:23, 62:66] = True  # five pixels: less than the robot is wide
    free[90:110, 62:66] = True
    return GridMap(free, name="two gaps")


def test_the_way_leads_through_the_gap_in_which_the_robot_fits(two_gaps: GridMap) -> None:
    for source in (Heatmap.corridor, load_model().predict):
        heatmap = source(two_gaps, START, GOAL, robot=ROBOT)
        assert heatmap.grid is position_map(two_gaps, ROBOT)
        assert heatmap.grid.free[20, 64], "the robot may stand there, if it is turned"
        assert heatmap.values[20, 63:65].max() == 0
        assert heatmap.values[95:105, 63:65].max() >= 0.5
        assert heatmap.connects(START[:2], GOAL[:2])


def test_where_only_the_narrow_gap_connects(two_gaps: GridMap) -> None:
    free = two_gaps.free.copy()
    free[90:110, 62:66] = False
    grid = GridMap(free)
    assert passable_map(grid, ROBOT, START[:2], GOAL[:2]) is position_map(grid, ROBOT)
    heatmap = Heatmap.corridor(grid, START, GOAL, robot=ROBOT)
    assert heatmap.values[20, 63:65].max() >= 0.5


def test_the_way_does_not_lead_along_the_border() -> None:
    free = np.ones((128, 128), bool)
    free[5:60, 62:66] = False  # a disc inside the robot passes between wall and border
    grid = GridMap(free)
    assert position_map(grid, ROBOT).free[64, 1:4].tolist() == [False, True, True]
    for source in (Heatmap.corridor, load_model().predict):
        heatmap = source(grid, START, GOAL, robot=ROBOT)
        assert heatmap.values[:5, 63:65].max() == 0
        assert heatmap.values[62:75, 64].max() >= 0.5


@pytest.mark.parametrize("yaw", [0.0, 0.3, 1.1, np.pi / 2, 2.5])
def test_every_place_of_the_robot_is_a_position(yaw: float) -> None:
    """Also next to the border, for a reference point off the middle."""
    rng = np.random.default_rng(2)
    robot = Robot.rectangle(9, 5, offset=1.5)
    grid = GridMap(rng.random((40, 40)) > 0.003)
    checker, positions = ShapeChecker.of(grid, robot), position_map(grid, robot)
    points = rng.uniform(0, 40, (3000, 2))
    fits = [checker.pose_is_free(*point, yaw) for point in points.tolist()]
    assert 50 < sum(fits) < 2500
    assert positions.is_free(points[fits]).all()


def test_tasks_of_both_kinds_in_one_call(two_gaps: GridMap, predictor: Predictor) -> None:
    beside = (20.0, 3.0, 0.0)  # nearer to the border of the wall than the inscribed radius
    free = two_gaps.free.copy()
    free[0] = False
    grid = GridMap(free)
    goals = [GOAL, (21.0, 100.0, 0.0)]
    starts = [beside, START]
    assert passable_map(grid, ROBOT, beside[:2], GOAL[:2]) is position_map(grid, ROBOT)
    together = predictor.predict_many(grid, starts, goals, robot=ROBOT)
    for heatmap, start, goal in zip(together, starts, goals, strict=True):
        alone = predictor.predict(grid, start, goal, robot=ROBOT)
        assert np.abs(heatmap.values - alone.values).max() < 1e-4
        assert heatmap.grid is position_map(grid, ROBOT)


@pytest.fixture(scope="module")
def predictor() -> Predictor:
    return load_model()


def test_robots_without_heading_keep_their_map(two_gaps: GridMap) -> None:
    disc = Robot.disc(2.0)
    assert passable_map(two_gaps, disc, START[:2], GOAL[:2]) is position_map(two_gaps, disc)


def test_plan_uses_both_maps(two_gaps: GridMap) -> None:
    result = plan(
        two_gaps, START, GOAL, planner="RRT", sampler="corridor", robot=ROBOT, seed=1, range=20,
        time=20,
    )  # fmt: skip
    assert result.solved
    assert result.heatmap is not None
    assert result.heatmap.values[20, 63:65].max() == 0
    own = Heatmap.uniform(position_map(two_gaps, ROBOT))
    kept = plan(two_gaps, START, GOAL, planner="RRT", heatmap=own, robot=ROBOT, seed=1, time=20)
    assert kept.heatmap is not None
    assert np.array_equal(kept.heatmap.values, own.values), "the own one is taken as it is"


def test_bad_input(two_gaps: GridMap) -> None:
    with pytest.raises(RobotError):
        robot_heatmap(Heatmap.corridor, two_gaps, "rectangle", START, GOAL)  # type: ignore[arg-type]
    with pytest.raises(TaskError, match="start"):
        robot_heatmap(Heatmap.corridor, two_gaps, ROBOT, (-5.0, 0.0, 0.0), GOAL)
