"""Making a planner of OMPL sample a heat map, by whichever hook the installed build offers."""

from __future__ import annotations

import sys
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import replace
from types import TracebackType
from typing import Any

from ..errors import PlannerError
from ..sampling.checks import check_heatmap
from ..sampling.heatmap import Heatmap
from ..sampling.options import OPTIMIZING_SHARPNESS, SamplerOptions
from ..sampling.sampler import HeatmapSampler
from . import compat
from .attachable import check_task, planner_of, setup_of, warn_of_single_controls
from .awaited import AwaitedHeatmap, result_of
from .goal_monitor import goal_monitor
from .hooks import (
    BOUNDS_STEERING,
    GOAL_INJECTION,
    check_switchable,
    hook_of,
    needs_directed_controls,
    wants_sharp,
)
from .installation import Wiring, install
from .monitor import PlannerMonitor, release_forgotten
from .planner_kinds import class_name
from .sampler_making import SamplerMaker
from .states import StateAccess, state_access
from .steering_monitor import SteeringMonitor

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
        source: HeatmapSampler | AwaitedHeatmap,
        monitor: PlannerMonitor,
        goal: Any,
        undo: Callable[[], None],
    ) -> None:
        self.hook = hook
        # Kept, because whoever plans to it does not keep it.
        self._goal = goal
        self._source = source
        self._monitor = monitor
        self._undo: Callable[[], None] | None = undo

    @property
    def sample_counts(self) -> dict[str, int]:
        """Samples that the planner has had so far: ``{"learned": n, "uniform": m}``.

        Both are 0 while the heat map is waited for: samples are OMPL's own then.
        """
        sampler = self._sampler
        return {"learned": 0, "uniform": 0} if sampler is None else sampler.sample_counts

    @property
    def heatmap(self) -> Heatmap | None:
        """What is sampled; None while it is waited for."""
        sampler = self._sampler
        return None if sampler is None else sampler.heatmap

    @property
    def arrival_s(self) -> float | None:
        """Seconds from ``attach`` until the planner began to sample a heat map that was waited for.

        It is 0 for one that was there, and None while it is waited for.
        """
        source = self._source
        return source.arrival_s if isinstance(source, AwaitedHeatmap) else 0.0

    @property
    def has_failed(self) -> bool:
        """Whether a heat map that was waited for could not be made."""
        source = self._source
        return (
            isinstance(source, AwaitedHeatmap) and source.is_pending() and source.error is not None
        )

    @property
    def _sampler(self) -> HeatmapSampler | None:
        source = self._source
        return source.sampler if isinstance(source, AwaitedHeatmap) else source

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
    setup: Any,
    heatmap: Heatmap | Future[Heatmap],
    options: SamplerOptions | None = None,
    **changes: Any,
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
    go by the next ``attach``, or when another attached setup solves. References through OMPL cannot
    be seen: if a validity checker refers to its own setup, or an attribute of the setup to the
    attachment, only ``detach`` lets go of them.

    Args:
        setup: a ``SimpleSetup`` of ``ompl.geometric`` or ``ompl.control``, or a planner with its
            problem definition, where there is no setup. The solves of such a planner are not
            watched on OMPL 2.0: a goal that is replaced while it is attached is not noticed there.
        heatmap: what to sample, in the coordinates of the setup's space. Where states have a yaw
            and the heat map no headings, those of :meth:`.Heatmap.directed` to the goal are taken.
            A future of it, whose thread makes it meanwhile: the planner samples on its own until it
            is there. If it fails, the solve of the setup raises that when it has ended.
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
            or goal is missing, the goal cannot be sampled, or the heat map is a future and the
            planner makes all its samples at once, at the beginning.
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
    if isinstance(heatmap, Future) and heatmap.done():
        heatmap = result_of(heatmap)
    is_awaited = isinstance(heatmap, Future)
    if not is_awaited:
        check_heatmap(heatmap)
    setup = setup_of(setup)
    planner = planner_of(setup)
    name = class_name(planner)
    hook = hook_of(name)
    if is_awaited:
        check_switchable(name)
    if needs_directed_controls(name):
        warn_of_single_controls(planner)
    if options.sharpness is None:
        sharpness = OPTIMIZING_SHARPNESS if wants_sharp(name) else 1.0
        options = replace(options, sharpness=sharpness)
    release_forgotten()
    states: StateAccess = state_access(setup.getStateSpace())
    starts = check_task(setup, states)
    monitor = _MONITORS.get(hook, PlannerMonitor)(setup, states)
    maker = SamplerMaker(name, hook, options, monitor, starts, options.generator())
    source: HeatmapSampler | AwaitedHeatmap
    awaited = None
    if isinstance(heatmap, Future):
        source = awaited = AwaitedHeatmap(heatmap, maker.make_late)
    else:
        made = maker.make(heatmap)
        assert made is not None, "the setup is there"
        source, states = made
    # Samplers and solutions that are there already would keep the planner from asking for samples.
    compat.clear_planner(planner)
    setup.getProblemDefinition().clearSolutionPaths()
    undo_hook = install(hook, Wiring(setup, planner, name, states, source, monitor))
    monitor.register(awaited)

    def undo() -> None:
        # First: a planner without samplers makes none while its options change. One that has not
        # sampled yet may be at the beginning of a solve that is not watched.
        if monitor.has_planned and compat.planner_data(planner).numVertices() > 0:
            planner.clear()
        monitor.release()
        undo_hook()

    return Attachment(hook, source, monitor, setup.getGoal(), undo)
