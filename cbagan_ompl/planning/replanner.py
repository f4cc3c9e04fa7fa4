"""Planning again and again to one goal, from where the robot is."""

from __future__ import annotations

from dataclasses import replace
from os import PathLike
from typing import TYPE_CHECKING, Any

from numpy.typing import ArrayLike

from ..common.validation import whole_number
from ..maps.checks import check_grid
from ..maps.grid_map import GridMap
from ..robots.poses import check_pose
from ..sampling.heatmap import Heatmap
from .heatmap_sources import LEARNED, heatmap_source, loaded_model
from .plan import plan
from .plan_result import PlanResult
from .workspace import Workspace

if TYPE_CHECKING:
    from ..inference.predictor import Predictor


class Replanner:
    """Plans to one goal, and keeps the heat map from one plan to the next while it serves.

    It serves as long as its region connects the new start with the goal and no obstacle has
    appeared in it. That saves most of the time of a short cycle: the network, or the grid search.
    What becomes free outside of the region is not noticed until the next prediction, but by the
    uniform fraction of the samples.

    Attributes:
        grid: the map of the last plan.
        goal: as it was given.
        heatmap: the one that the next plan keeps if it can; None before the first plan, for the
            uniform sampler, and after a plan with it has failed.

    Args:
        grid: the map.
        goal: (x, y), world.
        planner: see :func:`cbagan_ompl.plan`; the default stops at its first path.
        sampler: see there.
        model: for the learned sampler, a loaded model or the file of one, which is loaded here,
            once; the bundled model by default.
        **options: of every plan, as keyword arguments of :func:`cbagan_ompl.plan`: ``radius``,
            ``time``, ``range``... With a ``seed`` the n-th plan has ``seed + n``, from 0.

    Raises:
        MapError: ``grid`` is no map.
        ConfigError: an unknown sampler, or a seed that is none.
        ModelError: an unusable model file.

    Example:
        >>> from cbagan_ompl import GridMap, Replanner
        >>> grid = GridMap.load("bundled:maze")
        >>> replanner = Replanner(grid, (245, 245), sampler="corridor", time=5, range=20, seed=1)
        >>> first = replanner.plan((10, 10))
        >>> second = replanner.plan(first.path[1])
        >>> first.solved, first.heatmap_kept, second.solved, second.heatmap_kept
        (True, False, True, True)
    """

    def __init__(
        self,
        grid: GridMap,
        goal: ArrayLike,
        planner: str = "RRT",
        sampler: str = LEARNED,
        *,
        model: Predictor | str | PathLike[str] | None = None,
        **options: Any,
    ) -> None:
        check_grid(grid)
        self.grid = grid
        self.goal = goal
        self.heatmap: Heatmap | None = None
        self._last: PlanResult | None = None
        seed = options.pop("seed", None)
        self._next_seed = None if seed is None else whole_number("seed", seed, 0)
        if isinstance(sampler, str) and sampler == LEARNED:
            model = loaded_model(model)
        heatmap_source(sampler, model)  # what the first plan would raise, it raises now
        self._fresh = {"sampler": sampler, "model": model}
        self._options = {**options, "planner": planner}

    def plan(self, start: ArrayLike, grid: GridMap | None = None) -> PlanResult:
        """Plan from a start to the goal.

        Args:
            start: (x, y), world, or (x, y, yaw) for a robot with heading: where the robot is.
            grid: the map from now on, where it has changed.

        Returns:
            The result; its ``heatmap_kept`` says whether the heat map is that of an earlier plan.

        Raises:
            CbaganOmplError: as :func:`cbagan_ompl.plan`.
        """
        if grid is not None:
            check_grid(grid)
            self.grid = grid
        kept = self.heatmap if self._serves(start) else None
        options = {**self._options, **(self._fresh if kept is None else {"heatmap": kept})}
        if self._next_seed is not None:
            options["seed"] = self._next_seed
            self._next_seed += 1
        result = plan(self.grid, start, self.goal, **options)
        if kept is not None and self._last is not None:
            result = replace(result, sampler=self._last.sampler, heatmap_kept=True)
        # A heat map with which no path was found in time is not tried again.
        self.heatmap = result.heatmap if result.solved else None
        self._last = result
        return result

    def _serves(self, start: ArrayLike) -> bool:
        """Return whether the heat map is worth to be sampled from another start."""
        if self.heatmap is None or self._last is None:
            return False
        grid = Workspace(self.grid, self._last.robot).grid
        before = self.heatmap.grid
        if grid is not before and (
            _frame(grid) != _frame(before) or (self.heatmap.region & ~grid.free).any()
        ):
            return False
        has_heading = self._last.robot.has_heading
        position = check_pose("start", start)[:2] if has_heading else start
        return self.heatmap.connects(position, self._last.goal[:2])


def _frame(grid: GridMap) -> tuple[object, ...]:
    return grid.shape, grid.resolution, grid.origin
