"""Poses that a tree reaches in one step: where they lie, and from which nodes."""

from __future__ import annotations

from math import cos, hypot, nan, pi

import numpy as np
import pytest

from cbagan_ompl import GridMap, Heatmap
from cbagan_ompl.robots.arcs import Pose
from cbagan_ompl.sampling.arc_extension import ArcExtension
from cbagan_ompl.sampling.headings import FOLLOWING
from cbagan_ompl.sampling.line_extension import LineExtension
from cbagan_ompl.sampling.tree_extension import TreeExtension

SIDE, RADIUS, RANGE = 64, 5.0, 20.0
GRID = GridMap(np.ones((SIDE, SIDE), bool))
NODE = (32.0, 32.0, 0.5)
WEIGHTS = (1.0, 0.5)
KINDS = ["arcs", "lines"]


def make_extension(kind: str, heatmap: Heatmap, spread: float = 0.4) -> TreeExtension:
    rng = np.random.default_rng(3)
    if kind == "arcs":
        return ArcExtension(heatmap, RADIUS, RANGE, rng)
    return LineExtension(heatmap, WEIGHTS, spread, RANGE, rng)


def make(kind: str, heading: float = nan, values: np.ndarray | None = None) -> TreeExtension:
    heatmap = Heatmap(np.ones((SIDE, SIDE)) if values is None else values, GRID)
    if heading == heading:
        heatmap = heatmap.with_heading(np.full((SIDE, SIDE), heading))
    extension = make_extension(kind, heatmap)
    extension.add(*NODE, 1)
    return extension


def poses_of(extension: TreeExtension, covered: bytearray | None = None) -> np.ndarray:
    covered = bytearray(SIDE * SIDE) if covered is None else covered
    found = [extension.propose(covered) for _ in range(300)]
    poses = []
    for pair in found:
        assert pair is not None
        assert pair[0] == NODE
        poses.append(pair[1])
    return np.array(poses)


def metric(some: Pose, other: Pose) -> float:
    """The distance of OMPL's SE(2)."""
    turn = abs((some[2] - other[2] + pi) % (2 * pi) - pi)
    return WEIGHTS[0] * hypot(some[0] - other[0], some[1] - other[1]) + WEIGHTS[1] * turn


def test_poses_along_arcs_are_in_reach() -> None:
    poses = poses_of(make("arcs"))
    ahead = (poses[:, :2] - NODE[:2]) @ (cos(NODE[2]), np.sin(NODE[2]))
    distance = np.hypot(*(poses[:, :2] - NODE[:2]).T)
    assert (distance <= RANGE).all()
    assert distance.max() > 0.9 * RANGE
    assert (np.abs((poses[:, 2] - NODE[2] + pi) % (2 * pi) - pi) <= RANGE / RADIUS).all()
    assert (ahead > 0).mean() > 0.9
    assert ((poses[:, 2] >= -pi) & (poses[:, 2] < pi)).all()


def test_poses_along_lines_are_in_reach() -> None:
    poses = poses_of(make("lines", 1.0))
    lines = poses[:, :2] - NODE[:2]
    direction = np.arctan2(lines[:, 1], lines[:, 0]) - NODE[2]
    distances = [metric(NODE, (x, y, yaw)) for x, y, yaw in poses]
    assert max(distances) <= RANGE
    assert np.hypot(*lines.T).max() > 0.9 * RANGE
    assert abs(direction.mean()) < 0.1
    assert 0.3 < direction.std() < 0.5
    assert abs((poses[:, 2] - 1.0).mean()) < 0.1
    assert ((poses[:, 2] >= -pi) & (poses[:, 2] < pi)).all()
    deviation = np.abs(poses[:, 2] - 1.0)
    assert (deviation <= FOLLOWING).mean() > 0.9
    assert deviation.max() > FOLLOWING / 3


def test_headings_along_lines_are_uniform_where_nothing_is_known() -> None:
    poses = poses_of(make("lines"))
    assert np.abs(np.exp(1j * poses[:, 2]).mean()) < 0.15


def test_the_node_of_a_line_is_the_nearest() -> None:
    heatmap = Heatmap.uniform(GRID).with_heading(np.full((SIDE, SIDE), 0.3))
    extension = make_extension("lines", heatmap, spread=1.5)
    rng = np.random.default_rng(0)
    nodes: list[Pose] = []
    for count in range(1, 40):
        x, y = rng.uniform(0, SIDE, 2)
        nodes.append((float(x), float(y), float(rng.uniform(-pi, pi))))
        extension.add(*nodes[-1], count)
    for _ in range(300):
        pair = extension.propose(bytearray(SIDE * SIDE))
        assert pair is not None
        distances = [metric(node, pair[1]) for node in nodes]
        assert metric(*pair) == pytest.approx(min(distances))
        assert min(distances) <= RANGE


@pytest.mark.parametrize("turning", [0.0, 1.0, 2.0])
def test_poses_along_arcs_follow_the_heatmap(turning: float) -> None:
    poses = poses_of(make("arcs", NODE[2] + turning))
    deviation = np.abs((poses[:, 2] - NODE[2] - turning + pi) % (2 * pi) - pi)
    assert deviation.max() <= FOLLOWING + 1e-6


@pytest.mark.parametrize("kind", KINDS)
def test_no_pose_where_the_tree_is_or_the_heatmap_is_zero(kind: str) -> None:
    covered = np.zeros((SIDE, SIDE), np.uint8)
    covered[:40] = 1
    values = np.ones((SIDE, SIDE))
    values[:, :35] = 0
    poses = poses_of(make(kind, values=values), bytearray(covered.tobytes()))
    assert (poses[:, 1] >= 40).all()
    assert (poses[:, 0] >= 35).all()
    assert make(kind).propose(bytearray(b"\1" * SIDE * SIDE)) is None


@pytest.mark.parametrize("kind", KINDS)
def test_a_tree_that_begins_anew_forgets_its_nodes(kind: str) -> None:
    extension = make(kind)
    rng = np.random.default_rng(0)
    added = {NODE}
    for count in range(2, 600):
        node = (float(rng.uniform(0, SIDE)), float(rng.uniform(0, SIDE)), 0.0)
        extension.add(*node, count)
        added.add(node)
    covered = bytearray(SIDE * SIDE)
    nodes = {pair[0] for pair in (extension.propose(covered) for _ in range(200)) if pair}
    assert nodes <= added
    assert len(nodes) > 100
    extension.add(*NODE, 1)
    assert len(poses_of(extension)) == 300, "of the only node"


@pytest.mark.parametrize("kind", KINDS)
def test_poses_off_the_map_are_not_proposed(kind: str) -> None:
    extension = make(kind)
    extension.add(1.0, 1.0, pi / 4, 1)
    for _ in range(200):
        pair = extension.propose(bytearray(SIDE * SIDE))
        assert pair is not None
        assert GRID.is_free(np.array([pair[1][:2]])).all()
        assert hypot(pair[1][0] - 1, pair[1][1] - 1) <= RANGE


@pytest.mark.parametrize("kind", KINDS)
def test_a_tree_without_nodes_has_no_extension(kind: str) -> None:
    extension = make_extension(kind, Heatmap.uniform(GRID))
    assert extension.propose(bytearray(SIDE * SIDE)) is None
