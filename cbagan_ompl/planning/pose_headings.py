"""The headings of a heat map that is to be sampled for poses."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..sampling.heatmap import Heatmap
from ..sampling.options import HeadingSpread
from . import compat
from .states import pose_space, state_access

# A goal region without end is represented by this many samples of it.
_MOST_GOALS = 100


def with_headings(setup: Any, heatmap: Heatmap, spread: HeadingSpread) -> Heatmap:
    """Return a heat map with headings where the states of a setup have one.

    Args:
        setup: a SimpleSetup with its goal.
        heatmap: returned as it is where it has headings, where states have none, and where all
            headings are to be uniform; otherwise :meth:`.Heatmap.directed` to the goal, or to all
            goals if there are several.
        spread: of the headings that are sampled.
    """
    space = setup.getStateSpace()
    # Headings are computed when they are asked for: first all that makes them unnecessary.
    if pose_space(space) is None or spread.uniform_fraction == 1 or heatmap.heading is not None:
        return heatmap
    states, goal = state_access(space), setup.getGoal()
    state = compat.new_state(space)
    typed = compat.typed_state(state)
    goals = []
    for _ in range(min(goal.maxSampleCount(), _MOST_GOALS)):
        goal.sampleGoal(typed)
        goals.append(states.read(typed))
    u, v = heatmap.grid.to_pixel(np.array(goals).reshape(-1, 2)).T
    on_map = (u >= 0) & (u < heatmap.grid.width) & (v >= 0) & (v < heatmap.grid.height)
    # Goals that are sampled lazily may not be there yet, and goals off the map are not reached.
    return heatmap.directed(np.array(goals)[on_map]) if on_map.any() else heatmap
