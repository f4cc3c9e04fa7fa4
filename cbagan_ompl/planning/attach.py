"""Making a planner of OMPL draw from a heat map, by whichever hook the installed build offers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from types import TracebackType
from typing import Any

import numpy as np

from ..draws import DEFAULT_UNIFORM_FRACTION, DrawStream
from ..errors import PlannerError
from ..heatmap import Heatmap
from . import compat, samplers
from .goal_injection import InjectedGoal
from .hooks import GOAL_INJECTION, INFORMED, STATE_SAMPLER, VALID_STATE_SAMPLER, hook_of
from .positions import Positions, positions_of
from .progress import PlannerProgress


class Attachment:
    """The link between a planner and a heat map; also a context manager that detaches at its end.

    Attributes:
        hook: name of the hook in use.
    """

    def __init__(self, hook: str, stream: DrawStream, undo: Callable[[], None]) -> None:
        self.hook = hook
        self._stream = stream
        self._undo: Callable[[], None] | None = undo

    @property
    def draws(self) -> dict[str, int]:
        """Draws that the planner has had so far: ``{"learned": n, "uniform": m}``."""
        return self._stream.draws

    def reset_counts(self) -> None:
        """Start counting draws at 0 again."""
        self._stream.reset_counts()

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
) -> Attachment:
    """Make the planner of a SimpleSetup draw from a heat map.

    Call it after ``setup.setPlanner(...)`` and after the start and the goal were set, before
    ``solve`` (or after ``clear``). The planner's parameters stay as they are but for what the
    hook needs: the goal bias under goal injection, and for informed planners under a
    StateSampler, rejection instead of direct informed sampling. Until :meth:`Attachment.detach`
    the planner and the heat map keep each other alive.

    Args:
        setup: an ``ompl.geometric.SimpleSetup``.
        heatmap: where to draw, in the coordinates of the setup's space.
        uniform_fraction: share of draws that stays uniform over free space, in (0, 1].
        seed: seed or generator of the draws; seed OMPL as well for repeatable plans.

    Returns:
        A handle with ``.hook``, ``.draws`` and ``.detach()``.

    Raises:
        PlannerError: no planner is set, no hook of this build reaches it, its space has no
            (x, y), or the start or goal is missing.
        ConfigError: ``uniform_fraction`` outside (0, 1].
    """
    planner = setup.getPlanner()
    if planner is None:
        raise PlannerError("attach needs a planner: call setup.setPlanner(...) first")
    if setup.getGoal() is None:
        raise PlannerError("attach needs the task: set the start and the goal of the setup first")
    name = _class_name(planner)
    hook = hook_of(name)
    stream = DrawStream(heatmap, uniform_fraction, seed)
    positions = positions_of(setup.getStateSpace(), stream.rng)
    progress = PlannerProgress(setup, positions)
    if name in INFORMED:
        stream.follow(progress.path_length, progress.informed_set)
    undo_hook = _INSTALL[hook](_Parts(setup, planner, positions, stream, progress))

    def undo() -> None:
        progress.release()
        planner.clear()  # first: a planner without samplers makes none while its options change
        undo_hook()

    return Attachment(hook, stream, undo)


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
    positions: Positions
    stream: DrawStream
    progress: PlannerProgress


def _use_state_sampler(parts: _Parts) -> Callable[[], None]:
    space, stream = parts.setup.getStateSpace(), parts.stream
    space.setStateSamplerAllocator(samplers.state_sampler_allocator(stream.heatmap, stream=stream))
    informed = _class_name(parts.planner) in INFORMED
    restore = _reject_uninformed(parts.planner) if informed else None

    def undo() -> None:
        space.clearStateSamplerAllocator()
        if restore is not None:
            restore()

    return undo


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
    setup.setGoal(InjectedGoal(si, original, parts.positions, parts.stream, parts.progress))
    planner.setGoalBias(1.0)

    def undo() -> None:
        setup.setGoal(original)
        planner.setGoalBias(bias)

    return undo


_INSTALL = {
    STATE_SAMPLER: _use_state_sampler,
    VALID_STATE_SAMPLER: _use_valid_state_sampler,
    GOAL_INJECTION: _inject_goals,
}
