"""Poses that a tree reaches along two arcs: where they lie, and from which nodes."""

from __future__ import annotations

from math import cos, hypot, nan, pi

import numpy as np
import pytest

from cbagan_ompl import GridMap, Heatmap
from cbagan_ompl.sampling.headings import FOLLOWING
from cbagan_ompl.sampling.tree_extension import TreeExtension

SIDE, RADIUS, RANGE = 64, 5.0, 20.0
GRID = GridMap(np.ones((SIDE, SIDE), bool))
NODE = (32.0, 32.0, 0.5)


def make(heading: float = nan, values: np.ndarray | None = None) -> TreeExtension:
    heatmap = Heatmap(np.ones((SIDE, SIDE)) if values is None else values, GRID)
    if heading == heading:
        heatmap = heatmap.with_heading(np.full((SIDE, SIDE), heading))
    rng = np.random.default_rng(3)
    extension = TreeExtension(heatmap, RADIUS, RANGE, rng)
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


def test_poses_are_in_reach() -> None:
    poses = poses_of(make())
    ahead = (poses[:, :2] - NODE[:2]) @ (cos(NODE[2]), np.sin(NODE[2]))
    distance = np.hypot(*(poses[:, :2] - NODE[:2]).T)
    assert (distance <= RANGE).all()
    assert distance.max() > 0.9 * RANGE
    assert (np.abs((poses[:, 2] - NODE[2] + pi) % (2 * pi) - pi) <= RANGE / RADIUS).all()
    assert (ahead > 0).mean() > 0.9
    assert ((poses[:, 2] >= -pi) & (poses[:, 2] < pi)).all()


@pytest.mark.parametrize("turning", [0.0, 1.0, 2.0])
def test_poses_follow_the_heatmap(turning: float) -> None:
    poses = poses_of(make(NODE[2] + turning))
    deviation = np.abs((poses[:, 2] - NODE[2] - turning + pi) % (2 * pi) - pi)
    assert deviation.max() <= FOLLOWING + 1e-6


def test_no_pose_where_the_tree_is_or_the_heatmap_is_zero() -> None:
    covered = np.zeros((SIDE, SIDE), np.uint8)
    covered[:40] = 1
    values = np.ones((SIDE, SIDE))
    values[:, :35] = 0
    poses = poses_of(make(values=values), bytearray(covered.tobytes()))
    assert (poses[:, 1] >= 40).all()
    assert (poses[:, 0] >= 35).all()
    assert make().propose(bytearray(b"\1" * SIDE * SIDE)) is None


def test_a_tree_that_begins_anew_forgets_its_nodes() -> None:
    extension = make()
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


def test_poses_off_the_map_are_not_proposed() -> None:
    extension = make()
    extension.add(1.0, 1.0, pi / 4, 1)
    for _ in range(200):
        pair = extension.propose(bytearray(SIDE * SIDE))
        assert pair is not None
        assert GRID.is_free(np.array([pair[1][:2]])).all()
        assert hypot(pair[1][0] - 1, pair[1][1] - 1) <= RANGE


def test_a_tree_without_nodes_has_no_extension() -> None:
    heatmap = Heatmap.uniform(GRID)
    extension = TreeExtension(heatmap, RADIUS, RANGE, np.random.default_rng(0))
    assert extension.propose(bytearray(SIDE * SIDE)) is None
