"""Samples that a planner's tree reaches in one step, for robots that drive forwards alone."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from cbagan_ompl import GridMap, HeadingSpread, Heatmap, attach
from cbagan_ompl.planning import compat
from cbagan_ompl.planning.compat import ob, og, ou
from cbagan_ompl.planning.pose_extension import PoseExtension, pose_extension
from cbagan_ompl.sampling.adaptation import AdaptiveMixture
from cbagan_ompl.sampling.monitor import NoMonitor
from cbagan_ompl.sampling.options import FULL_ADAPTATION, NO_ADAPTATION
from cbagan_ompl.sampling.sampler import HeatmapSampler

SIDE, RADIUS, RANGE = 128, 6.0, 15.0
FREE = np.ones((SIDE, SIDE), bool)
FREE[:96, 60:68] = False


class _Wall(ob.StateValidityChecker):  # type: ignore[misc]
    def isValid(self, state: Any) -> bool:  # noqa: N802
        x, y = state.getX(), state.getY()
        return 0 <= x < SIDE and 0 <= y < SIDE and bool(FREE[int(y), int(x)])


@pytest.fixture(autouse=True)
def quiet() -> None:
    ou.setLogLevel(ou.LOG_ERROR)
    compat.seed_ompl(1)


def set_pose(space: Any, x: float, y: float, yaw: float) -> Any:
    handle = compat.new_state(space)
    typed = compat.typed_state(handle)
    typed.setX(x)
    typed.setY(y)
    typed.setYaw(yaw)
    return handle


def make_setup(kind: str, planner: str = "RRTstar") -> Any:
    make = getattr(ob, f"{kind}StateSpace")
    space = make() if kind == "SE2" else make(RADIUS)
    bounds = ob.RealVectorBounds(2)
    bounds.setLow(0.0)
    bounds.setHigh(float(SIDE))
    space.setBounds(bounds)
    setup = og.SimpleSetup(space)
    si = setup.getSpaceInformation()
    setup.setStateValidityChecker(_Wall(si))
    setup.setStartAndGoalStates(
        set_pose(space, 20.0, 20.0, 1.0), set_pose(space, 110.0, 20.0, -1.0), 1.0
    )
    setup.setPlanner(getattr(og, planner)(si))
    setup.getPlanner().setRange(RANGE)
    return setup


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


def solve(setup: Any, samples: int) -> None:
    left = iter(range(samples))
    setup.solve(compat.termination_condition(lambda: next(left, None) is None))


@pytest.mark.parametrize("planner", ["RRT", "RRTstar"])
def test_learned_samples_before_the_first_path_extend_the_tree(
    planner: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    setup = make_setup("Dubins", planner)
    records = _Records(monkeypatch, setup)
    heatmap = Heatmap.corridor(GridMap(FREE), (20, 20), (110, 20))
    with attach(setup, heatmap, seed=1) as attachment:
        solve(setup, 4000)
        counts = attachment.sample_counts
    assert setup.haveExactSolutionPath()
    assert records.found > 5
    assert records.calls <= counts["learned"]
    assert counts["uniform"] > 0
    assert records.calls_with_path == 0, "samples follow the heat map after the first path"


@pytest.mark.parametrize(
    ("kind", "options"),
    [
        ("SE2", {}),
        ("ReedsShepp", {}),
        ("Dubins", {"adaptation": NO_ADAPTATION}),
        ("Dubins", {"heading": HeadingSpread(uniform_fraction=1)}),
    ],
)
def test_who_has_no_extension(
    kind: str, options: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    setup = make_setup(kind)
    records = _Records(monkeypatch, setup)
    with attach(setup, Heatmap.uniform(GridMap(FREE)), seed=1, **options) as attachment:
        solve(setup, 300)
        assert sum(attachment.sample_counts.values()) > 0
    assert records.calls == 0


def test_a_heatmap_that_does_not_connect_is_not_extended(monkeypatch: pytest.MonkeyPatch) -> None:
    setup = make_setup("Dubins")
    records = _Records(monkeypatch, setup)
    values = np.where(FREE, 1.0, 0.0)
    values[:, 40:90] = 0
    with attach(setup, Heatmap(values, GridMap(FREE)), seed=1):
        solve(setup, 1000)
    assert records.found == 0


def test_poses_that_are_reached_in_collision_are_not_taken() -> None:
    setup = make_setup("Dubins")
    heatmap = Heatmap.uniform(GridMap(FREE))
    setup.setup()
    mixture = AdaptiveMixture(heatmap, FULL_ADAPTATION, 5.0, NoMonitor())
    sampler = HeatmapSampler(heatmap, seed=1, mixture=mixture)
    extension = pose_extension(setup.getPlanner(), sampler)
    assert extension is not None
    space, si = setup.getStateSpace(), setup.getSpaceInformation()
    handle = set_pose(space, 55.0, 40.0, 0.0)  # before the wall, heading for it
    node, other = compat.typed_state(handle), set_pose(space, 0.0, 0.0, 0.0)
    extension.add(node, 1)
    found = 0
    for _ in range(50):
        state = compat.typed_state(other)
        if extension.move(state):
            found += 1
            assert si.checkMotion(node, state)
            assert state.getX() < 60
    assert found > 0
