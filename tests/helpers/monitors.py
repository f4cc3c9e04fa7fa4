"""A planner that tests play themselves."""

from __future__ import annotations

from collections.abc import Callable
from math import inf
from types import FrameType

from cbagan_ompl.sampling.heatmap import Heatmap
from cbagan_ompl.sampling.informed_set import InformedSet


class FakeMonitor:
    """Answers what it is told to, and keeps the fractions that it is told, the latest one last."""

    def __init__(
        self,
        best_cost: Callable[[], float] = lambda: inf,
        informed: InformedSet | None = None,
        nodes: int = 10**9,
        connected: bool = True,
    ) -> None:
        self.best_cost = best_cost
        self.fractions = [1.0]
        self._informed, self._nodes, self._connected = informed, nodes, connected

    def note_call(self, caller: FrameType) -> None:
        pass

    def informed_set(self) -> InformedSet | None:
        return self._informed

    def connects(self, heatmap: Heatmap) -> bool:
        return self._connected

    def node_count(self) -> int:
        return self._nodes

    def set_injected_fraction(self, fraction: float) -> None:
        self.fractions.append(fraction)
