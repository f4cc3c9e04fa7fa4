"""Making a planner of OMPL sample a heat map, by whichever hook the installed build offers."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import replace
from types import TracebackType
from typing import Any

from ..errors import PlannerError
from ..sampling.adaptation import AdaptiveMixture
from ..sampling.budget import (
    ADVANCE_WITH_TREE,
    EARNED_BY_UNIFORM_UNSEEN,
    EARNED_BY_UNIFORM_WITH_TREE,
    LearnedBudget,
)
from ..sampling.checks import check_heatmap
from ..sampling.headings import HeadingSampler
from ..sampling.heatmap import Heatmap
from ..sampling.options import OPTIMIZING_SHARPNESS, SamplerOptions
from ..sampling.roadmap import RoadmapMixture
from ..sampling.sampler import HeatmapSampler
from . import compat
from .attachable import check_task, planner_of, setup_of, warn_of_single_controls
from .bounds_steering import SteeringMonitor
from .goal_monitor import goal_monitor
from .hooks import (
    BOUNDS_STEERING,
    GOAL_INJECTION,
    hook_of,
    needs_directed_controls,
    samples_are_nodes,
    stops_at_first,
    wants_sharp,
)
from .installation import Wiring, install
from .monitor import PlannerMonitor, release_forgotten
from .planner_kinds import class_name, plans_controls
from .pose_headings import with_headings
from .states import drives_backwards, position_bounds, state_access

# OMPL's range of a planner that was given none, as a fraction of the extent of the space.
_OMPL_RANGE = 0.2
# How far around a node its tree is taken to be, as a fraction of the range.
_REACH = 0.8

# The hooks whose callbacks see the planner's tree, each with what watches it.
_MONITORS = {GOAL_INJECTION: goal_monitor, BOUNDS_STEERING: SteeringMonitor}


class Attachment:
    """What ties a planner to a heat map; also a context manager that detaches at its end.

    Attributes:
        hook: name of the hook in use.

    Example:
        >>> from ompl import geometric as og, util as ou
        >>> from cbagan_ompl import GridMap, Heatmap, tasks_of
        >>> from cbagan_ompl.planning.problem import make_setup
        >>> from cbagan_ompl.planning.workspace import Workspace
        >>> ou.setLogLevel(ou.LOG_NONE)
        >>> grid = GridMap.load("bundled:maze")
        >>> task = tasks_of("bundled:maze", grid)[0]
        >>> endpoints = grid.check_task(task.start, task.goal)
        >>> setup = make_setup(Workspace(grid), endpoints, tolerance=1.0)
        >>> setup.setPlanner(og.RRTstar(setup.getSpaceInformation()))
        >>> attachment = attach(setup, Heatmap.uniform(grid))
        >>> attachment.hook, attachment.sample_counts
        ('goal-injection', {'learned': 0, 'uniform': 0})
        >>> attachment.detach()
    """

    def __init__(
        self,
        hook: str,
        sampler: HeatmapSampler,
        monitor: PlannerMonitor,
        goal: Any,
        undo: Callable[[], None],
    ) -> None:
        self.hook = hook
        # Kept, because whoever plans to it does not keep it.
        self._goal = goal
        self._sampler = sampler
        self._monitor = monitor
        self._undo: Callable[[], None] | None = undo

    @property
    def sample_counts(self) -> dict[str, int]:
        """Samples that the planner has had so far: ``{"learned": n, "uniform": m}``."""
        return self._sampler.sample_counts

    def detach(self) -> None:
        """Give the planner back as it was before.

        The planner is cleared, since samplers that it has made go only with its tree; solution
        paths stay in the problem definition. Calling it again does nothing.

        Raises:
            PlannerError: the planner is in the middle of a solve, from one of whose callbacks this
                is called: it would go on in a tree that is no more. That is known of the setup's
                ``solve``, and of any other once it has asked for a sample.
        """
        if self._undo is not None and self._monitor.is_planning(sys._getframe(1)):
            raise PlannerError(
                "detach() was called while the planner plans, which would end in a crash: call it "
                "after solve() has returned"
            )
        self.force_detach()

    def force_detach(self) -> None:
        """Detach without a look at whether the planner plans, where it is known that it does not.

        An event of ``ompl.tools.Benchmark`` after a run without any path looks like a solve.
        """
        undo, self._undo = self._undo, None
        if undo is not None:
            undo()

    def __enter__(self) -> Attachment:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.detach()


def attach(
    setup: Any, heatmap: Heatmap, options: SamplerOptions | None = None, **changes: Any
) -> Attachment:
    """Make a planner sample a heat map.

    Call it after ``setup.setPlanner(...)`` and after the planner's options, the start and the
    goal were set. What the planner has done so far is cleared, because samplers that it has made
    go only with its tree. Its options stay as they are but for what the hook needs: the goal bias
    under goal injection, and for informed sampling under a StateSampler, rejection instead of
    direct sampling. For another start or goal: detach, set it, attach again; a solve of a setup
    whose goal was replaced meanwhile raises an error. Planners other than the attached one get the
    goal itself, also while it is attached. Until :meth:`Attachment.detach` the setup, the planner
    and the heat map keep each other alive; where nothing else refers to them any more, they are let
    go by the next ``attach`` or by Python's garbage collector. That does not see references through
    OMPL: if a validity checker refers to its own setup, or an attribute of the setup to the
    attachment, only ``detach`` lets go of them.

    Args:
        setup: a ``SimpleSetup`` of ``ompl.geometric`` or ``ompl.control``, or a planner with its
            problem definition, where there is no setup. The solves of such a planner are not
            watched on OMPL 2.0: a goal that is replaced while it is attached is not noticed there.
        heatmap: what to sample, in the coordinates of the setup's space. Where states have a yaw
            and the heat map no headings, those of :meth:`.Heatmap.directed` to the goal are taken.
        options: how samples follow the heat map. ``sharpness`` None stands for 1 with planners that
            stop at their first path other than RRTConnect, and for
            :data:`cbagan_ompl.sampling.options.OPTIMIZING_SHARPNESS` with those that go on.
            ``adaptation`` is for planners that goal injection reaches. ``seed`` is that of our
            samples alone; seed OMPL as well for plans that can be repeated.
        **changes: single fields of :class:`SamplerOptions`, such as ``seed=1``.

    Returns:
        A handle with ``.hook``, ``.sample_counts`` and ``.detach()``.

    Warns:
        CbaganOmplWarning: a control planner tries one control for each sample, so that samples make
            no difference to it.

    Raises:
        PlannerError: ``setup`` is neither, no planner is set, no hook of this build reaches it, it
            is written in Python, it samples a heat map already, its space has no (x, y), the start
            or goal is missing, or the goal cannot be sampled.
        TaskError: the start is outside or in an obstacle of the heat map's map.
        HeatmapError: not a :class:`Heatmap`, or one that is 0 everywhere in the bounds of the
            space.
        ConfigError: an option that makes no sense, see :class:`SamplerOptions`.

    Example:
        >>> from ompl import base as ob, geometric as og, util as ou
        >>> from cbagan_ompl import GridMap, GridValidityChecker, Heatmap, tasks_of
        >>> from cbagan_ompl.planning.problem import make_setup
        >>> from cbagan_ompl.planning.workspace import Workspace
        >>> ou.setLogLevel(ou.LOG_NONE)
        >>> grid = GridMap.load("bundled:rooms")
        >>> task = tasks_of("bundled:rooms", grid)[0]
        >>> endpoints = grid.check_task(task.start, task.goal)
        >>> setup = make_setup(Workspace(grid), endpoints, tolerance=1.0)
        >>> setup.setPlanner(og.RRT(setup.getSpaceInformation()))
        >>> with attach(setup, Heatmap.corridor(grid, task.start, task.goal), seed=0) as attachment:
        ...     _ = setup.solve(5.0)
        ...     attachment.hook, attachment.sample_counts["learned"] > 0
        ('goal-injection', True)
    """
    options = SamplerOptions.of(options, changes)
    check_heatmap(heatmap)
    setup = setup_of(setup)
    planner = planner_of(setup)
    name = class_name(planner)
    hook = hook_of(name)
    if needs_directed_controls(name):
        warn_of_single_controls(planner)
    if options.sharpness is None:
        sharpness = OPTIMIZING_SHARPNESS if wants_sharp(name) else 1.0
        options = replace(options, sharpness=sharpness)
    rng = options.generator()
    space = setup.getStateSpace()
    release_forgotten()
    starts = check_task(setup, heatmap, state_access(space))
    heatmap = with_headings(setup, heatmap, options.heading)
    headings = HeadingSampler(heatmap, options.heading, rng, drives_backwards(space))
    states = state_access(space, headings)
    monitor = _MONITORS.get(hook, PlannerMonitor)(setup, states)
    budget = _budget_of(planner, name, hook) if options.adaptation.stagnation else None
    mixture: AdaptiveMixture | RoadmapMixture | None = None
    if hook in _MONITORS:  # callbacks see the tree
        reach = _reach_of(planner)
        mixture = AdaptiveMixture(heatmap, options.adaptation, reach, monitor, budget)
    elif samples_are_nodes(name) and options.adaptation.coverage:
        mixture = RoadmapMixture(heatmap, _reach_of(planner), budget)
    sampler = HeatmapSampler(heatmap, replace(options, seed=rng), monitor, mixture, budget)
    sampler.keep_inside(*position_bounds(space))
    # Samplers and solutions that are there already would keep the planner from asking for samples.
    compat.clear_planner(planner)
    setup.getProblemDefinition().clearSolutionPaths()
    undo_hook = install(hook, Wiring(setup, planner, name, states, sampler, monitor))
    monitor.register()
    sampler.prepare()
    if mixture is not None and options.adaptation.connectivity:
        monitor.prepare(heatmap, starts)

    def undo() -> None:
        # First: a planner without samplers makes none while its options change. One that has not
        # sampled yet may be at the beginning of a solve that is not watched.
        if monitor.has_planned and compat.planner_data(planner).numVertices() > 0:
            planner.clear()
        monitor.release()
        undo_hook()

    return Attachment(hook, sampler, monitor, setup.getGoal(), undo)


def _reach_of(planner: Any) -> float:
    """Return how far around a node a tree need not grow again, world units: most of its range.

    Where controls are planned it is 0: what is near in position may be far on the way.
    """
    if plans_controls(planner):
        return 0.0
    # Before its setup a planner may have no range yet; OMPL then takes a fraction of the space.
    si = planner.getSpaceInformation()
    range = planner.getRange() if hasattr(planner, "getRange") else 0.0
    return _REACH * float(range or _OMPL_RANGE * si.getMaximumExtent())


def _budget_of(planner: Any, name: str, hook: str) -> LearnedBudget:
    if hook in _MONITORS:
        return LearnedBudget(EARNED_BY_UNIFORM_WITH_TREE, advance=ADVANCE_WITH_TREE)
    if stops_at_first(name) or hasattr(planner, "bestCost"):
        return LearnedBudget()
    return LearnedBudget(EARNED_BY_UNIFORM_UNSEEN, is_halved=False)
