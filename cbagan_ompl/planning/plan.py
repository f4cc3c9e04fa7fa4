"""The whole job in one call: map, heat map, planner, checked path."""

from __future__ import annotations

import secrets
from collections.abc import Callable
from dataclasses import dataclass, field, fields
from math import inf, isfinite, nan
from operator import index
from os import PathLike
from time import perf_counter
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import ConfigError
from ..maps.grid_map import GridMap
from ..sampling.adaptation import FULL_ADAPTATION, Adaptation
from ..sampling.heatmap import Heatmap
from ..sampling.sampler import DEFAULT_UNIFORM_FRACTION, check_draw_options
from . import compat
from .attach import attach
from .compat import ou
from .hooks import STOP_AT_FIRST, hook_of
from .monitor import CostHistory
from .problem import checked_path, path_length, set_range, simple_setup

if TYPE_CHECKING:
    from ..inference.predictor import Predictor

#: Where the heat map of a plan can come from; "uniform" is OMPL's own sampler, untouched.
SAMPLERS = ("learned", "uniform", "corridor", "straight-line")

#: What a result names its sampler when the caller brought the heat map.
OWN_HEATMAP = "heatmap"


@dataclass(frozen=True)
class PlanResult:
    """What came out of :func:`plan`; lengths in world units, times in seconds.

    Attributes:
        solved: the planner found an exact solution, and every edge of it passed the check again.
        status: OMPL's own word on the run.
        planner: OMPL's name of the planner.
        sampler: ``"learned"``, ``"uniform"``, ``"corridor"``, ``"straight-line"`` or
            ``"heatmap"`` (the caller's own).
        hook: by which hook the planner was reached; None for the uniform sampler.
        ompl_version: of the installed package.
        seed: what makes the draws of this run again.
        map: name of the map.
        start: (x, y).
        goal: (x, y).
        goal_tolerance: how far from the goal a path may end.
        path: (N, 2); empty when not solved.
        cost: length of the path; infinite when not solved.
        inference_s: making the heat map and attaching it, loading the model not included.
        planning_s: inside the planner's ``solve``.
        simplify_s: inside OMPL's path simplifier.
        total_s: the sum of the three.
        first_solution_s: planning time to the first solution; None when not solved or the
            planner does not let it be known.
        progress: (planning time, cost) of each better solution that the planner came upon, (K, 2);
            empty for planners that do not tell the cost of their best solution.
        iterations: evaluations of the termination condition, about one per iteration; None for
            planners that take no Python termination condition.
        nodes: states in the planner's tree or roadmap.
        draws: ``{"learned": n, "uniform": m}`` draws that the planner had from the heat map's
            hook; both 0 for the uniform sampler, which has no hook.
        heatmap: what was drawn from; None for the uniform sampler. Not part of the JSON.
        tree: edges of the planner's tree, (M, 2, 2), when asked for. Not part of the JSON.
    """

    solved: bool
    status: str
    planner: str
    sampler: str
    hook: str | None
    ompl_version: str
    seed: int
    map: str
    start: NDArray[np.float64]
    goal: NDArray[np.float64]
    goal_tolerance: float
    path: NDArray[np.float64]
    cost: float
    inference_s: float
    planning_s: float
    simplify_s: float
    total_s: float
    first_solution_s: float | None
    progress: NDArray[np.float64]
    iterations: int | None
    nodes: int
    sample_counts: dict[str, int]
    heatmap: Heatmap | None = field(repr=False, metadata={"json": False})
    tree: NDArray[np.float64] | None = field(repr=False, metadata={"json": False})

    def to_dict(self) -> dict[str, Any]:
        """The result as JSON-ready values; an infinite cost becomes None."""
        values = {
            f.name: getattr(self, f.name) for f in fields(self) if f.metadata.get("json", True)
        }
        arrays = {k: v.tolist() for k, v in values.items() if isinstance(v, np.ndarray)}
        return values | arrays | {"cost": self.cost if isfinite(self.cost) else None}


