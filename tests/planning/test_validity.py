from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from cbagan_ompl import GridMap, GridMotionValidator, GridValidityChecker, PlannerError
from cbagan_ompl.planning import compat
from cbagan_ompl.planning.compat import ob, og

FRAMES = [{}, {"resolution": 0.25}, {"resolution": 0.05, "origin": (-3.0, 4.0, 0.6)}]


def space_information(grid: GridMap) -> Any:
    setup = og.SimpleSetup(compat.plane_space(*grid.bounds))
    si = setup.getSpaceInformation()
    si.setStateValidityChecker(GridValidityChecker(si, grid))
    si.setMotionValidator(GridMotionValidator(si, grid))
    si.setup()
    return si


def random_grid(frame: dict[str, Any]) -> GridMap:
    return GridMap(np.random.default_rng(0).random((30, 40)) < 0.85, **frame)


@pytest.mark.parametrize("frame", FRAMES)
def test_ompl_asks_the_grid(frame: dict[str, Any]) -> None:
    grid = random_grid(frame)
    si = space_information(grid)
    low, high = grid.bounds
    rng = np.random.default_rng(1)
    points = rng.uniform(low - 0.1 * (high - low), high + 0.1 * (high - low), (2000, 2))
    state = compat.new_state(si.getStateSpace())
    valid = []
    for x, y in points.tolist():
        state[0], state[1] = x, y
        valid.append(si.isValid(compat.typed_state(state)))
    np.testing.assert_array_equal(valid, grid.is_free(points))
    assert 0.2 < np.mean(valid) < 0.9

    other = compat.new_state(si.getStateSpace())
    answers = []
    for (x0, y0), (x1, y1) in zip(points[:500].tolist(), points[500:1000].tolist(), strict=True):
        x1, y1 = x0 + 0.1 * (x1 - x0), y0 + 0.1 * (y1 - y0)
        state[0], state[1], other[0], other[1] = x0, y0, x1, y1
        answer = si.checkMotion(compat.typed_state(state), compat.typed_state(other))
        assert answer == grid.path_is_free([(x0, y0), (x1, y1)])
        answers.append(answer)
    assert 0.1 < np.mean(answers) < 0.9


def test_answers_are_real_bools() -> None:
    """OMPL 2.0 ends the solve with std::bad_cast for anything else."""
    grid = random_grid({})
    si = space_information(grid)
    checker, validator = GridValidityChecker(si, grid), GridMotionValidator(si, grid)
    state = compat.new_state(si.getStateSpace())
    for x in (-1.0, 3.5, 20.5, 100.0):
        state[0], state[1] = x, 3.5
        typed = compat.typed_state(state)
        assert type(checker.isValid(typed)) is bool
        assert type(validator.checkMotion(typed, typed)) is bool


def test_last_valid_state() -> None:
    """OMPL 1.x passes some planners' pair to be filled in."""
    free = np.ones((10, 20), bool)
    free[:, 12:14] = False
    grid = GridMap(free)
    si = space_information(grid)
    states = [compat.new_state(si.getStateSpace()) for _ in range(3)]
    begin, end, last = (compat.typed_state(state) for state in states)
    begin[0], begin[1], end[0], end[1] = 2.0, 5.0, 18.0, 5.0
    pair = SimpleNamespace(first=last, second=0.0)
    assert not GridMotionValidator(si, grid).checkMotion(begin, end, pair)
    assert 0.62 < pair.second <= 10 / 16
    assert 11.9 < last[0] <= 12
    assert last[1] == 5


def test_curves_raise() -> None:
    space = ob.DubinsStateSpace(2.0)
    setup = og.SimpleSetup(space)
    grid = random_grid({})
    with pytest.raises(PlannerError, match=r"DubinsStateSpace are curves.*own motion validator"):
        GridMotionValidator(setup.getSpaceInformation(), grid)
    GridValidityChecker(setup.getSpaceInformation(), grid)
