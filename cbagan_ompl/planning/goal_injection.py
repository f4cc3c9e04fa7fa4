"""Draws handed to a planner as samples of its goal: the hook where no sampler can be set."""

from __future__ import annotations

from typing import Any

from ..sampling.adaptation import Trust
from ..sampling.sampler import HeatmapSampler
from .compat import ob
from .monitor import PlannerMonitor
from .states import StateAccess

# What RRT-like planners compare their number of goal states with: never enough.
_ENDLESS = 10**9

# Share of draws that are the real goal until the planner has reached it: OMPL's own goal bias.
_GOAL_BIAS = 0.05


class InjectedGoal(ob.GoalSampleableRegion):  # type: ignore[misc]
    """A goal that is reached where the original is, and whose samples come from a heat map.

    RRT, RRT*, Informed RRT* and SORRT* sample their goal with the probability of their goal bias
    and grow the tree towards the sample like towards any other. With that bias at 1 every sample
    of theirs is a draw of ours.

    Args:
        si: the space information.
        original: the goal of the task.
        positions: access to the positions of the states.
        stream: the draws.
        progress: what is known of the planner.
        trust: told of every node of the tree.
    """

    def __init__(
        self,
        si: Any,
        original: Any,
        positions: StateAccess,
        stream: HeatmapSampler,
        progress: PlannerMonitor,
        trust: Trust,
    ) -> None:
        super().__init__(si)
        self._threshold = original.getThreshold()
        self.setThreshold(self._threshold)
        self._original = original
        self._positions = positions
        self._stream = stream
        self._progress = progress
        self._trust = trust
        self._began = False

    def distanceGoal(self, state: Any) -> float:  # noqa: N802
        """Distance to the original goal, which planners ask for every new node of their tree."""
        distance: float = self._original.distanceGoal(state)
        x, y = self._positions.read(state)
        self._trust.grown(x, y, distance < self._threshold)
        return distance

    def maxSampleCount(self) -> int:  # noqa: N802
        """No end of samples for the planner, the original's number for anybody else."""
        return _ENDLESS if self._progress.is_sampling() else int(self._original.maxSampleCount())

    def couldSample(self) -> bool:  # noqa: N802
        """Always, as for the original."""
        return True

    def sampleGoal(self, state: Any) -> None:  # noqa: N802
        """A draw for the planner, a sample of the original goal for anybody else."""
        progress = self._progress
        sampling = progress.is_sampling()
        progress.note_sample()
        if sampling and not self._began:
            self._began = True
            self._trust.begin(progress.connects(self._stream.heatmap))
        if not sampling or (not progress.has_solution and self._is_goals_turn()):
            self._original.sampleGoal(state)
        else:
            self._positions.write(state, *self._stream.next())

    def _is_goals_turn(self) -> bool:
        """Whether the real goal is due, as often among all draws as with OMPL's own goal bias."""
        return self._stream.chance() * self._progress.share < _GOAL_BIAS
