"""OMPL samplers that draw from a heat map, and the allocators that OMPL's setters take."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from ..sampling.heatmap import Heatmap
from ..sampling.sampler import DEFAULT_UNIFORM_FRACTION, HeatmapSampler
from . import compat
from .compat import ob, typed_state
from .states import position_bounds, state_access


class HeatmapStateSampler(ob.StateSampler):  # type: ignore[misc]
    """A state sampler whose positions come from a heat map; headings are uniform.

    Args:
        space: RealVectorStateSpace(2), SE2StateSpace, DubinsStateSpace or ReedsSheppStateSpace.
        heatmap: where to draw.
        uniform_fraction: share of draws that stays uniform over free space, in (0, 1].
        seed: seed or generator; the same seed gives the same draws.
        stream: draws to share with other samplers; ``heatmap``, ``uniform_fraction`` and ``seed``
            are then those that it was made with.

    Raises:
        ConfigError: ``uniform_fraction`` outside (0, 1].
        PlannerError: the states of the space have no (x, y).
    """

    def __init__(
        self,
        space: Any,
        heatmap: Heatmap,
        uniform_fraction: float = DEFAULT_UNIFORM_FRACTION,
        seed: int | np.random.Generator | None = None,
        *,
        stream: HeatmapSampler | None = None,
    ) -> None:
        super().__init__(space)
        self._stream = stream or HeatmapSampler(heatmap, uniform_fraction, seed)
        self._positions = state_access(space, self._stream.rng)
        self._stream.keep_inside(*position_bounds(space))

    @property
    def sample_counts(self) -> dict[str, int]:
        """Draws so far: ``{"learned": n, "uniform": m}``."""
        return self._stream.sample_counts

    def sampleUniform(self, state: Any) -> None:  # noqa: N802
        """Draw from the heat map mixed with uniform: what planners take for "uniform"."""
        self._positions.write(typed_state(state), *self._stream.next())

    def sampleUniformNear(self, state: Any, near: Any, distance: float) -> None:  # noqa: N802
        """Draw from the heat map inside the box of half width ``distance`` around ``near``."""
        x, y = self._positions.read(typed_state(near))
        self._positions.write(typed_state(state), *self._stream.near(x, y, distance))

    def sampleGaussian(self, state: Any, mean: Any, std_dev: float) -> None:  # noqa: N802
        """Draw from the product of the heat map and a Gaussian around ``mean``."""
        x, y = self._positions.read(typed_state(mean))
        self._positions.write(typed_state(state), *self._stream.gaussian(x, y, std_dev))


class HeatmapValidStateSampler(ob.ValidStateSampler):  # type: ignore[misc]
    """A valid-state sampler whose positions come from a heat map; headings are uniform.

    Draws are checked with the space information's own validity checker, up to
    ``getNrAttempts()`` times (100 unless set), as OMPL's UniformValidStateSampler does.

    Args:
        si: the space information; its space as for :class:`HeatmapStateSampler`.
        heatmap: where to draw.
        uniform_fraction: share of draws that stays uniform over free space, in (0, 1].
        seed: seed or generator; the same seed gives the same draws.
        stream: draws to share with other samplers; ``heatmap``, ``uniform_fraction`` and ``seed``
            are then those that it was made with.

    Raises:
        ConfigError: ``uniform_fraction`` outside (0, 1].
        PlannerError: the states of the space have no (x, y).
    """

    def __init__(
        self,
        si: Any,
        heatmap: Heatmap,
        uniform_fraction: float = DEFAULT_UNIFORM_FRACTION,
        seed: int | np.random.Generator | None = None,
        *,
        stream: HeatmapSampler | None = None,
    ) -> None:
        super().__init__(si)
        self._si = si
        self._stream = stream or HeatmapSampler(heatmap, uniform_fraction, seed)
        space = si.getStateSpace()
        self._positions = state_access(space, self._stream.rng)
        self._stream.keep_inside(*position_bounds(space))

    @property
    def sample_counts(self) -> dict[str, int]:
        """Draws so far: ``{"learned": n, "uniform": m}``."""
        return self._stream.sample_counts

    def sample(self, state: Any) -> bool:
        """Draw a valid state; False when no attempt gave one."""
        return self._first_valid(state, self._stream.next)

    def sampleNear(self, state: Any, near: Any, distance: float) -> bool:  # noqa: N802
        """Draw a valid state in the box of half width ``distance`` around ``near``."""
        x, y = self._positions.read(typed_state(near))
        return self._first_valid(state, lambda: self._stream.near(x, y, distance))

    def _first_valid(self, state: Any, draw: Callable[[], tuple[float, float]]) -> bool:
        typed = typed_state(state)
        for _ in range(self.getNrAttempts()):
            self._positions.write(typed, *draw())
            if self._si.isValid(typed):
                return True
        return False


def state_sampler_allocator(
    heatmap: Heatmap,
    uniform_fraction: float = DEFAULT_UNIFORM_FRACTION,
    seed: int | np.random.Generator | None = None,
    *,
    stream: HeatmapSampler | None = None,
) -> Any:
    """What ``StateSpace.setStateSamplerAllocator`` takes, for builds that bind it (OMPL 1.7).

    All samplers that it makes share one stream of draws. Arguments as for
    :class:`HeatmapStateSampler`.
    """
    shared = stream or HeatmapSampler(heatmap, uniform_fraction, seed)

    def allocate(space: Any) -> HeatmapStateSampler:
        return HeatmapStateSampler(space, shared.heatmap, stream=shared)

    return compat.state_sampler_allocator(allocate)


def valid_state_sampler_allocator(
    heatmap: Heatmap,
    uniform_fraction: float = DEFAULT_UNIFORM_FRACTION,
    seed: int | np.random.Generator | None = None,
    *,
    stream: HeatmapSampler | None = None,
) -> Any:
    """What ``SpaceInformation.setValidStateSamplerAllocator`` takes.

    All samplers that it makes share one stream of draws. Arguments as for
    :class:`HeatmapValidStateSampler`.
    """
    shared = stream or HeatmapSampler(heatmap, uniform_fraction, seed)

    def allocate(si: Any) -> HeatmapValidStateSampler:
        return HeatmapValidStateSampler(si, shared.heatmap, stream=shared)

    return compat.valid_state_sampler_allocator(allocate)
