"""A figure of the best, median and worst cases of a prediction."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import NDArray

from ..common.files import reason
from ..datasets.dataset import Tasks
from ..errors import ConfigError
from .evaluator import Evaluation

# Okabe and Ito's palette, which colour-blind readers can tell apart. Start and goal have the marks
# of the figures of plans.
_FOUND, _EXCESS, _MISSED = "#0072B2", "#F0E442", "#CC79A7"
_START, _GOAL = ("o", "#009E73"), ("*", "#D55E00")
_OBSTACLE = "#4d4d4d"
# Half way between obstacle and colour, so that a region on an obstacle shows both.
_OPACITY_ON_OBSTACLES = 0.5

_CASES = 3


def save_sample_grid(evaluation: Evaluation, tasks: Tasks, path: Path) -> None:
    """Draw the three best, three median and three worst tasks by IoU, and save the figure.

    Args:
        evaluation: of the prediction.
        tasks: that it was scored on.
        path: of the figure; its suffix chooses the format.

    Raises:
        ConfigError: it cannot be written.
    """
    ious = evaluation.tasks.counts.iou()
    figure = Figure(figsize=(8.4, 9.1), layout="constrained")
    cases = _choose_cases(ious)
    grid = figure.subplots(len(cases), _CASES, squeeze=False)
    for row, (name, chosen) in zip(grid, cases.items(), strict=True):
        for axes in row:
            axes.set(xticks=[], yticks=[])
            axes.spines[:].set_color("0.7")
        for axes, i in zip(row, chosen.tolist(), strict=False):
            axes.set_title(f"{name}: IoU {ious[i]:.2f}", fontsize=10)
            _draw_case(axes, evaluation.predicted[i], tasks, i)
    figure.legend(handles=_legend_handles(), loc="outside lower center", ncols=6, frameon=False)
    figure.suptitle(f"{evaluation.name}: predicted and true regions", fontsize=12)
    try:
        figure.savefig(path, dpi=120)
    except OSError as error:
        raise ConfigError(f"cannot write {path}: {reason(error)}") from error


def _choose_cases(ious: NDArray[np.float64]) -> dict[str, NDArray[np.intp]]:
    """Return the indices of the best, median and worst tasks."""
    order = np.argsort(-ious, kind="stable")
    first = max(0, len(order) // 2 - _CASES // 2)
    return {
        "best": order[:_CASES],
        "median": order[first : first + _CASES],
        "worst": order[::-1][:_CASES],
    }


def _draw_case(axes: Axes, predicted: NDArray[np.bool_], tasks: Tasks, i: int) -> None:
    free, truth = tasks.maps[tasks.map_of[i]].astype(bool), tasks.region[i].astype(bool)
    image = np.where(free[..., None], np.ones(3), np.array(to_rgb(_OBSTACLE)))
    opacity = np.where(free, 1.0, _OPACITY_ON_OBSTACLES)[..., None]
    for mask, colour in (
        (predicted & truth, _FOUND),
        (predicted & ~truth, _EXCESS),
        (~predicted & truth, _MISSED),
    ):
        blend = opacity * np.array(to_rgb(colour)) + (1 - opacity) * image
        image[mask] = blend[mask]
    axes.imshow(image, extent=(0, tasks.size, tasks.size, 0), interpolation="nearest")
    for point, (marker, colour) in ((tasks.start[i], _START), (tasks.goal[i], _GOAL)):
        size = 9 if marker == "o" else 14
        axes.plot(*point, marker, color=colour, markeredgecolor="white", markersize=size)


def _legend_handles() -> list[Patch | Line2D]:
    meanings = (
        ("in both", _FOUND),
        ("predicted only", _EXCESS),
        ("true only", _MISSED),
        ("obstacle", _OBSTACLE),
    )
    handles: list[Patch | Line2D] = [Patch(color=colour, label=label) for label, colour in meanings]
    for label, (marker, colour) in (("start", _START), ("goal", _GOAL)):
        size = 8 if marker == "o" else 12
        handles.append(
            Line2D([], [], linestyle="none", marker=marker, color=colour, markersize=size)
        )
        handles[-1].set_label(label)
    return handles
