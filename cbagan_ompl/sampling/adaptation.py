"""How far a planner's samples follow the heat map: as far as that brings the planner on.

1. Connectivity. Where the region connects start and goal, all samples of the planner are ours.
   Where it does not, six of seven are left to OMPL's own sampler.
2. Coverage. Before the first path no learned sample goes where the tree already is, with about
   the heading of the heat map where states have one. Once the tree has filled the region without a
   path, our samples are uniform.
3. Stagnation. Before the first path our fraction of the samples halves with every 128 learned
   samples that bring the tree into no new part of the region, down to a quarter. A node in a new
   part restores it.
4. Budget, with stagnation. Before the first path the number of learned samples is bounded, see
   :mod:`.budget`. This rule alone needs no tree to watch.
5. After the first path samples follow the heat map again; for informed planners, where a shorter
   path can pass.

Of our samples the uniform fraction that was asked for stays uniform throughout, so that a planner
stays probabilistically complete.
"""

from __future__ import annotations

from .budget import LearnedBudget
from .heatmap import REGION_THRESHOLD, Heatmap
from .monitor import Monitor
from .options import Adaptation
from .tree_coverage import TreeCoverage

# Our fraction with a region that does not connect start and goal, and the least one.
_UNCONNECTED_FRACTION, _LEAST_FRACTION = 0.15, 0.25
# Learned samples in vain that halve our fraction.
_HALF_LIFE = 128


class AdaptiveMixture:
    """Adapt the learned samples of a planner to what its tree makes of them.

    Attributes:
        covered: row-major bytes of the pixels, 1 where no learned sample need go before the first
            path; None while that is nowhere.

    Args:
        heatmap: what is sampled.
        adaptation: the rules that are on.
        reach: how far around a node its tree is taken to be, at most, world units.
        monitor: of the planner; it is told the fraction of the planner's samples that is ours.
        budget: of the learned samples, which nodes in new parts of the region add to; or None.
    """

    def __init__(
        self,
        heatmap: Heatmap,
        adaptation: Adaptation,
        reach: float,
        monitor: Monitor,
        budget: LearnedBudget | None = None,
    ) -> None:
        # Single values are read from a view faster than from an array.
        self._values = heatmap.values.ravel().data
        self._adaptation = adaptation
        self._monitor = monitor
        self._budget = budget
        self._tree = TreeCoverage(heatmap.grid, reach)
        self.covered = self._tree.mask if adaptation.coverage else None
        self._fraction = self._most = 1.0
        self._samples_in_vain = self._exhausted_count = 0
        self._is_in_goal = False
        # Whether the tree is watched before the first path, and whether it is at the moment.
        self._watches = self._is_watching = adaptation.coverage or adaptation.stagnation

    def on_start(self, connected: bool) -> None:
        """Note that the planner begins to plan.

        Args:
            connected: whether the region connects start and goal.
        """
        if self._adaptation.connectivity and not connected:
            self._most = _UNCONNECTED_FRACTION
            self._set_fraction(_UNCONNECTED_FRACTION)
            # For so few samples it does not pay to watch the tree.
            self._watches = self._is_watching = False
            self.covered = None

    def on_new_node(self, x: float, y: float, in_goal: bool, covers: bool = True) -> int:
        """Note that the tree has a new node.

        Args:
            x: of the node, world.
            y: of the node, world.
            in_goal: whether the node is in the goal region.
            covers: whether the tree is there by it; with another heading than that of the heat map
                it may not get on from there.

        Returns:
            How many nodes the tree has as far as is known; 0 while it is not watched.
        """
        if not self._is_watching:
            return 0
        if self._is_in_goal and not in_goal:
            self.restart()  # a planner that ends with its first path has begun anew
        pixel = self._tree.add(x, y, covers)
        if pixel is not None and self._values[pixel] >= REGION_THRESHOLD:
            self._samples_in_vain = 0
            self._set_fraction(self._most)
            if self._budget is not None:
                self._budget.earn_by_node()
        self._is_in_goal = in_goal
        return self._tree.node_count

    def on_sample(self) -> None:
        """Note that a learned sample is asked for before the first path."""
        if not (self._is_watching and self._adaptation.stagnation):
            return
        self._samples_in_vain += 1
        if self._samples_in_vain >= _HALF_LIFE:
            self._samples_in_vain = 0
            self._set_fraction(max(self._fraction / 2, _LEAST_FRACTION))

    def on_solution(self) -> None:
        """Note that there is a first path, or a better one."""
        self._is_watching = False
        self._set_fraction(self._most)

    def on_exhausted(self) -> None:
        """Note that the tree covers whatever the heat map offers.

        This also happens after the tree was cleared, so its nodes are counted now and then.
        """
        self._exhausted_count += 1
        if self._exhausted_count > self._tree.node_count:
            self._exhausted_count = 0
            if self._monitor.node_count() < self._tree.node_count / 2:
                self.restart()

    def restart(self) -> None:
        """Note that the tree is empty again."""
        self._samples_in_vain = self._exhausted_count = 0
        self._is_in_goal = False
        self._is_watching = self._watches
        self._tree.clear()
        if self._budget is not None:
            self._budget.restart()
        self._set_fraction(self._most)

    def _set_fraction(self, fraction: float) -> None:
        if fraction != self._fraction:
            self._fraction = fraction
            self._monitor.set_injected_fraction(fraction)
