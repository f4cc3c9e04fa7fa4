"""What comes out of a plan."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field, fields
from math import isfinite
from os import PathLike
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..common.files import write_atomically
from ..maps.endpoints import Moves
from ..robots.robot import Robot
from ..sampling.heatmap import Heatmap
from .path_files import path_csv


@dataclass(frozen=True)
class PlanResult:
    """What came out of :func:`cbagan_ompl.plan`; lengths in world units, times in seconds.

    Attributes:
        solved: the planner found an exact solution, and every edge of it passed the check again.
        status: OMPL's own word on the run.
        planner: OMPL's name of the planner.
        sampler: ``"learned"``, ``"uniform"``, ``"corridor"``, ``"straight-line"``,
            ``"flat"`` or ``"heatmap"`` (the caller's own).
        hook: by which hook the planner was reached; None for the uniform sampler.
        ompl_version: of the installed package.
        seed: what makes the samples of this run again.
        map: name of the map.
        robot: what moves.
        start: (x, y), world, as in :class:`cbagan_ompl.GridMap`; (x, y, yaw) for robots with
            heading. Where the path begins.
        goal: the same; where it ends. Of several goals the one that it reached, or the first.
        snapped: the endpoints that were moved, ``"start"`` or ``"goal"``, each with the point that
            was ``"given"`` and the ``"distance"`` from it, world units; see ``snap``.
        goal_tolerance: how far from the goal a path may end, world units.
        path: way points from start to goal, (N, 2), or poses (N, 3) for robots with heading, world;
            empty when not solved.
        trajectory: the path followed in steps along which no point of the robot moves more than
            half a pixel, way points included, (M, 2) or (M, 3), world; empty when not solved.
        cost: length of the path, along the curves of robots with a turning radius; in SE(2) half of
            each turn, in radians, counts as well, as OMPL has it. Infinite when not solved.
        overlap: whether the planner planned while the heat map was made.
        heatmap_arrival_s: with overlap, seconds from the beginning until the planner sampled the
            heat map; None where it ended before that, and without overlap.
        inference_s: making the heat map and attaching it, loading the model not included; with
            overlap the time of its thread alone, until the planner ended at most.
        planning_s: inside the planner's ``solve``.
        simplify_s: inside OMPL's path simplifier.
        total_s: the sum of the three; with overlap, seconds that have passed.
        first_solution_s: planning time to the first solution; None when not solved or the
            planner does not let it be known.
        first_solution_total_s: the same from the beginning: inference included without overlap, and
            what has passed with it.
        progress: (planning time, cost) of each better solution that the planner came upon, (K, 2);
            empty for planners that do not tell the cost of their best solution.
        iterations: evaluations of the termination condition, about one per iteration; None for
            planners that take no Python termination condition.
        nodes: states in the planner's tree or roadmap.
        nodes_at_first_solution: the same when the first solution was found; None when not solved or
            the planner does not let it be known.
        sample_counts: ``{"learned": n, "uniform": m}`` samples that the planner had from the heat
            map, whatever made it (``sampler`` says what), and from free space beside it; both 0 for
            the uniform sampler, which has no hook.
        heatmap_kept: whether the heat map is that of an earlier plan of a
            :class:`cbagan_ompl.Replanner`.
        heatmap: what was sampled; None for the uniform sampler. Not part of the JSON.
        tree: edges of the planner's tree, (M, 2, 2): two points (x, y) each, world; when asked for.
            Not part of the JSON.

    Example:
        >>> from cbagan_ompl import plan
        >>> result = plan("bundled:maze", (10, 10), (245, 245), sampler="corridor", seed=1)
        >>> result.solved, result.path[0].tolist(), result.sample_counts["learned"] > 0
        (True, [10.0, 10.0], True)
        >>> result.to_dict()["goal"]
        [245.0, 245.0]
    """

    solved: bool
    status: str
    planner: str
    sampler: str
    hook: str | None
    ompl_version: str
    seed: int
    map: str
    robot: Robot
    start: NDArray[np.float64]
    goal: NDArray[np.float64]
    snapped: Moves
    goal_tolerance: float
    path: NDArray[np.float64]
    trajectory: NDArray[np.float64]
    cost: float
    overlap: bool
    heatmap_arrival_s: float | None
    inference_s: float
    planning_s: float
    simplify_s: float
    total_s: float
    first_solution_s: float | None
    first_solution_total_s: float | None
    progress: NDArray[np.float64]
    iterations: int | None
    nodes: int
    nodes_at_first_solution: int | None
    sample_counts: dict[str, int]
    heatmap_kept: bool
    heatmap: Heatmap | None = field(repr=False, metadata={"json": False})
    tree: NDArray[np.float64] | None = field(repr=False, metadata={"json": False})

    def save_csv(self, path: str | PathLike[str]) -> None:
        """Write the way points of the path as CSV, see :func:`.path_files.path_csv`.

        Args:
            path: of the file; one that is there is replaced.

        Raises:
            ConfigError: the file cannot be written.

        Example:
            >>> from pathlib import Path
            >>> from tempfile import TemporaryDirectory
            >>> from cbagan_ompl import plan
            >>> result = plan("bundled:maze", (10, 10), (245, 245), sampler="corridor", seed=1)
            >>> with TemporaryDirectory() as folder:
            ...     result.save_csv(Path(folder) / "path.csv")
            ...     Path(folder, "path.csv").read_text().splitlines()[:2]
            ['x,y,index', '10.0,10.0,0']
        """
        write_atomically(path, path_csv(self.path))

    def to_dict(self) -> dict[str, Any]:
        """Return the result as JSON-ready values; an infinite cost becomes None."""
        values = {
            f.name: getattr(self, f.name) for f in fields(self) if f.metadata.get("json", True)
        }
        arrays = {k: v.tolist() for k, v in values.items() if isinstance(v, np.ndarray)}
        cost = self.cost if isfinite(self.cost) else None
        return values | arrays | {"cost": cost, "robot": asdict(self.robot)}
