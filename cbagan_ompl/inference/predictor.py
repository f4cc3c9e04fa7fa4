"""Prediction: an exported model, applied to maps of any size."""

from __future__ import annotations

from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..common.validation import require_torch
from ..errors import ModelError
from ..maps.grid_map import GridMap
from ..sampling.heatmap import Heatmap
from .model_files import bundled_model, load_script, read_record

if TYPE_CHECKING:
    import torch

# Free space keeps at least this value, so that a heat map can be drawn from even where the network
# is certain that there is nothing.
_FLOOR = 1e-4

# Small maps are enlarged to so many times their size at most: more shows the network nothing new,
# and costs the square of it.
_MOST_ENLARGED = 2


def load_model(path: str | PathLike[str] | None = None) -> Predictor:
    """Load an exported model, ready to predict.

    TorchScript files can carry code, so load only files from a source that you trust.

    Args:
        path: a file that ``cbagan-ompl export`` wrote; the bundled model by default.

    Raises:
        MissingDependencyError: torch is not installed.
        ModelError: the file is missing, no exported model, damaged, or of a newer version.
    """
    require_torch()
    source = bundled_model() if path is None else Path(path)
    record = read_record(source)
    try:
        predictor = Predictor(load_script(source), record)
        predictor.warm_up()
    except Exception as error:  # torch raises many types for damaged archives
        raise ModelError(
            f"{source}: torch cannot load the model ({type(error).__name__}), the file is "
            "probably damaged; copy or export it again"
        ) from error
    return predictor


class Predictor:
    """An exported model, ready to predict.

    Attributes:
        record: what the model file says about itself: ``working_size``, ``metrics``, ``recipe``...
        inference_threads: CPU threads for one prediction. More than one rarely pays at the
            working size, and costs ten times as long where other work has the cores.

    Args:
        module: maps (free, start, goal) to a region probability, see
            :class:`cbagan_ompl.training.export.RegionModel`.
        record: the record of its file.
    """

    def __init__(self, module: torch.nn.Module, record: dict[str, Any]) -> None:
        self._module = module
        self.record = record
        self.inference_threads = 1

    def warm_up(self) -> None:
        """Predict for an empty map: the first call takes up to four times as long as the others."""
        side = int(self.record["working_size"])
        ends = np.array([[0.5, 0.5], [side - 0.5, side - 0.5]])
        self.probabilities(np.ones((1, side, side), np.bool_), ends[:1], ends[1:])

    def predict(
        self, grid: GridMap, start: ArrayLike, goal: ArrayLike, repair: bool = True
    ) -> Heatmap:
        """Predict where good paths run.

        Args:
            grid: the map, of any size. For the network its longer side is scaled to the model's
                ``working_size`` (small maps to twice their size), and the result back again.
            start: (x, y), world.
            goal: (x, y), world.
            repair: join the parts of the region where it falls apart between start and goal, see
                :meth:`Heatmap.connected`; without it the heat map is as the network left it.

        Raises:
            TaskError: see :meth:`GridMap.check_task`.
        """
        ends = grid.to_pixel(grid.check_task(start, goal))
        shape = scaled_shape(grid.shape, int(self.record["working_size"]))
        scaled_ends = ends * (shape[1] / grid.width, shape[0] / grid.height)
        values = self.probabilities(scaled_free(grid.free, shape)[None], *scaled_ends[:, None])[0]
        full = cv2.resize(values, grid.shape[::-1], interpolation=cv2.INTER_LINEAR)
        heatmap = Heatmap(np.clip(full, _FLOOR, 1), grid)
        return heatmap.connected(start, goal) if repair else heatmap

    def probabilities(
        self, free: NDArray[np.bool_], start: NDArray[np.floating], goal: NDArray[np.floating]
    ) -> NDArray[np.float32]:
        """What the network says of maps at the size they have, without scaling or repair.

        Args:
            free: (B, H, W), true where free.
            start: (B, 2), pixel coordinates (u, v).
            goal: (B, 2), the same.

        Returns:
            (B, H, W), the probability that a pixel belongs to the region.
        """
        import torch
        from torch.jit import optimized_execution  # type: ignore[attr-defined]

        cells = torch.from_numpy(free.astype(np.float32))[:, None]
        ends = (torch.from_numpy(points.astype(np.float32)) for points in (start, goal))
        threads = torch.get_num_threads()
        torch.set_num_threads(self.inference_threads)
        try:
            # Without the optimiser, whose first two calls take ten times as long: a plan makes one.
            with torch.inference_mode(), optimized_execution(False):
                values = self._module(cells, *ends)
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
    """Rows and columns of a map whose longer side is scaled to ``longest`` pixels.

    It is doubled at most.
    """
    factor = min(longest / max(shape), _MOST_ENLARGED)
    return max(1, round(factor * shape[0])), max(1, round(factor * shape[1]))


def scaled_free(free: NDArray[np.bool_], shape: tuple[int, int]) -> NDArray[np.bool_]:
    """A free mask enlarged, or scaled down so that a pixel is free when any of its block is.

    Narrow passages survive, thin walls may not. That is the lesser harm: what the network then
    draws across a wall is cut out by the obstacles of the full map, whereas a passage that it
    cannot see it never draws.

    Args:
        free: (H, W).
        shape: (h, w).
    """
    if shape == free.shape:
        return free
    rows, columns = (np.arange(n) * size // n for n, size in zip(shape, free.shape, strict=True))
    return np.logical_or.reduceat(np.logical_or.reduceat(free, rows, axis=0), columns, axis=1)
