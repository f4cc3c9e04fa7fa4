"""What a sampler may know of the planner that it feeds."""

from __future__ import annotations

from math import inf
from types import FrameType
from typing import Protocol

from .heatmap import Heatmap
from .informed_set import InformedSet


class Monitor(Protocol):
    """A view of a planner at work."""

    def note_call(self, caller: FrameType) -> None:
        """Note which frame has called the planner, which asks for a sample."""

    def best_cost(self) -> float:
        """Return the cost of the best solution, infinite before there is one."""

    def informed_set(self) -> InformedSet | None:
        """Return where a shorter path can pass; None for planners that are not informed."""

    def connects(self, heatmap: Heatmap) -> bool:
        """Return whether the region of a heat map connects start and goal."""

    def node_count(self) -> int:
        """Return the number of nodes of the planner's tree."""

    def set_injected_fraction(self, fraction: float) -> None:
        """Leave all but a fraction of the planner's samples to the planner's own sampler."""


class NoMonitor:
    """The monitor of a sampler that feeds no planner, or one that cannot be observed."""

    def note_call(self, caller: FrameType) -> None:
        """Do nothing: there is no planner."""

    def best_cost(self) -> float:
        """Return infinity: no solution is ever seen."""
        return inf

    def informed_set(self) -> InformedSet | None:
        """Return None: samples come from everywhere."""
        return None

    def connects(self, heatmap: Heatmap) -> bool:
        """Return True: there is no task that the region could miss."""
        return True

    def node_count(self) -> int:
        """Return 0: no tree is seen."""
        return 0

    def set_injected_fraction(self, fraction: float) -> None:
        """Do nothing: there is no planner."""
