"""Making a planner of OMPL draw from a heat map, by whichever hook the installed build offers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from types import TracebackType
from typing import Any

import numpy as np

from ..errors import PlannerError
from ..sampling.adaptation import FULL_ADAPTATION, Adaptation, Trust
from ..sampling.heatmap import Heatmap
from ..sampling.sampler import DEFAULT_UNIFORM_FRACTION, OPTIMIZING_SHARPNESS, HeatmapSampler
from . import compat
from . import ompl_samplers as samplers
from .compat import ob, ou
from .goal_injection import InjectedGoal
from .hooks import (
    GOAL_INJECTION,
    KEEP_SAMPLER,
    STATE_SAMPLER,
    STOP_AT_FIRST,
    VALID_STATE_SAMPLER,
    hook_of,
)
from .monitor import PlannerMonitor, is_followed
from .states import StateAccess, position_bounds, state_access

# OMPL's range of a planner that was given none, as a share of the extent of the space.
_OMPL_RANGE = 0.2
# How far around a node its tree is taken to be, as a share of the range.
_REACH = 0.8


class Attachment:
    """The link between a planner and a heat map; also a context manager that detaches at its end.

    Attributes:
        hook: name of the hook in use.
    """

    def __init__(self, hook: str, stream: HeatmapSampler, undo: Callable[[], None]) -> None:
        self.hook = hook
        self._stream = stream
        self._undo: Callable[[], None] | None = undo

    @property
    def sample_counts(self) -> dict[str, int]:
        """Draws that the planner has had so far: ``{"learned": n, "uniform": m}``."""
        return self._stream.sample_counts

    def detach(self) -> None:
        """Give the planner back as it was before.

        The planner is cleared, since samplers that it has made go only with its tree; solution
        paths stay in the problem definition. Calling it again does nothing.
        """
        if self._undo is not None:
            self._undo()
            self._undo = None

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
    heatmap: Heatmap,
    uniform_fraction: float = DEFAULT_UNIFORM_FRACTION,
    seed: int | np.random.Generator | None = None,
    adaptation: Adaptation = FULL_ADAPTATION,
    sharpness: float | None = None,
) -> Attachment:
    """Make the planner of a SimpleSetup draw from a heat map.

    Call it after ``setup.setPlanner(...)`` and after the planner's options, the start and the
    goal were set. What the planner has done so far is cleared, because samplers that it has made
    go only with its tree. Its options stay as they are but for what the hook needs: the goal bias
    under goal injection, and for informed sampling under a StateSampler, rejection instead of
    direct sampling. For another planner, start or goal: detach, set it, attach again. Until
    :meth:`Attachment.detach` the planner and the heat map keep each other alive.

    Args:
        setup: an ``ompl.geometric.SimpleSetup``.
        heatmap: where to draw, in the coordinates of the setup's space.
        uniform_fraction: share of draws that stays uniform over free space, in (0, 1].
        seed: seed or generator of the draws; seed OMPL as well for repeatable plans.
        adaptation: how the share of the heat map changes while the planner plans, see
            :mod:`cbagan_ompl.sampling.adaptation`; for planners that goal injection reaches.
        sharpness: power of the heat map that the density of the draws is proportional to. By
            default 1 for planners that stop at their first path, and
            :data:`cbagan_ompl.sampling.sampler.OPTIMIZING_SHARPNESS` for those that go on.

    Returns:
        A handle with ``.hook``, ``.sample_counts`` and ``.detach()``.

    Raises:
        PlannerError: no planner is set, no hook of this build reaches it, it draws from a heat
            map already, its space has no (x, y), the start or goal is missing, or the goal
            cannot be sampled.
        HeatmapError: the heat map is 0 everywhere in the bounds of the space.
        ConfigError: ``uniform_fraction`` outside (0, 1], or a ``sharpness`` that is no finite
            number above 0.
    """
    planner = setup.getPlanner()
    _check_attachable(setup, planner)
    name = _class_name(planner)
    hook = hook_of(name)
    if sharpness is None:
        sharpness = 1.0 if name in STOP_AT_FIRST else OPTIMIZING_SHARPNESS
    stream = HeatmapSampler(heatmap, uniform_fraction, seed, sharpness)
    space = setup.getStateSpace()
    positions = state_access(space, stream.rng)
    stream.keep_inside(*position_bounds(space))
    # Samplers and solutions that are there already would keep the planner from asking for draws.
    planner.clear()
    setup.getProblemDefinition().clearSolutionPaths()
    progress = PlannerMonitor(setup, positions)
    stream.follow(progress.best_cost, progress.informed_set if _is_informed(planner) else None)
    parts = _Parts(setup, planner, name, positions, stream, progress, adaptation)
    undo_hook = _INSTALL[hook](parts)
    stream.prepare()

    def undo() -> None:
        progress.release()
        planner.clear()  # first: a planner without samplers makes none while its options change
        undo_hook()

    return Attachment(hook, stream, undo)


def _check_attachable(setup: Any, planner: Any) -> None:
    if planner is None:
        raise PlannerError("attach needs a planner: call setup.setPlanner(...) first")
    if setup.getGoal() is None or setup.getProblemDefinition().getStartStateCount() == 0:
        raise PlannerError("attach needs the task: set the start and the goal of the setup first")
    if not isinstance(setup.getGoal(), ob.GoalSampleableRegion):
        raise PlannerError(
            "attach needs a goal that can be sampled, such as a GoalState or GoalStates, this one "
            f"is a {type(setup.getGoal()).__name__}"
        )
    if is_followed(planner):
        raise PlannerError(
            "this planner draws from a heat map already: call detach() of its attachment first"
        )


def _is_informed(planner: Any) -> bool:
    return hasattr(planner, "getInformedSampling") and planner.getInformedSampling()


def _class_name(planner: Any) -> str:
    """OMPL's name of the class, also for Python subclasses of it."""
    names = compat.planner_names()
    return next(
        (kind.__name__ for kind in type(planner).__mro__ if kind.__name__ in names),
        type(planner).__name__,
    )


