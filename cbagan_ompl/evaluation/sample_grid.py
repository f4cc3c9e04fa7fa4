"""A picture of a prediction's best, middling and worst cases."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from numpy.typing import NDArray

from ..datasets.dataset import Tasks
from ..errors import ConfigError
from .evaluator import Evaluation

# Colours of Okabe and Ito, which people with any colour vision can tell apart.
_RIGHT, _TOO_MUCH, _MISSED = "#009E73", "#E69F00", "#CC79A7"
_START, _GOAL = "#0072B2", "#D55E00"
_CASES = 3


def save_sample_grid(evaluation: Evaluation, tasks: Tasks, path: Path) -> None:
    """Draw three best, three middling and three worst tasks by IoU.

    Args:
        evaluation: of the prediction.
        tasks: that it was scored on.
        path: of the picture.

    Raises:
        ConfigError: it cannot be written.
    """
    ious = evaluation.tasks.counts.iou()
    order = np.argsort(-ious, kind="stable")
    middle = max(0, len(order) // 2 - _CASES // 2)
    rows = {
        "best": order[:_CASES],
        "middling": order[middle : middle + _CASES],
        "worst": order[::-1][:_CASES],
    }
    figure = Figure(figsize=(8.4, 8.9), layout="constrained")
    grid = figure.subplots(len(rows), _CASES, squeeze=False)
    for line, (name, chosen) in zip(grid, rows.items(), strict=True):
        for axes in line:
            axes.set(xticks=[], yticks=[])
            axes.spines[:].set_color("0.7")
        for axes, i in zip(line, chosen, strict=False):
            axes.set_title(f"{name}: IoU {ious[i]:.2f}", fontsize=9)
            _draw(axes, evaluation.predicted[i], tasks, int(i))
    meanings = (("found", _RIGHT), ("too much", _TOO_MUCH), ("missed", _MISSED))
    handles = [Patch(color=color, label=label) for label, color in meanings]
    handles += [Patch(color=_START, label="start"), Patch(color=_GOAL, label="goal")]
    figure.legend(handles=handles, loc="outside lower center", ncols=len(handles), frameon=False)
    figure.suptitle(f"{evaluation.name}: predicted against true region", fontsize=11)
    try:
        figure.savefig(path, dpi=120)
    except OSError as error:
        raise ConfigError(f"cannot write {path}: {error.strerror or error}") from error


def _draw(axes: Axes, predicted: NDArray[np.bool_], tasks: Tasks, i: int) -> None:
    free, truth = tasks.maps[tasks.map_of[i]].astype(bool), tasks.region[i].astype(bool)
    image = np.where(free[..., None], np.ones(3), np.full(3, 0.15))
    for mask, color in (
        (predicted & truth, _RIGHT),
        (predicted & ~truth, _TOO_MUCH),
        (~predicted & truth, _MISSED),
    ):
        # Where a prediction covers an obstacle, the obstacle shows through.
        image[mask] = np.array(to_rgb(color)) * np.where(free[mask], 1.0, 0.5)[:, None]
    axes.imshow(image, extent=(0, tasks.side, tasks.side, 0), interpolation="nearest")
    for point, color in ((tasks.start[i], _START), (tasks.goal[i], _GOAL)):
        axes.plot(*point, "o", color=color, markeredgecolor="white", markersize=8)
