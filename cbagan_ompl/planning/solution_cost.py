"""The cost of a planner's best solution, whatever its objective is."""

from __future__ import annotations

from math import inf, isfinite, nan
from typing import Any

from .compat import ob


class SolutionCost:
    """The best cost of a planner as a number that falls with each better solution.

    Costs of OMPL are compared by their objective alone: some are to be large, and what stands for
    no solution differs. The number is the cost itself where costs are path lengths. For other
    objectives it begins at 0 and falls by 1 with each better solution.

    Args:
        problem: the problem definition of the planner.
    """

    def __init__(self, problem: Any) -> None:
        self._problem = problem
        self._value, self._best = nan, inf
        self._cost: Any = None

    def best(self, cost: Any) -> float:
        """Return the number of the best solution, infinite before there is one.

        Args:
            cost: what the planner says is its best cost, an ``ob.Cost``.
        """
        value: float = cost.value()
        if value != self._value:
            self._value = value
            self._best = self._number(cost)
        return self._best

    def _number(self, cost: Any) -> float:
        objective = self._problem.getOptimizationObjective()
        value: float = cost.value()
        if objective is None or isinstance(objective, ob.PathLengthOptimizationObjective):
            return value if isfinite(value) else inf
        if not objective.isFinite(cost):
            return inf
        before, self._cost = self._cost, cost
        if self._best == inf:
            return 0.0
        return self._best + (-1 if objective.isCostBetterThan(cost, before) else 1)
