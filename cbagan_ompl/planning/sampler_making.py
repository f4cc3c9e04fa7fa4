"""Making the sampler of a heat map for a planner: headings, adaptation and budget that fit it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..sampling.adaptation import AdaptiveMixture
from ..sampling.headings import HeadingSampler
from ..sampling.heatmap import Heatmap
from ..sampling.options import SamplerOptions
from ..sampling.roadmap import RoadmapMixture
from ..sampling.sampler import HeatmapSampler
from .attachable import check_frames
from .hooks import BOUNDS_STEERING, GOAL_INJECTION, samples_are_nodes
from .monitor import PlannerMonitor
from .planner_kinds import plans_controls
from .pose_headings import with_headings
from .problem import range_of
from .sample_budget import budget_of, needs_many_poses
from .states import StateAccess, drives_backwards, position_bounds, state_access

# How far around a node its tree is taken to be, as a fraction of the range.
_REACH = 0.8

#: The hooks whose callbacks see the nodes of the planner's tree.
SEES_TREE = frozenset({GOAL_INJECTION, BOUNDS_STEERING})


@dataclass(frozen=True)
class SamplerMaker:
    """Makes samplers for one planner.

    It refers to the planner by its monitor alone, which lets go of it.

    Attributes:
        name: of the planner.
        hook: by which it is reached.
        options: how samples follow the heat map, with a sharpness.
        monitor: of the planner.
        starts: positions of its start states, as far as they are known.
        rng: the generator of the samples.
    """

    name: str
    hook: str
    options: SamplerOptions
    monitor: PlannerMonitor
    starts: list[tuple[float, float]]
    rng: np.random.Generator

    def make(self, heatmap: Heatmap) -> tuple[HeatmapSampler, StateAccess] | None:
        """Return the sampler of a heat map, and the access to states with its headings.

        Returns:
            None where the planner was let go of.

        Raises:
            TaskError: no start is on free space of the heat map's map.
            HeatmapError: the heat map is 0 everywhere in the bounds of the space.
        """
        setup, monitor, options, rng = self.monitor.setup, self.monitor, self.options, self.rng
        if setup is None:
            return None
        check_frames(self.starts, heatmap)
        planner, space = setup.getPlanner(), setup.getStateSpace()
        heatmap = with_headings(setup, heatmap, options.heading)
        headings = HeadingSampler(heatmap, options.heading, rng, drives_backwards(space))
        states = state_access(space, headings)
        adaptation, budget = options.adaptation, None
        if adaptation.stagnation:
            budget = budget_of(planner, sees_nodes=self.hook in SEES_TREE)
        if needs_many_poses(planner):  # what is no progress in position may be one in heading
            adaptation = replace(adaptation, stagnation=False)
        mixture: AdaptiveMixture | RoadmapMixture | None = None
        if self.hook in SEES_TREE:
            reach = _reach_of(planner)
            mixture = AdaptiveMixture(heatmap, adaptation, reach, monitor, budget)
        elif samples_are_nodes(self.name) and adaptation.coverage:
            mixture = RoadmapMixture(heatmap, _reach_of(planner), budget)
        sampler = HeatmapSampler(heatmap, replace(options, seed=rng), monitor, mixture, budget)
        sampler.keep_inside(*position_bounds(space))
        sampler.prepare()
        if mixture is not None and adaptation.connectivity:
            monitor.prepare(heatmap, self.starts)
        return sampler, states

    def make_late(self, heatmap: Heatmap) -> tuple[HeatmapSampler, StateAccess] | None:
        """Do the same in the middle of a solve: the sampler is told of the tree that is there."""
        made = self.make(heatmap)
        if made is not None and self.hook in SEES_TREE:
            for x, y in self.monitor.node_positions():
                made[0].on_new_node(x, y, False)
        return made


def _reach_of(planner: Any) -> float:
    """Return how far around a node a tree need not grow again, world units: most of its range.

    Where controls are planned it is 0: what is near in position may be far on the way.
    """
    if plans_controls(planner):
        return 0.0
    return _REACH * range_of(planner)
