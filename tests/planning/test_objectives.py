"""Objectives other than the length: costs are compared by the objective alone."""

from __future__ import annotations

from math import inf
from typing import Any

import pytest
from helpers.setups import small_heatmap, small_setup, small_walls, solve_for

from cbagan_ompl import attach
from cbagan_ompl.planning import compat
from cbagan_ompl.planning.compat import ob, ou
from cbagan_ompl.planning.solution_cost import SolutionCost

GRID = small_walls()
HEATMAP = small_heatmap(GRID)


class NearTheMiddle(ob.StateCostIntegralObjective):  # type: ignore[misc]
    """The integral of a cost of states."""

    def __init__(self, si: Any) -> None:
        super().__init__(si, False)

    def stateCost(self, state: Any) -> Any:  # noqa: N802
        return ob.Cost(1 + 10 / (1 + abs(state[1] - 30.0)))


class WidestWay(ob.OptimizationObjective):  # type: ignore[misc]
    """The least worth of a path's states, which is to be large; no path is worth -infinity."""

    def stateCost(self, state: Any) -> Any:  # noqa: N802
        return ob.Cost(64 - abs(state[0] - 32))

    def motionCost(self, s1: Any, s2: Any) -> Any:  # noqa: N802
        return ob.Cost(64 - max(abs(s1[0] - 32), abs(s2[0] - 32)))

    def combineCosts(self, c1: Any, c2: Any) -> Any:  # noqa: N802
        return c1 if c1.value() < c2.value() else c2

    def isCostBetterThan(self, c1: Any, c2: Any) -> bool:  # noqa: N802
        return bool(c1.value() > c2.value())

    def identityCost(self) -> Any:  # noqa: N802
        return ob.Cost(inf)

    def infiniteCost(self) -> Any:  # noqa: N802
        return ob.Cost(-inf)


@pytest.fixture(autouse=True)
def quiet() -> None:
    ou.setLogLevel(ou.LOG_NONE)


def count_solved(objective: type, planner: str, runs: int, is_attached: bool) -> int:
    solved = 0
    for seed in range(runs):
        compat.seed_ompl(seed)
        setup = small_setup(GRID, planner)
        setup.setOptimizationObjective(objective(setup.getSpaceInformation()))
        attachment = attach(setup, HEATMAP, seed=seed) if is_attached else None
        solved += compat.is_exact(solve_for(setup, 600))
        if attachment is not None:
            attachment.detach()
    return solved


@pytest.mark.parametrize(
    ("objective", "runs", "planner"),
    [
        (NearTheMiddle, 1, "RRTstar"),
        (WidestWay, 12, "RRTstar"),
        (WidestWay, 12, "InformedRRTstar"),
    ],
)
def test_objectives_are_solved_as_often_as_without_us(
    objective: type, runs: int, planner: str
) -> None:
    without = count_solved(objective, planner, runs, False)
    assert count_solved(objective, planner, runs, True) >= without > runs / 2


def numbers(objective: Any, costs: list[float]) -> list[float]:
    setup = small_setup(GRID, "RRTstar")
    problem = setup.getProblemDefinition()
    problem.setOptimizationObjective(objective(setup.getSpaceInformation()))
    best = SolutionCost(problem)
    return [best.best(ob.Cost(cost)) for cost in costs]


def test_the_number_of_a_solution_falls_with_each_better_one() -> None:
    nan = float("nan")
    length = ob.PathLengthOptimizationObjective
    assert numbers(length, [inf, 9.0, 7.0, 7.0, nan, 8.0]) == [inf, 9.0, 7.0, 7.0, inf, 8.0]
    found = numbers(WidestWay, [-inf, 30.0, 30.0, 40.0, 35.0, -inf, 10.0])
    assert found == [inf, 0.0, 0.0, -1.0, 0.0, inf, 0.0]
