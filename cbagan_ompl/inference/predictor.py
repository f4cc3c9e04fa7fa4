"""Prediction: an exported model, applied to maps of any size."""

from __future__ import annotations

from os import PathLike
from typing import TYPE_CHECKING, Any

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..common.files import as_path
from ..common.memory import is_out_of_memory, translate_lack_of_memory
from ..common.validation import require_torch, truth_value, whole_number
from ..errors import MapError, ModelError, show
from ..maps.grid_map import GridMap
from ..networks.config import MAX_IMAGE_SIZE
from ..sampling.heatmap import Heatmap
from .model_files import bundled_model, load_script, read_model
from .probe import Kind, try_model

if TYPE_CHECKING:
    import torch

# Free space keeps at least this value, so that a heat map can be sampled even where the network is
# certain that no path runs.
_FLOOR = 1e-4

# Small maps are enlarged by this factor at most: more shows the network nothing new, and the cost
# grows with its square.
_MAX_ENLARGEMENT = 2


def load_model(path: str | PathLike[str] | None = None) -> Predictor:
    """Load an exported model, ready to predict.

    TorchScript files can carry code, so load only files from a source that you trust. Damage is
    found before it does harm: archive, record and the length of each tensor are checked before
    torch opens the file, and a model that no ``manifest.json`` beside it lists (``export`` writes
    one) is tried in another process first, which takes a second, once for each content.

    Args:
        path: a file that ``cbagan-ompl export`` wrote; the bundled model by default.

    Raises:
        MissingDependencyError: torch is not installed.
        ModelError: the file is missing, no exported model, damaged, or of a newer version.

    Example:
        >>> load_model()
        Predictor('cbagan-worlds', working size 256 pixels)
    """
    source = bundled_model() if path is None else as_path(path, ModelError)
    model = read_model(source)  # before torch is loaded, which takes seconds
    require_torch()
    if not model.is_listed:
        try_model(str(source), model.script, Kind.REGION, model.record["working_size"])
    try:
        predictor = Predictor(load_script(model.script), model.record)
        predictor.warm_up()
    except ModelError as error:
        is_damaged = error.__cause__ is None or not is_out_of_memory(error.__cause__)
        hint = "; copy or export it again" if is_damaged else ""
        raise ModelError(f"{source}: {error}{hint}") from error
    except Exception as error:  # torch raises many types for damaged archives
        if is_out_of_memory(error):
            raise ModelError(f"{source}: not enough memory to load the model") from error
        raise ModelError(
            f"{source}: torch cannot load the model ({type(error).__name__}), the file is "
            "probably damaged; copy or export it again"
        ) from error
    return predictor


