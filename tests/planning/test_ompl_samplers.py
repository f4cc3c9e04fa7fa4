"""The samplers on their own, as OMPL calls them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from helpers.tasks import GOAL, START

from cbagan_ompl import (
    ConfigError,
    GridMap,
    GridValidityChecker,
    Heatmap,
    HeatmapError,
    HeatmapStateSampler,
    HeatmapValidStateSampler,
    state_sampler_allocator,
    valid_state_sampler_allocator,
)
from cbagan_ompl.planning import compat
from cbagan_ompl.planning.compat import ob, og


class Fake:
    """Stands for a state, so that samplers can be asked without a planner."""

    def __init__(self, x: float = 0.0, y: float = 0.0) -> None:
        self.values = [x, y]

    def __getitem__(self, axis: int) -> float:
        return self.values[axis]

    def __setitem__(self, axis: int, value: float) -> None:
        assert type(value) is float, "OMPL takes no NumPy scalars"
        self.values[axis] = value


@pytest.fixture
def sampler(two_walls: GridMap, corridor: Heatmap) -> Any:
    space = compat.plane_space(*two_walls.bounds)
    return HeatmapStateSampler(space, corridor, uniform_fraction=0.1, seed=4)


def test_all_three_methods(corridor: Heatmap, sampler: Any) -> None:
    state = Fake()
    seen = np.empty((500, 2))
    for i in range(len(seen)):
        sampler.sampleUniform(state)
        seen[i] = state.values
    heat = corridor.values[tuple(seen.astype(int).T[::-1])]
    assert heat.mean() > 0.4
    for _ in range(100):
        sampler.sampleUniformNear(state, Fake(20, 20), 15.0)
        assert max(abs(state[0] - 20), abs(state[1] - 20)) <= 15
        sampler.sampleGaussian(state, Fake(20, 20), 3.0)
        assert max(abs(state[0] - 20), abs(state[1] - 20)) <= 20
    sampler.sampleUniformNear(state, Fake(0, 0), 1e-6)
    assert min(state.values) >= 0, "samples stay in the bounds of the space"
    assert sum(sampler.sample_counts.values()) == 701


def test_same_seed_same_draws(two_walls: GridMap, corridor: Heatmap) -> None:
    space = compat.plane_space(*two_walls.bounds)
    samples = []
    for _ in range(2):
        sampler, state = HeatmapStateSampler(space, corridor, seed=9), Fake()
        sampler.sampleUniform(state)
        samples.append(state.values)
    assert samples[0] == samples[1]


def test_bad_fraction(two_walls: GridMap, corridor: Heatmap) -> None:
    with pytest.raises(ConfigError, match="uniform_fraction"):
        HeatmapStateSampler(compat.plane_space(*two_walls.bounds), corridor, uniform_fraction=0)


def make_setup(grid: GridMap) -> Any:
    setup = og.SimpleSetup(compat.plane_space(*grid.bounds))
    si = setup.getSpaceInformation()
    setup.setStateValidityChecker(GridValidityChecker(si, grid))
    endpoints = compat.new_state(setup.getStateSpace()), compat.new_state(setup.getStateSpace())
    for endpoint, point in zip(endpoints, (START, GOAL), strict=True):
        endpoint[0], endpoint[1] = point
    setup.setStartAndGoalStates(*endpoints, 2.0)
    return setup


def test_valid_state_sampler_by_hand(two_walls: GridMap, corridor: Heatmap) -> None:
    """The drop-in without attach: the documented OMPL calls, our allocator."""
    made: list[HeatmapValidStateSampler] = []

    def allocate(si: Any) -> HeatmapValidStateSampler:
        made.append(HeatmapValidStateSampler(si, corridor, seed=1))
        return made[-1]

    setup = make_setup(two_walls)
    si = setup.getSpaceInformation()
    si.setValidStateSamplerAllocator(compat.valid_state_sampler_allocator(allocate))
    setup.setPlanner(og.PRM(si))
    assert compat.is_exact(setup.solve(2.0))
    assert made[0].sample_counts["learned"] > 10
    compat.clear_valid_state_sampler(si)


def test_allocators(two_walls: GridMap, corridor: Heatmap) -> None:
    setup = make_setup(two_walls)
    si = setup.getSpaceInformation()
    si.setValidStateSamplerAllocator(valid_state_sampler_allocator(corridor, seed=1))
    sampler = si.allocValidStateSampler()
    state = compat.new_state(setup.getStateSpace())
    typed = compat.typed_state(state)
    for _ in range(50):
        assert sampler.sample(typed)
        assert two_walls.is_free((typed[0], typed[1]))
    compat.clear_valid_state_sampler(si)
    if compat.HAS_STATE_SAMPLER_ALLOCATOR:
        setup.getStateSpace().setStateSamplerAllocator(state_sampler_allocator(corridor, seed=1))
        sampler = setup.getStateSpace().allocStateSampler()
        sampler.sampleUniform(typed)
        assert two_walls.is_free((typed[0], typed[1]))
        setup.getStateSpace().clearStateSamplerAllocator()
    else:
        assert callable(state_sampler_allocator(corridor))


def test_valid_state_sampler_obeys_the_validity_checker(
    two_walls: GridMap, corridor: Heatmap
) -> None:
    """A user's checker may be stricter than the map."""
    setup = make_setup(two_walls)
    setup.setStateValidityChecker(compat.validity_function(lambda state: state[0] < 100))
    si = setup.getSpaceInformation()
    sampler = HeatmapValidStateSampler(si, corridor, seed=1)
    state = compat.new_state(setup.getStateSpace())
    typed = compat.typed_state(state)
    for _ in range(100):
        assert sampler.sample(typed)
        assert typed[0] < 100
    setup.setStateValidityChecker(compat.validity_function(lambda state: False))
    sampler.setNrAttempts(5)
    assert not sampler.sample(typed)
    assert issubclass(HeatmapValidStateSampler, ob.ValidStateSampler)


def test_a_script_can_ask_for_samples(two_walls: GridMap, corridor: Heatmap) -> None:
    """With the kind of state that a script makes: ob.State on OMPL 1.7."""
    setup = make_setup(two_walls)
    space = setup.getStateSpace()
    state, near = compat.new_state(space), compat.new_state(space)
    near[0], near[1] = 20.0, 20.0
    sampler = HeatmapStateSampler(space, corridor, seed=1)
    sampler.sampleUniform(state)
    sampler.sampleUniformNear(state, near, 5.0)
    assert max(abs(state[0] - 20), abs(state[1] - 20)) <= 5
    sampler.sampleGaussian(state, near, 1.0)
    valid = HeatmapValidStateSampler(setup.getSpaceInformation(), corridor, seed=1)
    assert valid.sample(state)
    assert valid.sampleNear(state, near, 5.0)
    assert max(abs(state[0] - 20), abs(state[1] - 20)) <= 5


def test_draws_stay_in_the_bounds_of_the_space(two_walls: GridMap, corridor: Heatmap) -> None:
    low, high = np.array([50.0, 80.0]), np.array([180.0, 145.0])
    sampler, state = HeatmapStateSampler(compat.plane_space(low, high), corridor, seed=1), Fake()
    for _ in range(500):
        sampler.sampleUniform(state)
        assert (low <= state.values).all()
        assert (state.values <= high).all()
        sampler.sampleUniformNear(state, Fake(60, 81), 20.0)
        assert (low <= state.values).all()
    elsewhere = compat.plane_space(np.array([-50.0, 0.0]), np.array([-5.0, 10.0]))
    with pytest.raises(HeatmapError, match="coordinates of the map"):
        HeatmapStateSampler(elsewhere, corridor)
