"""Regions that some network predicted for the tasks of a set, and that were stored as images."""

from __future__ import annotations

import csv
import io
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..common.files import read_text
from ..datasets.dataset import label_files, read_image
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
        DatasetError: a prediction is missing, no image, or of another size than the others.
    """
    files = _find_images(folder)
    regions = []
    for label in label_files(dataset, part):
        name = f"{label.parent.name}/{label.name}"
        if name not in files:
            raise DatasetError(f"{folder}: there is no prediction for {name}")
        # Red and blue are 255 in white and 0 in green; the threshold is half way between.
        regions.append(read_image(files[name])[..., ::2].mean(axis=-1) < 127.5)
        if regions[-1].shape != regions[0].shape:
            raise DatasetError(f"{files[name]}: differs in size from the predictions before it")
    return np.stack(regions)


def _find_images(folder: Path) -> dict[str, Path]:
    """Return the image of each label, by ``map_K/task_N_roi.png``."""
    table = folder / _LIST
    if not table.is_file():
        return {f"{path.parent.name}/{path.name}": path for path in folder.rglob("*.png")}
    text = read_text(table, DatasetError)
    try:
        return {
            "/".join(Path(row[_COLUMNS[0]]).parts[-2:]): folder / Path(row[_COLUMNS[1]]).name
            for row in csv.DictReader(io.StringIO(text, newline=""))
        }
    # Missing columns are a KeyError, rows that are too short a TypeError.
    except (csv.Error, KeyError, TypeError) as error:
        raise DatasetError(
            f"{table}: cannot read the list of predictions, its columns are "
            f"{', '.join(_COLUMNS)} ({type(error).__name__})"
        ) from error
