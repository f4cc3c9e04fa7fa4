"""Training sets of maps of one's own: random tasks on them, labelled by RRT or exactly."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..common.parallel import Executor, LocalExecutor
from ..inference.scaling import scaled_free, scaled_shape
from ..maps.grid_map import GridMap
from .generation import GenerationSettings, prepare_folder, write_missing


def label_maps(
    folder: Path,
    maps: Mapping[str, GridMap],
    settings: GenerationSettings,
    jobs: int,
    resume: bool,
    progress: bool = True,
    executor: Executor | None = None,
) -> None:
    """Make a training set of given maps: random tasks on them, with their labels.

    A map is scaled to the size of the set on its longer side as for a prediction (see
    :meth:`cbagan_ompl.inference.predictor.Predictor.predict`), and made a square by blocked pixels
    to the right or below.

    Args:
        folder: of the set; made if missing.
        maps: by what to call each in the record, in the order of their numbers.
        settings: of the set; ``maps`` is their number, and what tells how to generate maps is not
            used.
        jobs: number of processes.
        resume: continue in a folder where a run was interrupted.
        progress: show a progress bar.
        executor: where maps are labelled; by default ``jobs`` processes of this machine.

    Raises:
        ConfigError: see :func:`generate`; or the maps are others than before.
        DatasetError: a file cannot be written, a map has no task of the wanted distance, or a
            process has died.
        ClusterError: the cluster cannot do the work.
    """
    squares = [square_map(grid.free, settings.size) for grid in maps.values()]
    hashes = [hashlib.sha256(np.packbits(free).tobytes()).hexdigest() for free in squares]
    record = {"maps": dict(zip(maps, hashes, strict=True))}
    prepare_folder(folder, settings, resume, record)
    write_missing(folder, settings, executor or LocalExecutor(jobs), progress, squares)


def square_map(free: NDArray[np.bool_], size: int) -> NDArray[np.bool_]:
    """Return a map as an image of a training set.

    Args:
        free: (H, W), true where free.
        size: S.

    Returns:
        (S, S), true where free: the map in the upper left corner, its longer side S pixels long,
        or twice as long as before where that is less.

    Example:
        >>> square_map(np.ones((2, 4), dtype=bool), 8).sum(axis=0).tolist()
        [4, 4, 4, 4, 4, 4, 4, 4]
    """
    scaled = scaled_free(free, scaled_shape(free.shape, size))
    square = np.zeros((size, size), dtype=np.bool_)
    square[: scaled.shape[0], : scaled.shape[1]] = scaled
    return square
