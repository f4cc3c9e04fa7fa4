"""OMPL samplers that are OMPL's own until a heat map is there, and sample that from then on."""

from __future__ import annotations

import sys
from typing import Any

from ..sampling.sampler import HeatmapSampler
from . import compat
from .awaited import AwaitedHeatmap
from .compat import ob
from .monitor import PlannerMonitor
from .ompl_samplers import HeatmapStateSampler, HeatmapValidStateSampler


class SwitchingStateSampler(ob.StateSampler):  # type: ignore[misc]
    """The default sampler of a space, until the heat map is there.

    Args:
        space: the state space.
        awaited: the heat map.
        monitor: of the planner.
    """

    def __init__(self, space: Any, awaited: AwaitedHeatmap, monitor: PlannerMonitor) -> None:
        super().__init__(space)
        self._space = space
        self._sampler: Any = space.allocDefaultStateSampler()
        self._awaited: AwaitedHeatmap | None = awaited
        self._monitor = monitor

    def sampleUniform(self, state: Any) -> None:  # noqa: N802
        """Sample a state, see :class:`HeatmapStateSampler`."""
        self._current().sampleUniform(state)
        self._monitor.note_call(sys._getframe(1))

    def sampleUniformNear(self, state: Any, near: Any, distance: float) -> None:  # noqa: N802
        """Sample a state near another one, see :class:`HeatmapStateSampler`."""
        self._current().sampleUniformNear(state, near, distance)
        self._monitor.note_call(sys._getframe(1))

    def sampleGaussian(self, state: Any, mean: Any, std_dev: float) -> None:  # noqa: N802
        """Sample a state around another one, see :class:`HeatmapStateSampler`."""
        self._current().sampleGaussian(state, mean, std_dev)
        self._monitor.note_call(sys._getframe(1))

    def _current(self) -> Any:
        sampler = _arrived(self._awaited)
        if sampler is not None:
            self._sampler, self._awaited = HeatmapStateSampler(self._space, sampler), None
        return self._sampler


class SwitchingValidStateSampler(ob.ValidStateSampler):  # type: ignore[misc]
    """OMPL's UniformValidStateSampler, until the heat map is there.

    Args:
        si: the space information.
        awaited: the heat map.
        monitor: of the planner.
    """

    def __init__(self, si: Any, awaited: AwaitedHeatmap, monitor: PlannerMonitor) -> None:
        super().__init__(si)
        self._si = si
        self._sampler: Any = ob.UniformValidStateSampler(si)
        self._awaited: AwaitedHeatmap | None = awaited
        self._monitor = monitor

    def sample(self, state: Any) -> bool:
        """Sample a valid state; return False when no attempt gave one."""
        valid = bool(self._current().sample(state))
        self._monitor.note_call(sys._getframe(1))
        return valid

    def sampleNear(self, state: Any, near: Any, distance: float) -> bool:  # noqa: N802
        """Sample a valid state near another one."""
        valid = bool(self._current().sampleNear(state, near, distance))
        self._monitor.note_call(sys._getframe(1))
        return valid

    def _current(self) -> Any:
        sampler = _arrived(self._awaited)
        if sampler is not None:
            self._sampler, self._awaited = HeatmapValidStateSampler(self._si, sampler), None
        self._sampler.setNrAttempts(self.getNrAttempts())
        return self._sampler


def switching_state_sampler_allocator(awaited: AwaitedHeatmap, monitor: PlannerMonitor) -> Any:
    """Return what ``StateSpace.setStateSamplerAllocator`` takes, for a heat map that is awaited."""

    def allocate(space: Any) -> Any:
        _restart(awaited)
        return SwitchingStateSampler(space, awaited, monitor)

    return compat.state_sampler_allocator(allocate)


def switching_valid_state_sampler_allocator(
    awaited: AwaitedHeatmap, monitor: PlannerMonitor
) -> Any:
    """Return what ``SpaceInformation.setValidStateSamplerAllocator`` takes, for one awaited."""

    def allocate(si: Any) -> Any:
        _restart(awaited)
        return SwitchingValidStateSampler(si, awaited, monitor)

    return compat.valid_state_sampler_allocator(allocate)


def _arrived(awaited: AwaitedHeatmap | None) -> HeatmapSampler | None:
    return None if awaited is None or awaited.is_pending() else awaited.sampler


def _restart(awaited: AwaitedHeatmap) -> None:
    """Note that the planner begins anew, which is when it makes its sampler."""
    sampler = _arrived(awaited)
    if sampler is not None:
        sampler.restart()
