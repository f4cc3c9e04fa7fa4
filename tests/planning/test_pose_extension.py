"""Samples that a planner's tree reaches in one step, for robots with a heading."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from helpers.poses import SIDE, make_setup, new_pose
from helpers.setups import solve_for

from cbagan_ompl import GridMap, HeadingSpread, Heatmap, attach
from cbagan_ompl.planning import compat
from cbagan_ompl.planning.compat import ob, ou
from cbagan_ompl.planning.pose_extension import PoseExtension, pose_extension
from cbagan_ompl.sampling.adaptation import AdaptiveMixture
from cbagan_ompl.sampling.monitor import NoMonitor
from cbagan_ompl.sampling.options import FULL_ADAPTATION, NO_ADAPTATION
from cbagan_ompl.sampling.sampler import HeatmapSampler

FREE = np.ones((SIDE, SIDE), bool)
FREE[:96, 60:68] = False
START, GOAL = (20.0, 20.0, 1.0), (110.0, 20.0, -1.0)


@pytest.fixture(autouse=True)
def quiet() -> None:
    ou.setLogLevel(ou.LOG_ERROR)
    compat.seed_ompl(1)


def is_free(x: float, y: float) -> bool:
    return 0 <= x < SIDE and 0 <= y < SIDE and bool(FREE[int(y), int(x)])


def setup_of(kind: str, planner: str = "RRTstar") -> Any:
    return make_setup(kind, planner, (START, GOAL), is_free)


class _Records:
    """What :meth:`PoseExtension.move` has done."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, setup: Any) -> None:
        self.found = self.calls = self.calls_with_path = 0
        move = PoseExtension.move

        def record(extension: PoseExtension, state: Any) -> bool:
            self.calls += 1
            self.calls_with_path += setup.getProblemDefinition().hasExactSolution()
            result = move(extension, state)
            self.found += result
            if result:
                assert setup.getSpaceInformation().isValid(state)
            return result

        monkeypatch.setattr(PoseExtension, "move", record)


@pytest.mark.parametrize("kind", ["SE2", "Dubins"])
@pytest.mark.parametrize("planner", ["RRT", "RRTstar"])
def test_learned_samples_before_the_first_path_extend_the_tree(
    kind: str, planner: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    setup = setup_of(kind, planner)
    records = _Records(monkeypatch, setup)
    heatmap = Heatmap.corridor(GridMap(FREE), (20, 20), (110, 20))
    with attach(setup, heatmap, seed=1) as attachment:
        solve_for(setup, 4000)
        counts = attachment.sample_counts
    assert setup.haveExactSolutionPath()
    assert records.found > 5
    assert records.calls <= counts["learned"]
    assert counts["uniform"] > 0
    assert records.calls_with_path == 0, "samples follow the heat map after the first path"


@pytest.mark.parametrize(
    ("kind", "options"),
    [
        ("SE2", {"adaptation": NO_ADAPTATION}),
        ("ReedsShepp", {}),
        ("Dubins", {"adaptation": NO_ADAPTATION}),
        ("Dubins", {"heading": HeadingSpread(uniform_fraction=1)}),
    ],
)
def test_who_has_no_extension(
    kind: str, options: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    setup = setup_of(kind)
    records = _Records(monkeypatch, setup)
    with attach(setup, Heatmap.uniform(GridMap(FREE)), seed=1, **options) as attachment:
        solve_for(setup, 300)
        assert sum(attachment.sample_counts.values()) > 0
    assert records.calls == 0


def test_a_heatmap_that_does_not_connect_is_not_extended(monkeypatch: pytest.MonkeyPatch) -> None:
    setup = setup_of("Dubins")
    records = _Records(monkeypatch, setup)
    values = np.where(FREE, 1.0, 0.0)
    values[:, 40:90] = 0
    with attach(setup, Heatmap(values, GridMap(FREE)), seed=1):
        solve_for(setup, 1000)
    assert records.found == 0


def extension_of(setup: Any) -> PoseExtension | None:
    heatmap = Heatmap.uniform(GridMap(FREE))
    setup.setup()
    mixture = AdaptiveMixture(heatmap, FULL_ADAPTATION, 5.0, NoMonitor())
    sampler = HeatmapSampler(heatmap, seed=1, mixture=mixture)
    return pose_extension(setup.getPlanner(), sampler)


@pytest.mark.parametrize("kind", ["SE2", "Dubins"])
def test_poses_that_are_reached_in_collision_are_not_taken(kind: str) -> None:
    setup = setup_of(kind)
    extension = extension_of(setup)
    assert extension is not None
    space, si = setup.getStateSpace(), setup.getSpaceInformation()
    handle = new_pose(space, (55.0, 40.0, 0.0))  # before the wall, heading for it
    node, other = compat.typed_state(handle), new_pose(space, (0.0, 0.0, 0.0))
    extension.add(node, 1)
    found = 0
    for _ in range(50):
        state = compat.typed_state(other)
        if extension.move(state):
            found += 1
            assert si.checkMotion(node, state)
            assert state.getX() < 60
    assert found > 0


@pytest.mark.parametrize("kind", ["SE2", "Dubins"])
def test_poses_out_of_bounds_are_not_taken(kind: str) -> None:
    setup = setup_of(kind)
    bounds = ob.RealVectorBounds(2)
    bounds.setLow(0.0)
    bounds.setHigh(50.0)  # the heat map goes on beyond
    setup.getStateSpace().setBounds(bounds)
    extension = extension_of(setup)
    assert extension is not None
    handle = new_pose(setup.getStateSpace(), (45.0, 40.0, 0.0))
    state = compat.typed_state(handle)
    extension.add(state, 1)
    found = [(state.getX(), state.getY()) for _ in range(50) if extension.move(state)]
    assert len(found) > 0
    assert np.max(found) <= 50


def test_positions_without_weight_are_not_extended() -> None:
    setup = setup_of("SE2")
    setup.getStateSpace().setSubspaceWeight(0, 0.0)
    assert extension_of(setup) is None
