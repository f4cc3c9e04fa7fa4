"""Samples handed to a planner as samples of its goal: the hook where no sampler can be set."""

from __future__ import annotations

import sys
from typing import Any

from ..sampling.sampler import HeatmapSampler
from .awaited import AwaitedHeatmap
from .compat import ob
from .goal_approach import GoalApproach, goal_approach
from .goal_monitor import GoalMonitor
from .pose_extension import PoseExtension, pose_extension
from .sample_budget import needs_many_poses
from .states import StateAccess

# What RRT-like planners compare their number of goal states with: never enough.
_ENDLESS = 10**9

# Headings in collision that are rejected in a row: to look costs less than to extend the tree.
_MOST_REJECTED = 3

# Fraction of the samples that are the true goal until the planner has reached it: OMPL's own bias.
_GOAL_BIAS = 0.05


class InjectedGoal(ob.GoalSampleableRegion):  # type: ignore[misc]
    """A goal that is reached where the original is, and whose samples come from a heat map.

    RRT, RRT*, Informed RRT* and SORRT* sample their goal with the probability of their goal bias
    and grow the tree towards the sample like towards any other. With that bias at 1 every sample
    of theirs is one of ours.

    Args:
        si: the space information.
        original: the goal of the task.
        states: access to the positions of the states.
        source: the sampler of the heat map, which is told of every node of the tree; or the heat
            map that is waited for, until which the goal is as the original.
        monitor: of the planner.
    """

    def __init__(
        self,
        si: Any,
        original: Any,
        states: StateAccess,
        source: HeatmapSampler | AwaitedHeatmap,
        monitor: GoalMonitor,
    ) -> None:
        super().__init__(si)
        self._threshold = original.getThreshold()
        self.setThreshold(self._threshold)
        self._original = original
        # What tells which poses collide; None where that does not matter.
        self._si = si if needs_many_poses(monitor.setup.getPlanner()) else None
        self._states = states
        self._monitor = monitor
        self._awaited: AwaitedHeatmap | None = None
        self._sampler: HeatmapSampler
        self._approach: GoalApproach | None = None
        self._extension: PoseExtension | None = None
        if isinstance(source, AwaitedHeatmap):
            self._awaited = source
            source.hand_to(self._follow)
        else:
            self._take(source)

    def distanceGoal(self, state: Any) -> float:  # noqa: N802
        """Return the distance to the original goal; planners ask it for every new node."""
        distance: float = self._original.distanceGoal(state)
        if self._awaited is not None and self._awaited.is_pending():
            return distance
        monitor = self._monitor
        monitor.nodes += 1
        if monitor.is_trusted:
            x, y = self._states.read(state)
            in_goal = distance < self._threshold
            follows = self._states.follows_heatmap(state)
            count = self._sampler.on_new_node(x, y, in_goal, follows)
            if count and self._extension is not None:
                self._extension.add(state, count)
            if self._approach is not None:
                self._approach.on_new_node(distance, count)
            if in_goal:
                monitor.note_reached()
        return distance

    def maxSampleCount(self) -> int:  # noqa: N802
        """Return a number without limit to the planner, the original's number to other callers."""
        if self._awaited is not None and self._awaited.is_pending():
            return int(self._original.maxSampleCount())
        monitor = self._monitor
        monitor.counts_asked += 1
        return _ENDLESS if monitor.is_sampling() else int(self._original.maxSampleCount())

    def couldSample(self) -> bool:  # noqa: N802
        """Return what the original does; the planners that injection is for never ask."""
        self._monitor.note_other()
        return bool(self._original.couldSample())

    def __getattr__(self, name: str) -> Any:
        """Return what only the original has, such as the ``getState`` of a GoalState."""
        if name.startswith("_"):
            raise AttributeError(name)
        return getattr(self._original, name)

    def sampleGoal(self, state: Any) -> None:  # noqa: N802
        """Sample the heat map for the planner, the original goal for other callers."""
        monitor = self._monitor
        if self._awaited is not None and self._awaited.is_pending():
            monitor.note_call(sys._getframe(1))
            self._original.sampleGoal(state)
            return
        monitor.check_asker()
        sampling = monitor.takes_sample(sys._getframe(1))
        monitor.counts_asked = 0
        if sampling:
            self._sampler.begin()
        if not sampling or (not monitor.has_solution and self._is_goals_turn()):
            self._original.sampleGoal(state)
        elif not monitor.has_solution and self._approach is not None and self._approach.is_due():
            self._original.sampleGoal(state)
            self._approach.move_back(state)
        else:
            self._sample_heatmap(state)

    def _sample_heatmap(self, state: Any) -> None:
        """Sample the heat map; a pose in collision gets another heading, a few times."""
        x, y = self._sampler.next()
        if self._is_extended(state):
            return
        self._states.write(state, x, y)
        if self._si is not None:
            for _ in range(_MOST_REJECTED):
                if self._si.isValid(state):
                    return
                self._states.write(state, x, y)

    def _is_extended(self, state: Any) -> bool:
        """Set a state to a pose that the tree reaches, before the first path, if there is one."""
        extension = self._extension
        if extension is None or self._monitor.has_solution or not self._sampler.is_learned:
            return False
        return extension.move(state)

    def _take(self, sampler: HeatmapSampler) -> None:
        planner = self._monitor.setup.getPlanner()
        self._sampler = sampler
        self._approach = goal_approach(planner, sampler)
        self._extension = pose_extension(planner, sampler)

    def _follow(self, sampler: HeatmapSampler, states: StateAccess) -> None:
        """Sample a heat map from now on."""
        self._take(sampler)
        self._states, self._awaited = states, None
        self._monitor.set_injected_fraction(1.0)

    def _is_goals_turn(self) -> bool:
        """Return whether the true goal is due, as often as with OMPL's own goal bias.

        It never is while it has no samples, as one that is still looking for them.
        """
        is_due = self._sampler.chance() * self._monitor.injected_fraction < _GOAL_BIAS
        return is_due and self._original.maxSampleCount() > 0
