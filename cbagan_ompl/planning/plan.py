"""The whole job in one call: map, heat map, planner, checked path."""

from __future__ import annotations

import secrets
from dataclasses import dataclass, replace
from functools import partial
from math import inf
from os import PathLike
from time import perf_counter
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..common.validation import (
    finite_number,
    positive_number,
    truth_value,
    whole_number,
)
from ..errors import ConfigError, MapError, show
from ..maps.endpoints import Moves
from ..maps.grid_map import GridMap
from ..robots.robot import Robot
from ..sampling.heatmap import Heatmap
from ..sampling.options import SamplerOptions
from . import compat
from .attach import Attachment, attach
from .compat import ou
from .goals import heatmap_of_goals, reached_goal, set_goals, split_goals
from .heatmap_sources import (
    LEARNED,
    OWN_HEATMAP,
    UNIFORM,
    HeatmapSource,
    heatmap_source,
    resolve_auto,
)
from .hooks import check_planner, check_switchable, hangs_at_optimum
from .overlapping import Prediction, can_overlap
from .paths import checked_path, follow_path, path_cost
from .plan_result import PlanResult
from .planner_names import planner_name
from .problem import (
    make_setup,
    set_range,
    stop_at_optimum,
)
from .solving import Limits, SolveRecord, solve
from .states import state_access
from .workspace import Workspace, robot_of

if TYPE_CHECKING:
    from ..inference.predictor import Predictor


