"""States whose Python object is one that a program has kept of a planner that is gone."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from cbagan_ompl import GridMap, HeadingSpread, Heatmap, Robot, plan
from cbagan_ompl.planning import compat
from cbagan_ompl.planning.compat import BOOST_PYTHON, ob, og
from cbagan_ompl.planning.states import state_access
from cbagan_ompl.planning.typed_states import TypedStates
from cbagan_ompl.sampling.headings import HeadingSampler
from cbagan_ompl.sampling.options import SamplerOptions

needs_kept_objects = pytest.mark.skipif(BOOST_PYTHON, reason="its objects are made anew each time")


def plane() -> Any:
    return bounded(ob.RealVectorStateSpace(2))


def poses() -> Any:
    return bounded(ob.SE2StateSpace())


def compound() -> Any:
    space = ob.CompoundStateSpace()
    space.addSubspace(poses(), 1.0)
    space.addSubspace(ob.SO2StateSpace(), 0.1)
    return space


def bounded(space: Any) -> Any:
    bounds = ob.RealVectorBounds(2)
    bounds.setLow(0)
    bounds.setHigh(100)
    space.setBounds(bounds)
    return space


def keep_states(space: Any) -> list[Any]:
    """Return objects of the states of a tree that is freed."""
    setup = og.SimpleSetup(space)
    setup.setStateValidityChecker(compat.validity_function(lambda _state: True))
    start, goal = compat.new_state(space), compat.new_state(space)
    for state, x in ((start, 1.0), (goal, 90.0)):
        state_access(space).write_pose(compat.typed_state(state), x, x, 0.0)
    setup.setStartAndGoalStates(start, goal, 1e-9)
    planner = og.RRT(setup.getSpaceInformation())
    planner.setRange(0.5)
    setup.setPlanner(planner)
    setup.solve(0.05)
    data = compat.planner_data(planner)
    return [data.getVertex(i).getState() for i in range(data.numVertices())]


def mistyped_state(space: Any, others: list[Any]) -> Any:
    """Return a state of the space that looks like one of another space."""
    right = type(compat.typed_state(compat.new_state(space)))
    for _ in range(20000):
        others.append(space.allocState())
        if not isinstance(others[-1], right):
            return others[-1]
    pytest.fail("no state at the address of a kept one")


@needs_kept_objects
@pytest.mark.parametrize(
    ("before", "now"), [(poses, plane), (plane, poses), (plane, compound), (compound, plane)]
)
def test_a_mistyped_state_is_read_and_written(
    before: Callable[[], Any], now: Callable[[], Any]
) -> None:
    kept, space = keep_states(before()), now()
    others: list[Any] = []
    state, access = mistyped_state(space, others), state_access(space)
    access.write_pose(state, 3.0, 4.0, 0.5)
    assert access.read(state) == (3.0, 4.0)
    assert access.read_pose(state) == (3.0, 4.0, 0.0 if space.getDimension() == 2 else 0.5)
    assert not isinstance(state, TypedStates(space).type), "it would show nothing"
    copy = compat.typed_state(compat.new_state(space))
    space.copyState(copy, state)
    assert access.read_pose(copy) == access.read_pose(state), "OMPL sees the same"
    del kept


@needs_kept_objects
def test_a_sample_goes_into_a_mistyped_state() -> None:
    heatmap = Heatmap.uniform(GridMap.load("bundled:rooms"))
    headings = HeadingSampler(heatmap, HeadingSpread(), SamplerOptions(seed=1).generator(), False)
    kept, space = keep_states(plane()), poses()
    others: list[Any] = []
    state, access = mistyped_state(space, others), state_access(space, headings)
    access.write(state, 30.0, 40.0)
    assert access.read(state) == (30.0, 40.0)
    del kept


@needs_kept_objects
@pytest.mark.parametrize("sampler", ["uniform", "corridor"])
@pytest.mark.parametrize("planner", ["RRTstar", "RRTConnect", "PRM"])
def test_plans_beside_kept_states(planner: str, sampler: str) -> None:
    for space, ends, robot in (
        (poses(), ((30, 30), (60, 60)), None),
        (plane(), ((30, 30, 0), (60, 60, 0)), Robot.rectangle(6, 3)),
    ):
        kept = keep_states(space)
        result = plan("bundled:rooms", *ends, planner, sampler, robot=robot, time=0.5, seed=1)
        assert result.solved
        del kept


@needs_kept_objects
def test_a_new_state_has_the_type_of_its_space() -> None:
    kept, space = keep_states(poses()), plane()
    states = [compat.new_state(space) for _ in range(5000)]
    assert {type(state) for state in states} == {ob.RealVectorStateType}
    del kept
