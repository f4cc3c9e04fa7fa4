"""One solve of a planner: when it is to stop, and what is seen of it meanwhile."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..common.validation import positive_number, whole_number
from ..errors import ConfigError
from . import compat
from .attach import Attachment
from .hooks import asks_in_thread, hangs_on_python_termination, stops_at_first
from .monitor import CostHistory


@dataclass(frozen=True)
class Limits:
    """When a planner is to stop.

    Attributes:
        time: seconds.
        iterations: None where only the time counts.
        can_watch: whether the planner takes a termination condition in Python.
    """

    time: float
    iterations: int | None
    can_watch: bool

    @classmethod
    def of(cls, planner: str, time: float, iterations: int | None) -> Limits:
        """Check the limits of a planner.

        Raises:
            ConfigError: a limit that makes no sense, or that the planner cannot have.
        """
        seconds = positive_number("time", time)
        count = None if iterations is None else whole_number("iterations", iterations, 1)
        hangs = hangs_on_python_termination(planner)
        if hangs and count is not None:
            raise ConfigError(
                f"{planner} of OMPL {compat.ompl_version()} cannot be limited by iterations, it "
                "hangs on termination conditions in Python: limit its time instead"
            )
        return cls(seconds, count, not hangs)


@dataclass(frozen=True)
class SolveRecord:
    """What was seen of a solve.

    Attributes:
        is_exact: whether OMPL calls its solution exact.
        status: OMPL's own word on it.
        planning_s: seconds inside the solve.
        first_solution_s: seconds to the first solution; None where the planner does not tell.
        progress: (seconds, cost) of each better solution, (K, 2).
        iterations: evaluations of the termination condition; None where it is not Python's.
        nodes: states in the planner's tree or roadmap at the end.
        nodes_at_first_solution: the same when the first solution was seen; None where the planner
            does not tell.
    """

    is_exact: bool
    status: str
    planning_s: float
    first_solution_s: float | None
    progress: NDArray[np.float64]
    iterations: int | None
    nodes: int
    nodes_at_first_solution: int | None


def solve(
    setup: Any, planner: str, limits: Limits, attachment: Attachment | None = None
) -> SolveRecord:
    """Let the planner of a setup solve its problem.

    Args:
        setup: a SimpleSetup, set up.
        planner: OMPL's name of its planner.
        limits: when the planner is to stop.
        attachment: to a heat map that may be waited for, whose failure ends the solve.
    """
    watch = None
    if limits.can_watch:
        # A roadmap that another thread works on is not to be read.
        counts_nodes = not asks_in_thread(planner)
        watch = _Watch(setup.getPlanner(), limits, counts_nodes, attachment)
    condition = compat.termination_condition(watch.stop) if watch else limits.time
    began = perf_counter()
    status = setup.solve(condition)
    planning_s = perf_counter() - began
    nodes = _count_nodes(setup.getPlanner())
    nodes_at_first = watch.nodes_at_first if watch else None
    ends_at_first = stops_at_first(planner)
    progress = np.array(watch.history.costs if watch else []).reshape(-1, 2)
    first_s = planning_s if ends_at_first else None
    return SolveRecord(
        is_exact=compat.is_exact(status),
        status=str(status),
        planning_s=planning_s,
        first_solution_s=float(progress[0, 0]) if len(progress) else first_s,
        progress=progress,
        iterations=watch.iterations if watch else None,
        nodes=nodes,
        nodes_at_first_solution=nodes if ends_at_first else nodes_at_first,
    )


class _Watch:
    """The termination condition: counts iterations, and notes each better solution."""

    def __init__(
        self, planner: Any, limits: Limits, counts_nodes: bool, attachment: Attachment | None
    ) -> None:
        self.iterations = 0
        self.history = CostHistory(planner)
        self.nodes_at_first: int | None = None
        self._planner = planner if counts_nodes else None
        self._most = inf if limits.iterations is None else limits.iterations
        self._time = limits.time
        is_awaited = attachment is not None and attachment.arrival_s is None
        self._awaited = attachment if is_awaited else None

    def stop(self) -> bool:
        elapsed = self.history.look()
        if self._planner is not None and self.history.costs:
            self.nodes_at_first = _count_nodes(self._planner)
            self._planner = None
        if elapsed >= self._time or self.iterations >= self._most:
            return True
        if self._awaited is not None and self._awaited.has_failed:
            return True
        self.iterations += 1
        return False


def _count_nodes(planner: Any) -> int:
    return int(compat.planner_data(planner).numVertices())
