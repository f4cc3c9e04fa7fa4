"""Where the heat map of a plan comes from, by the name of the sampler."""

from __future__ import annotations

from collections.abc import Callable
from os import PathLike
from typing import TYPE_CHECKING, TypeAlias

from numpy.typing import ArrayLike

from ..errors import ConfigError, ModelError, show
from ..maps.grid_map import GridMap
from ..maps.grid_search import prepare_search
from ..sampling.heatmap import Heatmap

if TYPE_CHECKING:
    from ..inference.predictor import Predictor

#: OMPL's own sampler, which the others are compared with.
UNIFORM = "uniform"

#: The sampler of a network: the bundled model, unless another one is given.
LEARNED = "learned"

#: The sampler of a grid search.
CORRIDOR = "corridor"

#: Whichever of the two makes its heat map sooner on a map, see :func:`resolve_auto`.
AUTO = "auto"

#: Every sampler by its name, with what it samples.
SAMPLERS = {
    LEARNED: "the heat map of a network",
    UNIFORM: "OMPL's own, untouched",
    CORRIDOR: "a band around the path of a grid search",
    "straight-line": "a band around the straight line from start to goal",
    "flat": "a heat map that is 1 on all free space",
    AUTO: "learned or corridor, whichever is there sooner on a map of this size",
}

#: Pixels up to which the grid search makes its heat map sooner than the network; measured by
#: scripts/search_speed.py, see docs/results/choices.md. A test holds it to the result file.
MOST_CORRIDOR_PIXELS = 800 * 800

#: What a result names its sampler when the caller brought the heat map.
OWN_HEATMAP = "heatmap"

#: A model, loaded or not.
ModelOrFile: TypeAlias = "Predictor | str | PathLike[str]"

#: Makes the heat map of a map, a start and a goal.
HeatmapSource = Callable[[GridMap, ArrayLike, ArrayLike], Heatmap]


def resolve_auto(
    sampler: str, model: ModelOrFile | None, grid: GridMap
) -> tuple[str, ModelOrFile | None]:
    """Return a sampler and its model, with what it stands for on a map in place of :data:`AUTO`.

    That is the corridor on maps up to a size, and where neither torch nor ONNX Runtime is
    installed, without the model; else learned.

    Args:
        sampler: one of :data:`SAMPLERS`; others than auto are returned as they are.
        model: as for :func:`heatmap_source`.
        grid: the map.

    Example:
        >>> resolve_auto("auto", "model.pt", GridMap([[1, 1]]))
        ('corridor', None)
    """
    if not (isinstance(sampler, str) and sampler == AUTO):
        return sampler, model
    from ..inference.model_loading import can_predict

    if grid.free.size <= MOST_CORRIDOR_PIXELS or not can_predict():
        return CORRIDOR, None
    return LEARNED, model


def heatmap_source(
    sampler: str,
    model: Predictor | str | PathLike[str] | None = None,
    heatmap: Heatmap | ArrayLike | None = None,
) -> tuple[str, HeatmapSource | None]:
    """Return the name of a sampler, and what makes its heat map.

    A model is loaded here, once, and so is the grid search.

    Args:
        sampler: one of :data:`SAMPLERS`, but for ``"auto"``: see :func:`resolve_auto`.
        model: for the learned sampler, a loaded model or the file of one; the bundled model by
            default.
        heatmap: to be sampled in place of the learned one.

    Returns:
        The name, and the source; None for OMPL's own sampler, which has no heat map.

    Raises:
        ConfigError: an unknown sampler, or options that do not go together.
        ModelError: an unusable model file.
    """
    if not (isinstance(sampler, str) and sampler in SAMPLERS):
        raise ConfigError(f"there is no sampler {show(sampler)}; there are {', '.join(SAMPLERS)}")
    if sampler != LEARNED and (model is not None or heatmap is not None):
        raise ConfigError(
            f"the {sampler} sampler uses no model and no heat map: leave them out, or choose the "
            "learned sampler"
        )
    if model is not None and heatmap is not None:
        raise ConfigError("a model and a heat map were both given: choose one")
    if heatmap is not None:
        return OWN_HEATMAP, lambda grid, start, goal: _on_grid(heatmap, grid)
    if sampler == LEARNED:
        return sampler, loaded_model(model).predict
    if sampler == CORRIDOR:
        prepare_search()
    return sampler, None if sampler == UNIFORM else _CONTROLS[sampler]


def loaded_model(model: Predictor | str | PathLike[str] | None = None) -> Predictor:
    """Return a model, loaded where it is a file; the bundled model for None.

    Raises:
        ModelError: neither a model nor the file of one.
    """
    from ..inference.predictor import Predictor, load_model

    if not isinstance(model, Predictor | str | PathLike | None):
        raise ModelError(f"model is a loaded model or the file of one, got {show(model)}")
    return model if isinstance(model, Predictor) else load_model(model)


def _on_grid(heatmap: Heatmap | ArrayLike, grid: GridMap) -> Heatmap:
    if not isinstance(heatmap, Heatmap):
        return Heatmap(heatmap, grid)
    return heatmap if heatmap.grid is grid else Heatmap(heatmap.values, grid, heatmap.heading)


# The heat maps that need no model.
_CONTROLS: dict[str, HeatmapSource] = {
    CORRIDOR: Heatmap.corridor,
    "straight-line": Heatmap.straight_line,
    "flat": lambda grid, *_: Heatmap.uniform(grid),
}