class Predictor:
    """An exported model, ready to predict.

    Attributes:
        record: what the model file says about itself: ``working_size``, ``metrics``, ``recipe``...
        inference_threads: CPU threads for one prediction. More than one rarely helps at the
            working size, and takes ten times as long where other work has the cores.

    Args:
        module: maps (free, start, goal) to a region probability, see
            :class:`cbagan_ompl.networks.export_model.RegionModel`.
        record: the record of its file.

    Raises:
        ModelError: the module cannot be called, or the record is none.
        ConfigError: the ``working_size`` of the record makes no sense.

    Example:
        >>> from cbagan_ompl import GridMap
        >>> heatmap = load_model().predict(GridMap.load("bundled:rooms"), (20, 20), (230, 230))
        >>> heatmap.values.shape
        (256, 256)
    """

    def __init__(self, module: torch.nn.Module, record: dict[str, Any]) -> None:
        if not callable(module) or not isinstance(record, dict):
            raise ModelError(
                f"a Predictor takes a module and its record, got {show(module)} and "
                f"{show(record)}; load_model makes one from a file"
            )
        whole_number("working_size", record.get("working_size", 0), 1, MAX_IMAGE_SIZE)
        self._module = module
        self.record = record
        self.inference_threads = 1

    def warm_up(self) -> None:
        """Predict for an empty map, since the first call takes up to four times as long.

        Raises:
            ModelError: the output is no image of probabilities.
        """
        size = int(self.record["working_size"])
        endpoints = np.array([[0.5, 0.5], [size - 0.5, size - 0.5]])
        free = np.ones((1, size, size), np.bool_)
        values = self.probabilities(free, endpoints[:1], endpoints[1:])
        if values.shape != free.shape or not ((values >= 0) & (values <= 1)).all():
            raise ModelError("the model gives no image of probabilities, it is probably damaged")

    def predict(
        self, grid: GridMap, start: ArrayLike, goal: ArrayLike, repair: bool = True
    ) -> Heatmap:
        """Predict where good paths probably run.

        Args:
            grid: the map, of any size. For the network its longer side is scaled to the model's
                ``working_size`` (small maps to twice their size), and the result back again.
            start: (x, y), world.
            goal: (x, y), world.
            repair: connect the parts of the region where it does not connect start and goal, see
                :meth:`Heatmap.connected`; without it the heat map is the network's output.

        Raises:
            MapError: ``grid`` is no :class:`GridMap`.
            TaskError: see :meth:`GridMap.check_task`.
            ConfigError: ``repair`` is no truth value.
        """
        if not isinstance(grid, GridMap):
            raise MapError(
                f"predict takes a GridMap, got {show(grid)}; make one of an array, true where "
                "free, with GridMap(array)"
            )
        repair = truth_value("repair", repair)
        endpoints = grid.to_pixel(grid.check_task(start, goal))
        shape = scaled_shape(grid.shape, int(self.record["working_size"]))
        scaled = endpoints * (shape[1] / grid.width, shape[0] / grid.height)
        values = self.probabilities(scaled_free(grid.free, shape)[None], *scaled[:, None])[0]
        full = cv2.resize(values, grid.shape[::-1], interpolation=cv2.INTER_LINEAR)
        heatmap = Heatmap(np.clip(full, _FLOOR, 1), grid)
        return heatmap.connected(start, goal) if repair else heatmap

    def probabilities(
        self, free: NDArray[np.bool_], start: NDArray[np.floating], goal: NDArray[np.floating]
    ) -> NDArray[np.float32]:
        """Return the network's output for maps at the size they have, without scaling or repair.

        Args:
            free: (B, H, W), true where free.
            start: (B, 2), pixel coordinates (u, v), u right and v down.
            goal: (B, 2), the same.

        Returns:
            (B, H, W), the probability that a pixel belongs to the region.

        Raises:
            ModelError: there is not enough memory.
        """
        import torch
        from torch.jit import optimized_execution  # type: ignore[attr-defined]

        cells = torch.from_numpy(free.astype(np.float32))[:, None]
        endpoints = (torch.from_numpy(points.astype(np.float32)) for points in (start, goal))
        threads = torch.get_num_threads()
        torch.set_num_threads(self.inference_threads)
        try:
            # Without the optimiser, whose first two calls take ten times as long: a plan makes one.
            with (
                translate_lack_of_memory(
                    ModelError,
                    f"to predict for cells of shape {tuple(cells.shape)}",
                    "give it fewer at a time, or take a model with a smaller working size",
                ),
                torch.inference_mode(),
                optimized_execution(False),
            ):
                values = self._module(cells, *endpoints)
        finally:
            torch.set_num_threads(threads)
        result: NDArray[np.float32] = values[:, 0].numpy()
        return result

    def __repr__(self) -> str:
        return (
            f"Predictor({self.record.get('name')!r}, "
            f"working size {self.record['working_size']} pixels)"
        )


def scaled_shape(shape: tuple[int, int], longest: int) -> tuple[int, int]:
    """Return rows and columns of a map scaled to ``longest`` pixels on its longer side.

    Small maps are doubled at most.

    Example:
        >>> scaled_shape((512, 256), 256), scaled_shape((30, 20), 256)
        ((256, 128), (60, 40))
    """
    factor = min(longest / max(shape), _MAX_ENLARGEMENT)
    return max(1, round(factor * shape[0])), max(1, round(factor * shape[1]))


def scaled_free(free: NDArray[np.bool_], shape: tuple[int, int]) -> NDArray[np.bool_]:
    """Return a free mask at another size; a pixel is free when any pixel of its block is.

    When a map is scaled down, narrow passages survive, thin walls may not. That is the lesser harm:
    where the predicted region then crosses a wall, the obstacles of the full map cut it, but
    through a passage that the network cannot see it predicts no region.

    Args:
        free: (H, W), true where free.
        shape: (h, w).
    """
    if shape == free.shape:
        return free
    rows, columns = (np.arange(n) * size // n for n, size in zip(shape, free.shape, strict=True))
    return np.logical_or.reduceat(np.logical_or.reduceat(free, rows, axis=0), columns, axis=1)