def plan(
    grid: GridMap | str | PathLike[str],
    start: ArrayLike,
    goal: ArrayLike,
    planner: str = "RRTstar",
    sampler: str = LEARNED,
    *,
    time: float = 1.0,
    iterations: int | None = None,
    range: float | None = None,
    robot: Robot | None = None,
    radius: float = 0.0,
    snap: float = 0.0,
    model: Predictor | str | PathLike[str] | None = None,
    heatmap: Heatmap | ArrayLike | None = None,
    overlap: bool = False,
    simplify: bool = False,
    goal_tolerance: float | None = None,
    keep_tree: bool = False,
    options: SamplerOptions | None = None,
    **changes: Any,
) -> PlanResult:
    """Plan a path on a map with one of OMPL's planners, unmodified.

    Args:
        grid: the map, or a file for :meth:`GridMap.load`.
        start: (x, y), world; (x, y, yaw) for a robot with heading, radians.
        goal: the same, or a list of several of which any will do: paths end in one of them, the
            heat map has the largest of the values that those of each goal have.
        planner: a geometric planner by OMPL's name, such as ``"RRT"`` or ``"InformedRRTstar"``, or
            as the literature writes it, ``"RRT*"``, ``"RRT-Connect"``...
        sampler: one of :data:`cbagan_ompl.planning.heatmap_sources.SAMPLERS`; ``"uniform"`` leaves
            OMPL's own sampler in place. What ``"auto"`` chose is the ``sampler`` of the result.
        time: limit of the planner's solve, seconds. RRT-like planners stop at their first
            solution, RRT*-like ones go on to the limit.
        iterations: limit of the planner's iterations, whichever comes first.
        range: longest edge that the planner adds, world units; by default OMPL's choice (a
            fifth of the map's diagonal).
        robot: what moves, a point by default. Its shape and turning radius choose the state space
            and the checks, see :class:`cbagan_ompl.Robot`.
        radius: short for ``robot=Robot.disc(radius)``, world units.
        snap: how far a start or goal in an obstacle, in the margin around one, or in unknown space
            is moved at most, to the nearest place where the robot may be, world units.
        model: for the learned sampler (or auto), a loaded model or the file of one; the bundled
            model by default.
        heatmap: to be sampled in place of the learned one: of this map, or an array (H, W) as
            :class:`Heatmap` takes it.
        overlap: let the planner begin on its own sampler while a thread makes the heat map, and
            switch to that when it is there. Then it depends on time which samples the planner gets
            from which source, so that a seed does not repeat a run. With a single processor core
            the heat map is waited for; the ``overlap`` of the result says so.
        simplify: let OMPL's path simplifier shorten the path afterwards.
        goal_tolerance: how far from the goal a path may end, world units; by default a pixel. At 0
            paths end in the goal itself.
        keep_tree: put the edges of the planner's tree into the result.
        options: how samples follow the heat map, see :func:`cbagan_ompl.attach`. Its ``seed``, an
            int, seeds OMPL's generators (which are global) as well. A run limited by ``iterations``
            repeats itself, one limited by ``time`` does not. By default the seed is a fresh one,
            found in the result.
        **changes: single fields of :class:`SamplerOptions`, such as ``seed=1``.

    Returns:
        The result; not finding a path in time is no error, ``solved`` is False then.

    Raises:
        MapError: an unusable map or radius, or a map that the robot fits nowhere on.
        RobotError: no robot, or a robot and a radius.
        TaskError: start or goal outside, in an obstacle, equal, or in separate parts.
        PlannerError: an unknown planner, or one that no hook reaches on this OMPL.
        ConfigError: an option that makes no sense.
        ModelError: an unusable model file.
        HeatmapError: a heat map that does not belong to this grid.

    Example:
        >>> result = plan("bundled:maze", (10, 10), (245, 245), sampler="corridor", seed=1)
        >>> result.solved, result.path.shape[1]
        (True, 2)
    """
    if not isinstance(grid, GridMap | str | PathLike):
        raise MapError(f"grid is a GridMap or the file of a map, got {show(grid)}")
    source = grid if isinstance(grid, GridMap) else GridMap.load(grid)
    workspace = Workspace(source, robot_of(robot, radius))
    goals = split_goals(goal)
    moves: Moves = {}
    distance = finite_number("snap", snap, 0.0)
    if distance > 0:
        if len(goals) > 1:
            raise ConfigError("snap moves one start and one goal: give one goal, or leave snap out")
        (start, goals[0]), moves = workspace.snap(start, goals[0], distance)
    tasks = [workspace.check_task(start, one) for one in goals]
    tolerance = source.resolution
    if goal_tolerance is not None:
        tolerance = finite_number("goal_tolerance", goal_tolerance, 0.0)
    options, seed = _with_seed(SamplerOptions.of(options, changes))
    planner = planner_name(planner)
    is_plain = isinstance(sampler, str) and sampler == UNIFORM
    check_planner(planner, follows_heatmap=not is_plain)
    if heatmap is None:
        sampler, model = resolve_auto(sampler, model, source)
    name, make_heatmap = heatmap_source(sampler, model, heatmap)
    if truth_value("overlap", overlap):
        if make_heatmap is None or heatmap is not None:
            raise ConfigError(
                "overlap is for heat maps that are made while the planner plans: leave it out with "
                "the uniform sampler and with a heat map of your own"
            )
        check_switchable(planner)
    job = _Job(
        map_name=source.name,
        workspace=workspace,
        start=tasks[0][0],
        goals=[task[1] for task in tasks],
        moves=moves,
        tolerance=tolerance,
        planner=planner,
        range=None if range is None else positive_number("range", range),
        limits=Limits.of(planner, time, iterations),
        sampler=name,
        make_heatmap=make_heatmap,
        options=options,
        seed=seed,
        overlap=overlap and can_overlap(),
        simplify=truth_value("simplify", simplify),
        keep_tree=truth_value("keep_tree", keep_tree),
    )
    with compat.log_level(ou.LOG_ERROR):
        return _run(job)


@dataclass(frozen=True)
class _Job:
    """Everything that a plan needs, checked."""

    map_name: str
    workspace: Workspace
    start: NDArray[np.float64]
    goals: list[NDArray[np.float64]]
    moves: Moves
    tolerance: float
    planner: str
    range: float | None
    limits: Limits
    sampler: str
    make_heatmap: HeatmapSource | None
    options: SamplerOptions
    seed: int
    overlap: bool
    simplify: bool
    keep_tree: bool


def _with_seed(options: SamplerOptions) -> tuple[SamplerOptions, int]:
    """Return options with a seed, and the seed that is OMPL's as well."""
    if isinstance(options.seed, np.random.Generator):
        raise ConfigError("plan seeds OMPL as well: give it a whole number as seed")
    seed = secrets.randbits(32) if options.seed is None else whole_number("seed", options.seed, 0)
    return replace(options, seed=seed), seed


