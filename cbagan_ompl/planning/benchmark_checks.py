"""The checks of OMPL's Benchmark, which see what its log does not tell of a run."""

from __future__ import annotations

from typing import Any

from .compat import ob
from .hooks import counts_iterations
from .improvements import Improvement
from .interrupt_guard import InterruptGuard
from .monitor import CostHistory

# Collision checks between two looks at the best cost: about six iterations of RRT*, half a
# millisecond.
_LOOK_EVERY = 32


class GuardedChecker(ob.StateValidityChecker):  # type: ignore[misc]
    """Call nothing valid any more once the guard has tripped, so that runs end at once."""

    def __init__(self, si: Any, checker: Any, guard: InterruptGuard) -> None:
        super().__init__(si)
        self._is_valid = checker.isValid
        self._guard = guard

    def isValid(self, state: Any) -> bool:  # noqa: N802
        """Return whether a state is valid, False after an interrupt."""
        return not self._guard.tripped and bool(self._is_valid(state))


class WatchedMotions(ob.MotionValidator):  # type: ignore[misc]
    """Count the checks of a run and its nodes, and now and then look at the best cost.

    Planners such as RRT* count their iterations. The first motion that they check in each is that
    to a new node, which they add where it is valid; the others are to connect it better.

    Attributes:
        checks: motions that were checked.
    """

    def __init__(self, si: Any, motions: Any) -> None:
        super().__init__(si)
        self._check = motions.checkMotion
        self.checks = self._nodes = self._iteration = 0
        self._history: CostHistory | None = None
        self._count_iterations: Any = None
        self._nodes_at: list[int | None] = []

    def begin_run(self, planner: Any, name: str) -> None:
        """Begin to watch a run.

        Args:
            planner: the planner.
            name: OMPL's name of its class.
        """
        self._forget()
        self._history = CostHistory(planner)
        if counts_iterations(name):
            self._count_iterations = planner.numIterations
            self._nodes = 1  # the start

    @property
    def nodes(self) -> int | None:
        """Nodes that the planner has added so far; None where it does not tell."""
        return None if self._count_iterations is None else self._nodes

    def end_run(self) -> list[Improvement]:
        """Return the improvements that were seen; let go of the planner, which keeps this alive."""
        seen = [] if self._history is None else self._history.costs
        improvements = [
            Improvement(*cost, nodes) for cost, nodes in zip(seen, self._nodes_at, strict=True)
        ]
        self._forget()
        return improvements

    def checkMotion(self, s1: Any, s2: Any, *last_valid: Any) -> bool:  # noqa: N802
        """Return whether a motion is valid."""
        valid: bool = self._check(s1, s2, *last_valid)
        self.checks += 1
        if self._count_iterations is not None:
            iteration = self._count_iterations()
            if iteration != self._iteration:
                self._iteration = iteration
                self._nodes += valid
        if self._history is not None and self.checks % _LOOK_EVERY == 0:
            self._history.look()
            if len(self._history.costs) > len(self._nodes_at):
                self._nodes_at.append(self.nodes)
        return valid

    def _forget(self) -> None:
        self.checks = self._nodes = self._iteration = 0
        self._history = self._count_iterations = None
        self._nodes_at = []