@dataclass(frozen=True)
class _Parts:
    """What the installation of a hook works with."""

    setup: Any
    planner: Any
    name: str
    positions: StateAccess
    stream: HeatmapSampler
    progress: PlannerMonitor
    adaptation: Adaptation


def _use_state_sampler(parts: _Parts) -> Callable[[], None]:
    space, stream = parts.setup.getStateSpace(), parts.stream
    planner = parts.planner
    space.setStateSamplerAllocator(samplers.state_sampler_allocator(stream.heatmap, stream=stream))
    restore = _reject_uninformed(planner) if _is_informed(planner) else None
    keeps_sampler = parts.name in KEEP_SAMPLER
    if keeps_sampler:
        _renew_sampler(planner)

    def undo() -> None:
        space.clearStateSamplerAllocator()
        if restore is not None:
            restore()
        if keeps_sampler:
            _renew_sampler(planner)

    return undo


def _renew_sampler(planner: Any) -> None:
    """Set a planner up again, which says something of it on OMPL's log."""
    if planner.isSetup():
        with compat.log_level(ou.LOG_ERROR):
            planner.setup()


def _reject_uninformed(planner: Any) -> Callable[[], None]:
    """Direct informed sampling makes its own sampler; rejection asks the one that was set."""
    informed, rejection = planner.getInformedSampling(), planner.getSampleRejection()
    planner.setInformedSampling(False)
    planner.setSampleRejection(True)

    def restore() -> None:
        planner.setSampleRejection(False)
        planner.setInformedSampling(informed)
        planner.setSampleRejection(rejection)

    return restore


def _use_valid_state_sampler(parts: _Parts) -> Callable[[], None]:
    si, stream = parts.setup.getSpaceInformation(), parts.stream
    si.setValidStateSamplerAllocator(
        samplers.valid_state_sampler_allocator(stream.heatmap, stream=stream)
    )
    return lambda: compat.clear_valid_state_sampler(si)


def _inject_goals(parts: _Parts) -> Callable[[], None]:
    setup, planner = parts.setup, parts.planner
    original, bias = setup.getGoal(), planner.getGoalBias()
    si = setup.getSpaceInformation()
    trust = Trust(
        parts.stream.heatmap,
        parts.adaptation,
        _reach(planner, si),
        parts.progress.nodes,
        parts.progress.set_share,
    )
    parts.stream.adapt(trust)
    injected = InjectedGoal(si, original, parts.positions, parts.stream, parts.progress, trust)
    setup.setGoal(injected)
    parts.progress.set_share(1.0)

    def undo() -> None:
        if setup.getGoal() is injected:
            setup.setGoal(original)
        planner.setGoalBias(bias)

    return undo


def _reach(planner: Any, si: Any) -> float:
    """How far around a node a tree need not grow again, world units: most of its longest edge."""
    # Before its setup a planner may have no range yet; OMPL then takes a share of the space.
    longest = planner.getRange() or _OMPL_RANGE * si.getMaximumExtent()
    return _REACH * float(longest)


_INSTALL = {
    STATE_SAMPLER: _use_state_sampler,
    VALID_STATE_SAMPLER: _use_valid_state_sampler,
    GOAL_INJECTION: _inject_goals,
}
