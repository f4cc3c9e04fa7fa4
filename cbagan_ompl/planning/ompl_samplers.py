"""OMPL samplers that sample a heat map, and the allocators that OMPL's setters take."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Any

from ..errors import ConfigError
from ..sampling.heatmap import Heatmap
from ..sampling.options import SamplerOptions
from ..sampling.sampler import HeatmapSampler
from . import compat
from .compat import ob, typed_state
from .states import StateAccess, drives_backwards, position_bounds, space_of, state_access


class HeatmapStateSampler(ob.StateSampler):  # type: ignore[misc]
    """A state sampler whose positions and headings come from a heat map.

    Headings are uniform where the heat map knows none: :meth:`.Heatmap.directed` makes some.

    Args:
        space: RealVectorStateSpace(2), SE2StateSpace, DubinsStateSpace, ReedsSheppStateSpace, or a
            compound space whose first part is one of them; the other parts are sampled uniformly.
        heatmap: what to sample; or a :class:`HeatmapSampler`, to share it with other samplers.
        options: how samples follow the heat map; ``sharpness`` None stands for 1.
        **changes: single fields of :class:`SamplerOptions`, such as ``seed=1``.

    Raises:
        ConfigError: an option that makes no sense, or options beside a :class:`HeatmapSampler`,
            which has its own.
        HeatmapError: neither a :class:`Heatmap` nor a :class:`HeatmapSampler`.
        PlannerError: no state space, or its states have no (x, y).

    Example:
        >>> from ompl import base as ob
        >>> from cbagan_ompl import GridMap, Heatmap
        >>> space = ob.RealVectorStateSpace(2)
        >>> space.setBounds(0, 256)
        >>> grid = GridMap.load("bundled:rooms")
        >>> sampler = HeatmapStateSampler(space, Heatmap.uniform(grid), seed=0)
        >>> sampler.sample_counts
        {'learned': 0, 'uniform': 0}
    """

    def __init__(
        self,
        space: Any,
        heatmap: Heatmap | HeatmapSampler,
        options: SamplerOptions | None = None,
        **changes: Any,
    ) -> None:
        self._sampler = _heatmap_sampler(heatmap, options, changes)
        self._states = _writable(space, self._sampler)
        super().__init__(space)
        self._sampler.keep_inside(*position_bounds(space))

    @property
    def sample_counts(self) -> dict[str, int]:
        """Samples so far: ``{"learned": n, "uniform": m}``."""
        return self._sampler.sample_counts

    def sampleUniform(self, state: Any) -> None:  # noqa: N802
        """Sample the heat map mixed with uniform: what planners take for "uniform"."""
        self._sampler.monitor.note_call(sys._getframe(1))
        x, y = self._sampler.next()
        self._states.write(typed_state(state), x, y)
        self._sampler.on_new_node(x, y, False)

    def sampleUniformNear(self, state: Any, near: Any, distance: float) -> None:  # noqa: N802
        """Sample the heat map inside the box of half width ``distance`` around ``near``."""
        self._sampler.monitor.note_call(sys._getframe(1))
        x, y = self._states.read(typed_state(near))
        self._states.write(typed_state(state), *self._sampler.near(x, y, distance))

    def sampleGaussian(self, state: Any, mean: Any, std_dev: float) -> None:  # noqa: N802
        """Sample the product of the heat map and a Gaussian around ``mean``."""
        self._sampler.monitor.note_call(sys._getframe(1))
        x, y = self._states.read(typed_state(mean))
        self._states.write(typed_state(state), *self._sampler.gaussian(x, y, std_dev))


class HeatmapValidStateSampler(ob.ValidStateSampler):  # type: ignore[misc]
    """A valid-state sampler whose positions and headings come from a heat map.

    Headings are uniform where the heat map knows none: :meth:`.Heatmap.directed` makes some.

    Samples are checked with the space information's own validity checker, up to
    ``getNrAttempts()`` times (100 unless set), as OMPL's UniformValidStateSampler does.

    Args:
        si: the space information; its space as for :class:`HeatmapStateSampler`.
        heatmap: what to sample; or a :class:`HeatmapSampler`, to share it with other samplers.
        options: how samples follow the heat map; ``sharpness`` None stands for 1.
        **changes: single fields of :class:`SamplerOptions`, such as ``seed=1``.

    Raises:
        ConfigError: an option that makes no sense, or options beside a :class:`HeatmapSampler`,
            which has its own.
        HeatmapError: neither a :class:`Heatmap` nor a :class:`HeatmapSampler`.
        PlannerError: no space information, or the states of its space have no (x, y).

    Example:
        >>> from ompl import base as ob
        >>> from cbagan_ompl import GridMap, GridValidityChecker, Heatmap
        >>> space = ob.RealVectorStateSpace(2)
        >>> space.setBounds(0, 256)
        >>> si = ob.SpaceInformation(space)
        >>> grid = GridMap.load("bundled:rooms")
        >>> si.setStateValidityChecker(GridValidityChecker(si, grid))
        >>> sampler = HeatmapValidStateSampler(si, Heatmap.uniform(grid), seed=0)
        >>> sampler.sample_counts
        {'learned': 0, 'uniform': 0}
    """

    def __init__(
        self,
        si: Any,
        heatmap: Heatmap | HeatmapSampler,
        options: SamplerOptions | None = None,
        **changes: Any,
    ) -> None:
        space = space_of(si)
        super().__init__(si)
        self._si = si
        self._sampler = _heatmap_sampler(heatmap, options, changes)
        self._states = _writable(space, self._sampler)
        self._sampler.keep_inside(*position_bounds(space))

    @property
    def sample_counts(self) -> dict[str, int]:
        """Samples so far: ``{"learned": n, "uniform": m}``."""
        return self._sampler.sample_counts

    def sample(self, state: Any) -> bool:
        """Sample a valid state; return False when no attempt gave one."""
        self._sampler.monitor.note_call(sys._getframe(1))
        return self._sample_valid(state, self._sampler.next)

    def sampleNear(self, state: Any, near: Any, distance: float) -> bool:  # noqa: N802
        """Sample a valid state in the box of half width ``distance`` around ``near``."""
        self._sampler.monitor.note_call(sys._getframe(1))
        x, y = self._states.read(typed_state(near))
        return self._sample_valid(state, lambda: self._sampler.near(x, y, distance))

    def _sample_valid(self, state: Any, sample: Callable[[], tuple[float, float]]) -> bool:
        typed = typed_state(state)
        for _ in range(self.getNrAttempts()):
            x, y = sample()
            self._states.write(typed, x, y)
            if self._si.isValid(typed):
                self._sampler.on_new_node(x, y, False)
                return True
        return False


def state_sampler_allocator(
    heatmap: Heatmap | HeatmapSampler, options: SamplerOptions | None = None, **changes: Any
) -> Any:
    """Return what ``StateSpace.setStateSamplerAllocator`` takes, on builds that bind it (OMPL 1.7).

    All samplers that it makes share one :class:`HeatmapSampler`. Arguments and errors as for
    :class:`HeatmapStateSampler`.

    Example:
        >>> from cbagan_ompl import GridMap, Heatmap
        >>> heatmap = Heatmap.uniform(GridMap.load("bundled:rooms"))
        >>> allocator = state_sampler_allocator(heatmap, seed=0)
    """
    shared = _heatmap_sampler(heatmap, options, changes)

    def allocate(space: Any) -> HeatmapStateSampler:
        shared.restart()  # a planner makes its sampler when it begins anew
        return HeatmapStateSampler(space, shared)

    return compat.state_sampler_allocator(allocate)


def valid_state_sampler_allocator(
    heatmap: Heatmap | HeatmapSampler, options: SamplerOptions | None = None, **changes: Any
) -> Any:
    """Return what ``SpaceInformation.setValidStateSamplerAllocator`` takes.

    All samplers that it makes share one :class:`HeatmapSampler`. Arguments and errors as for
    :class:`HeatmapValidStateSampler`.

    Example:
        >>> from cbagan_ompl import GridMap, Heatmap
        >>> heatmap = Heatmap.uniform(GridMap.load("bundled:rooms"))
        >>> allocator = valid_state_sampler_allocator(heatmap, seed=0)
    """
    shared = _heatmap_sampler(heatmap, options, changes)

    def allocate(si: Any) -> HeatmapValidStateSampler:
        shared.restart()  # a planner makes its sampler when it begins anew
        return HeatmapValidStateSampler(si, shared)

    return compat.valid_state_sampler_allocator(allocate)


def _heatmap_sampler(
    heatmap: Heatmap | HeatmapSampler, options: SamplerOptions | None, changes: dict[str, Any]
) -> HeatmapSampler:
    if not isinstance(heatmap, HeatmapSampler):
        return HeatmapSampler(heatmap, options, **changes)
    if options is not None or changes:
        raise ConfigError(
            "a HeatmapSampler has its own options: give them to it, or give a heat map here"
        )
    return heatmap


def _writable(space: Any, sampler: HeatmapSampler) -> StateAccess:
    return state_access(space, sampler.heading_sampler(drives_backwards(space)))