def plan(
    grid: GridMap | str | PathLike[str],
    start: ArrayLike,
    goal: ArrayLike,
    planner: str = "RRTstar",
    sampler: str = "learned",
    time: float = 1.0,
    iterations: int | None = None,
    range: float | None = None,
    radius: float = 0.0,
    seed: int | None = None,
    uniform_fraction: float = DEFAULT_UNIFORM_FRACTION,
    model: Predictor | str | PathLike[str] | None = None,
    heatmap: Heatmap | ArrayLike | None = None,
    simplify: bool = False,
    *,
    goal_tolerance: float | None = None,
    keep_tree: bool = False,
    adaptation: Adaptation = FULL_ADAPTATION,
    sharpness: float | None = None,
) -> PlanResult:
    """Plan a path on a map with one of OMPL's planners, unmodified.

    Args:
        grid: the map, or a file for :meth:`GridMap.load`.
        start: (x, y), world.
        goal: (x, y), world.
        planner: OMPL's name of a geometric planner, such as ``"RRT"`` or ``"InformedRRTstar"``.
        sampler: one of :data:`SAMPLERS`; ``"uniform"`` leaves OMPL's own sampler in place.
        time: limit of the planner's solve, seconds. RRT-like planners stop at their first
            solution, RRT*-like ones go on to the limit.
        iterations: limit of the planner's iterations, whichever comes first.
        range: longest edge that the planner adds, world units; by default OMPL's choice (a
            fifth of the map's diagonal).
        radius: of the robot, world units; obstacles are inflated by it.
        seed: at least 0; seeds OMPL's generators (which are global) and ours. A run limited by
            ``iterations`` repeats itself, one limited by ``time`` does not. By default a fresh
            one, found in the result.
        uniform_fraction: share of draws that stays uniform over free space, in (0, 1].
        model: for the learned sampler, a loaded model or the file of one; the bundled model by
            default.
        heatmap: to be drawn from in place of the learned one: of this map, or an array (H, W) as
            :class:`Heatmap` takes it.
        simplify: let OMPL's path simplifier shorten the path afterwards.
        goal_tolerance: how far from the goal a path may end, world units; by default a pixel. At 0
            paths end in the goal itself.
        keep_tree: put the edges of the planner's tree into the result.
        adaptation: how the share of the heat map changes while the planner plans, see
            :mod:`cbagan_ompl.sampling.adaptation`.
        sharpness: power of the heat map that draws follow; by default what suits the planner, see
            :func:`attach`.

    Returns:
        The result; not finding a path in time is no error, ``solved`` is False then.

    Raises:
        MapError: an unusable map or radius.
        TaskError: start or goal outside, in an obstacle, equal, or in separate parts.
        PlannerError: an unknown planner, or one that no hook reaches on this OMPL.
        ConfigError: an option that makes no sense.
        ModelError: an unusable model file.
        HeatmapError: a heat map that does not belong to this grid.
    """
    source = grid if isinstance(grid, GridMap) else GridMap.load(grid)
    space_map = source.inflated(radius)
    task = space_map.check_task(start, goal)
    tolerance = space_map.resolution
    if goal_tolerance is not None:
        tolerance = _number("goal_tolerance", goal_tolerance, 0.0)
    time_limit = _positive("time", time)
    longest_edge = None if range is None else _positive("range", range)
    count_limit = None if iterations is None else _whole("iterations", iterations, 1)
    used_seed = secrets.randbits(32) if seed is None else _whole("seed", seed, 0)
    check_draw_options(uniform_fraction, sharpness)
    kind = compat.planner_class(planner)
    if sampler != "uniform":
        hook_of(planner)
    name, provide = heatmap_source(sampler, model, heatmap)

    with compat.log_level(ou.LOG_ERROR):
        compat.seed_ompl(used_seed)
        setup = simple_setup(space_map, task, tolerance)
        setup.setPlanner(kind(setup.getSpaceInformation()))
        if longest_edge is not None and not set_range(setup.getPlanner(), longest_edge):
            raise ConfigError(f"{planner} has no range to set: leave it out")
        setup.setup()
        began = perf_counter()
        drawn_from = provide(space_map, *task) if provide is not None else None
        link = None
        if drawn_from is not None:
            link = attach(setup, drawn_from, uniform_fraction, used_seed, adaptation, sharpness)
        inference_s = perf_counter() - began if link else 0.0
        try:
            run = _solve(setup, planner, time_limit, count_limit)
            simplify_s = _simplify(setup) if simplify and run.exact else 0.0
            path = checked_path(setup, space_map, task, tolerance) if run.exact else None
            data = compat.planner_data(setup.getPlanner())
            return PlanResult(
                solved=path is not None,
                status=run.status,
                planner=planner,
                sampler=name,
                hook=link.hook if link else None,
                ompl_version=compat.ompl_version(),
                seed=used_seed,
                map=source.name,
                start=task[0],
                goal=task[1],
                goal_tolerance=tolerance,
                path=np.empty((0, 2)) if path is None else path,
                cost=inf if path is None else path_length(path),
                inference_s=inference_s,
                planning_s=run.planning_s,
                simplify_s=simplify_s,
                total_s=inference_s + run.planning_s + simplify_s,
                first_solution_s=run.first_solution_s if path is not None else None,
                progress=run.progress,
                iterations=run.iterations,
                nodes=int(data.numVertices()),
                sample_counts=dict(link.sample_counts) if link else {"learned": 0, "uniform": 0},
                heatmap=drawn_from,
                tree=compat.tree_edges(data) if keep_tree else None,
            )
        finally:
            if link is not None:
                link.detach()


