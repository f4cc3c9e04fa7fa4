"""How far the samples of a roadmap planner follow the heat map: once over it, then by the budget.

The nodes of a roadmap are its samples, and each is connected with its nearest neighbours. Many
samples in one place harm: they become the nearest neighbours of nodes around, also through walls.
So a learned sample goes where no sample is near, until there are samples all over the heat map.
From then on the budget alone grants learned samples, which go once over the heat map again.
"""

from __future__ import annotations

from .budget import LearnedBudget
from .heatmap import Heatmap
from .tree_coverage import TreeCoverage


class RoadmapMixture:
    """Adapt the learned samples of a planner whose samples are its nodes.

    Attributes:
        covered: row-major bytes of the pixels, 1 where no learned sample need go.

    Args:
        heatmap: what is sampled.
        reach: how far around a sample another one is near, at most, world units.
        budget: of the learned samples; None bounds nothing.
    """

    def __init__(self, heatmap: Heatmap, reach: float, budget: LearnedBudget | None) -> None:
        self._coverage = TreeCoverage(heatmap.grid, reach)
        self._budget = budget
        self.covered: bytearray | None = self._coverage.mask

    def on_start(self, connected: bool) -> None:
        """Do nothing: whether the region is connected does not matter to a roadmap."""

    def on_new_node(self, x: float, y: float, in_goal: bool, covers: bool = True) -> int:
        """Note a valid sample.

        Args:
            x: of the sample, world.
            y: of the sample, world.
            in_goal: whether it is in the goal, which does not matter here.
            covers: whether it does instead of another sample there.

        Returns:
            How many there are.
        """
        self._coverage.add(x, y, covers)
        return self._coverage.node_count

    def on_sample(self) -> None:
        """Do nothing: valid samples count, see :meth:`on_new_node`."""

    def on_solution(self) -> None:
        """Do nothing: these planners do not tell."""

    def on_exhausted(self) -> None:
        """Note that there are samples all over the heat map."""
        self._coverage.clear()
        if self._budget is not None:
            self._budget.use_up()

    def restart(self) -> None:
        """Note that the roadmap is empty again."""
        self._coverage.clear()