def _run(job: _Job) -> PlanResult:
    """Do a job with OMPL's log kept quiet."""
    compat.seed_ompl(job.seed)
    setup = _set_up(job)
    began = perf_counter()
    attachment, prediction = None, None
    if job.overlap:
        prediction = Prediction(partial(_make_heatmap, job))
        attachment = attach(setup, prediction.future, job.options)
        prediction.start()
    elif job.make_heatmap is not None:
        attachment = attach(setup, _make_heatmap(job), job.options)
    waited_s = perf_counter() - began if attachment else 0.0
    try:
        run = solve(setup, job.planner, job.limits, attachment)
        simplify_s = _simplify(setup) if job.simplify and run.is_exact else 0.0
        inference_s = waited_s if prediction is None else prediction.seconds()
        times = _Times(inference_s, waited_s, simplify_s)
        return _result(job, setup, run, attachment, times)
    except BaseException:
        if prediction is not None:
            prediction.wait()
        raise
    finally:
        if attachment is not None:
            attachment.force_detach()


@dataclass(frozen=True)
class _Times:
    """Seconds of all but the solve; ``waited`` are those before it, for the heat map."""

    inference: float
    waited: float
    simplify: float


def _make_heatmap(job: _Job) -> Heatmap:
    assert job.make_heatmap is not None, "it is asked for"
    source, goals = job.make_heatmap, [goal[:2] for goal in job.goals]
    if job.sampler != OWN_HEATMAP:
        source = job.workspace.adapt(source)
    heatmap = heatmap_of_goals(source, job.workspace.grid, job.start[:2], goals)
    follows_heading = job.options.heading.uniform_fraction < 1
    # Made here, because with overlap here is beside the planner.
    if job.workspace.robot.has_heading and heatmap.heading is None and follows_heading:
        return heatmap.directed(np.array(goals))
    return heatmap


def _set_up(job: _Job) -> Any:
    nearest = min(job.goals, key=lambda goal: float(np.hypot(*(goal - job.start)[:2])))
    setup = make_setup(job.workspace, (job.start, nearest), job.tolerance)
    if len(job.goals) > 1:
        set_goals(setup, job.workspace, job.goals, setup.getGoal().getThreshold())
    setup.setPlanner(compat.planner_class(job.planner)(setup.getSpaceInformation()))
    if job.range is not None and not set_range(setup.getPlanner(), job.range):
        raise ConfigError(f"{job.planner} has no range to set: leave it out")
    setup.setup()
    if hangs_at_optimum(job.planner):
        stop_at_optimum(setup, (job.start, nearest), job.tolerance)
    return setup


def _tree_of(setup: Any) -> NDArray[np.float64]:
    read = state_access(setup.getStateSpace()).read
    return compat.tree_edges(compat.planner_data(setup.getPlanner()), read)


def _simplify(setup: Any) -> float:
    began = perf_counter()
    setup.simplifySolution()
    return perf_counter() - began


def _result(
    job: _Job,
    setup: Any,
    run: SolveRecord,
    attachment: Attachment | None,
    times: _Times,
) -> PlanResult:
    workspace, checked, goal = job.workspace, None, job.goals[0]
    if run.is_exact:
        goal = reached_goal(setup, workspace, job.goals)
        checked = checked_path(setup, workspace, (job.start, goal), job.tolerance)
    is_solved = checked is not None
    first_s = run.first_solution_s if is_solved else None
    path = np.empty((0, len(job.start))) if checked is None else checked
    return PlanResult(
        solved=is_solved,
        status=run.status,
        planner=job.planner,
        sampler=job.sampler,
        hook=attachment.hook if attachment else None,
        ompl_version=compat.ompl_version(),
        seed=job.seed,
        map=job.map_name,
        robot=workspace.robot,
        start=job.start,
        goal=goal,
        snapped=job.moves,
        goal_tolerance=job.tolerance,
        path=path,
        trajectory=follow_path(setup, workspace, path, workspace.source.resolution / 2),
        cost=path_cost(setup, workspace, path) if is_solved else inf,
        overlap=job.overlap,
        heatmap_arrival_s=attachment.arrival_s if attachment and job.overlap else None,
        inference_s=times.inference,
        planning_s=run.planning_s,
        simplify_s=times.simplify,
        total_s=times.waited + run.planning_s + times.simplify,
        first_solution_s=first_s,
        first_solution_total_s=None if first_s is None else times.waited + first_s,
        progress=run.progress,
        iterations=run.iterations,
        nodes=run.nodes,
        nodes_at_first_solution=run.nodes_at_first_solution if is_solved else None,
        sample_counts=attachment.sample_counts if attachment else {"learned": 0, "uniform": 0},
        heatmap_kept=False,
        heatmap=attachment.heatmap if attachment else None,
        tree=_tree_of(setup) if job.keep_tree else None,
    )