def _number(name: str, value: float, least: float) -> float:
    try:
        number = float(value)
    except (TypeError, ValueError):
        number = nan
    if not (isfinite(number) and number >= least) or isinstance(value, str):
        raise ConfigError(f"{name} is a finite number of at least {least:g}, got {value!r}")
    return number


def _positive(name: str, value: float) -> float:
    number = _number(name, value, 0.0)
    if number == 0:
        raise ConfigError(f"{name} must be above 0, got {value!r}")
    return number


def _whole(name: str, value: int, least: int) -> int:
    try:
        number = index(value)
    except TypeError:
        number = least - 1
    if number < least or isinstance(value, bool):
        raise ConfigError(f"{name} is a whole number of at least {least}, got {value!r}")
    return number


#: Makes the heat map of a map, a start and a goal.
HeatmapSource = Callable[[GridMap, ArrayLike, ArrayLike], Heatmap]


def heatmap_source(
    sampler: str,
    model: Predictor | str | PathLike[str] | None = None,
    heatmap: Heatmap | ArrayLike | None = None,
) -> tuple[str, HeatmapSource | None]:
    """Name of the sampler, and what makes its heat map; a model is loaded here, once.

    Arguments as for :func:`plan`. OMPL's own sampler has no heat map.

    Raises:
        ConfigError: an unknown sampler, or options that do not go together.
        ModelError: an unusable model file.
    """
    if sampler not in SAMPLERS:
        raise ConfigError(f"there is no sampler {sampler!r}; there are {', '.join(SAMPLERS)}")
    if sampler != "learned" and (model is not None or heatmap is not None):
        raise ConfigError(
            f"the {sampler} sampler uses no model and no heat map: leave them out, or choose the "
            "learned sampler"
        )
    if model is not None and heatmap is not None:
        raise ConfigError("a model and a heat map were both given: choose one")
    if heatmap is not None:
        values = heatmap.values if isinstance(heatmap, Heatmap) else heatmap
        return OWN_HEATMAP, lambda grid, start, goal: Heatmap(values, grid)
    if sampler == "uniform":
        return sampler, None
    if sampler == "corridor":
        return sampler, Heatmap.corridor
    if sampler == "straight-line":
        return sampler, Heatmap.straight_line
    from ..inference.predictor import Predictor, load_model

    predictor = model if isinstance(model, Predictor) else load_model(model)
    return sampler, predictor.predict


@dataclass(frozen=True)
class _Run:
    exact: bool
    status: str
    planning_s: float
    first_solution_s: float | None
    progress: NDArray[np.float64]
    iterations: int | None


def _solve(setup: Any, name: str, time: float, iterations: int | None) -> _Run:
    if name in compat.HANGS_ON_PYTHON_TERMINATION:
        if iterations is not None:
            raise ConfigError(
                f"{name} of OMPL {compat.ompl_version()} cannot be limited by iterations, it "
                "hangs on termination conditions in Python: limit its time instead"
            )
        condition, watch = float(time), None
    else:
        watch = _Watch(setup.getPlanner(), time, iterations)
        condition = compat.termination_condition(watch.stop)
    began = perf_counter()
    status = setup.solve(condition)
    planning_s = perf_counter() - began
    progress = np.array(watch.history.costs if watch else []).reshape(-1, 2)
    first = planning_s if name in STOP_AT_FIRST else None
    return _Run(
        exact=compat.is_exact(status),
        status=str(status),
        planning_s=planning_s,
        first_solution_s=float(progress[0, 0]) if len(progress) else first,
        progress=progress,
        iterations=watch.iterations if watch else None,
    )


class _Watch:
    """The termination condition: counts iterations, and notes each better solution."""

    def __init__(self, planner: Any, time: float, iterations: int | None) -> None:
        self.iterations = 0
        self.history = CostHistory(planner)
        self._limit = inf if iterations is None else iterations
        self._time = time

    def stop(self) -> bool:
        if self.history.look() >= self._time or self.iterations >= self._limit:
            return True
        self.iterations += 1
        return False


def _simplify(setup: Any) -> float:
    began = perf_counter()
    setup.simplifySolution()
    return perf_counter() - began
