"""Regions that some network predicted for the tasks of a set, and that were stored as images."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..datasets.dataset import check_pixels, label_files, read_image
from ..datasets.tables import read_table
from ..errors import DatasetError

# The list that a folder of predictions may have; its columns name label and prediction.
_LIST, _COLUMNS = "results.csv", ("true_roi", "pred_roi")


def load_predictions(folder: Path, dataset: Path, part: str) -> NDArray[np.bool_]:
    """Read stored regions, images with green regions on white.

    Args:
        folder: holds ``results.csv``, whose columns ``true_roi`` and ``pred_roi`` name the label
            of a task and the image of its prediction by paths: of a label's path the last two
            parts count, of an image's path the last one; or images with the names of the labels,
            ``map_K/task_N_roi.png``.
        dataset: folder of the set.
        part: ``train`` or ``test``.

    Returns:
        (N, S, S), true in the region, in the order of the tasks.

    Raises:
        DatasetError: the folder or a prediction is missing; a prediction is no image, no square,
            gray, or of another size than the others; or the list of them cannot be read.
    """
    if not folder.is_dir():
        raise DatasetError(
            f"{folder}: no such folder of predictions; a copy that `dataset import` wrote does not "
            "hold those of the original set, whose tasks may have other numbers"
        )
    files = _find_images(folder)
    labels = label_files(dataset, part)
    regions: NDArray[np.bool_] | None = None
    for i, label in enumerate(labels):
        name = f"{label.parent.name}/{label.name}"
        if name not in files:
            raise DatasetError(f"{folder}: there is no prediction for {name}")
        image = read_image(files[name], None if regions is None else regions.shape[1])
        if regions is None:
            height, width = image.shape[:2]
            if height != width:
                raise DatasetError(f"{files[name]}: {width} x {height} pixels are no square")
            check_pixels(len(labels), width, str(folder))
            regions = np.empty((len(labels), height, width), np.bool_)
        # Red and blue are 255 in white and 0 in green; the threshold is half way between.
        regions[i] = image[..., ::2].mean(axis=-1) < 127.5
        # In a gray image white may be the region, and would be read as what is outside of it.
        if regions[i].any() and (image[..., :1] == image[..., 1:]).all():
            raise DatasetError(
                f"{files[name]} is a gray image; stored predictions are green on white"
            )
    assert regions is not None, "the lists of a set are not empty"
    return regions


def _find_images(folder: Path) -> dict[str, Path]:
    """Return the image of each label, by ``map_K/task_N_roi.png``."""
    table = folder / _LIST
    if not table.is_file():
        return {f"{path.parent.name}/{path.name}": path for path in folder.rglob("*.png")}
    return {
        "/".join(Path(label).parts[-2:]): folder / Path(prediction).name
        for label, prediction in read_table(table, _COLUMNS)
    }
