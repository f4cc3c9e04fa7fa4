"""Predictions to be scored: those that know nothing, and those that somebody stored."""

from __future__ import annotations

import csv
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from ..datasets.dataset import Tasks, label_files, read_image
from ..errors import DatasetError

#: Half the width in pixels of the straight line that predictions are compared with.
LINE_HALF_WIDTH = 3

#: The list that a folder of predictions may have; its columns name label and prediction.
RESULTS, _COLUMNS = "results.csv", ("true_roi", "pred_roi")


def trivial_baselines(tasks: Tasks) -> dict[str, NDArray[np.bool_]]:
    """Two predictors that know nothing: all free space, and a straight band; (N, S, S) each."""
    bands = np.zeros_like(tasks.region)
    for band, start, goal in zip(bands, tasks.start, tasks.goal, strict=True):
        ends = np.floor((start, goal)).astype(int).tolist()
        cv2.line(band, ends[0], ends[1], 1, thickness=2 * LINE_HALF_WIDTH + 1)
    free = tasks.free
    return {"all free space": free, "straight line": bands.astype(np.bool_) & free}


def stored_predictions(folder: Path, dataset: Path, part: str) -> NDArray[np.bool_]:
    """Pictures of regions, green on white, that some network left for the tasks of a set.

    Args:
        folder: holds ``results.csv``, whose columns ``true_roi`` and ``pred_roi`` name the label
            of a task and the picture of its prediction, by paths of which the last parts count;
            or pictures with the names of the labels, ``map_K/task_N_roi.png``.
        dataset: folder of the set.
        part: ``train`` or ``test``.

    Returns:
        (N, S, S), in the order of the tasks.

    Raises:
        DatasetError: a prediction is missing, no picture, or of another size than the others.
    """
    files = _files(folder)
    regions = []
    for label in label_files(dataset, part):
        name = f"{label.parent.name}/{label.name}"
        if name not in files:
            raise DatasetError(f"{folder}: there is no prediction for {name}")
        # Half of the way from white to green, in the channels that tell these apart.
        regions.append(read_image(files[name])[..., ::2].mean(axis=-1) < 127.5)
        if regions[-1].shape != regions[0].shape:
            raise DatasetError(f"{files[name]}: differs in size from the predictions before it")
    return np.stack(regions)


def _files(folder: Path) -> dict[str, Path]:
    """The picture of each label, by ``map_K/task_N_roi.png``."""
    table = folder / RESULTS
    if not table.is_file():
        return {f"{path.parent.name}/{path.name}": path for path in folder.rglob("*.png")}
    try:
        with table.open(newline="", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
        return {
            "/".join(Path(row[_COLUMNS[0]]).parts[-2:]): folder / Path(row[_COLUMNS[1]]).name
            for row in rows
        }
    except (OSError, UnicodeDecodeError, csv.Error, KeyError, TypeError) as error:
        raise DatasetError(
            f"{table}: cannot read the list of predictions, its columns are "
            f"{', '.join(_COLUMNS)} ({type(error).__name__})"
        ) from error
