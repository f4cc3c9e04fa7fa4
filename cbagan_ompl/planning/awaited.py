"""A heat map that another thread makes while the planner already plans on its own sampler."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import CancelledError, Future
from time import perf_counter

from ..errors import CbaganOmplError, PlannerError, show
from ..sampling.heatmap import Heatmap
from ..sampling.sampler import HeatmapSampler
from .states import StateAccess

#: What a hook is given once the heat map is there.
Follow = Callable[[HeatmapSampler, StateAccess], None]
#: What makes the sampler of a heat map.
Make = Callable[[Heatmap], tuple[HeatmapSampler, StateAccess] | None]


class AwaitedHeatmap:
    """Hand a heat map to a hook as soon as it is there.

    Callbacks of the planner ask :meth:`is_pending`, the first one after the heat map has come makes
    the sampler. So everything but the heat map itself is done in the planner's thread.

    Attributes:
        heatmap: what has come; None before that.
        sampler: of it; None before that.
        arrival_s: seconds until then, from the making of this object.
        error: why it will not come; None while it may.

    Args:
        future: of the heat map.
        make: makes the sampler of a heat map, and the access to states with its headings; None
            where the planner is let go of already.
    """

    def __init__(
        self,
        future: Future[Heatmap],
        make: Make,
    ) -> None:
        self.heatmap: Heatmap | None = None
        self.sampler: HeatmapSampler | None = None
        self.arrival_s: float | None = None
        self.error: CbaganOmplError | None = None
        self._future: Future[Heatmap] | None = future
        self._make: Make | None = make
        self._follow: Follow | None = None
        self._began = perf_counter()

    def hand_to(self, follow: Follow) -> None:
        """Set what is called with the sampler once the heat map is there."""
        self._follow = follow

    def is_pending(self) -> bool:
        """Return whether samples are still the planner's own."""
        future = self._future
        if future is not None and future.done():
            self._future = None
            self._receive(future)
        return self.sampler is None

    def release(self) -> None:
        """Let go of the planner: the heat map is not waited for any more."""
        self._future = self._make = self._follow = None

    def raise_failure(self) -> None:
        """Raise if the heat map could not be made.

        Raises:
            CbaganOmplError: what the thread has raised, or a PlannerError with that as its cause.
        """
        self.is_pending()
        if self.error is not None:
            raise self.error

    def _receive(self, future: Future[Heatmap]) -> None:
        try:
            heatmap = result_of(future)
            made = None if self._make is None else self._make(heatmap)
        except CbaganOmplError as error:
            self.error = error
            return
        if made is None:
            return
        sampler, states = made
        self.heatmap, self.sampler = heatmap, sampler
        self.arrival_s = perf_counter() - self._began
        if self._follow is not None:
            self._follow(sampler, states)
            self._follow = None


def result_of(future: Future[Heatmap]) -> Heatmap:
    """Return the heat map of a future that is done.

    Raises:
        CbaganOmplError: what the thread has raised, or a PlannerError with that as its cause.
    """
    try:
        heatmap = future.result()
    except CbaganOmplError:
        raise
    except CancelledError as error:
        raise PlannerError("the heat map that was waited for has been cancelled") from error
    except BaseException as error:  # whatever the thread has raised
        raise PlannerError(
            f"the heat map that was waited for could not be made: {type(error).__name__}: {error}"
        ) from error
    if not isinstance(heatmap, Heatmap):
        raise PlannerError(f"a future of a Heatmap was expected, its result is {show(heatmap)}")
    return heatmap
