"""A figure of the best, median and worst cases of a prediction."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from numpy.typing import NDArray

from ..common.figures import BLUE, OBSTACLE, PURPLE, mark_endpoints, write_figure
from ..datasets.dataset import Tasks
from .evaluator import Evaluation

# The third is the yellow of Okabe and Ito's palette: orange would be too close to the goal's mark.
_FOUND, _MISSED, _EXCESS = BLUE, PURPLE, "#F0E442"
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
    cases, handles = _choose_cases(ious), list[Artist]()
    grid = figure.subplots(len(cases), _CASES, squeeze=False)
    for row, (name, chosen) in zip(grid, cases.items(), strict=True):
        for axes in row:
            axes.set(xticks=[], yticks=[])
            axes.spines[:].set_color("0.7")
        for axes, i in zip(row, chosen.tolist(), strict=False):
            axes.set_title(f"{name}: IoU {ious[i]:.2f}", fontsize=10)
            handles = _draw_case(axes, evaluation.predicted[i], tasks, i)
    figure.legend(handles=handles, loc="outside lower center", ncols=6, frameon=False)
    # A dollar sign in the name of a file begins no formula.
    title = f"{evaluation.name}: predicted and true regions"
    figure.suptitle(title, fontsize=12, parse_math=False)
    write_figure(figure, path, dots_per_inch=120)


def _choose_cases(ious: NDArray[np.float64]) -> dict[str, NDArray[np.intp]]:
    """Return the indices of the best, median and worst tasks."""
    order = np.argsort(-ious, kind="stable")
    first = max(0, len(order) // 2 - _CASES // 2)
    return {
        "best": order[:_CASES],
        "median": order[first : first + _CASES],
        "worst": order[::-1][:_CASES],
    }


def _draw_case(axes: Axes, predicted: NDArray[np.bool_], tasks: Tasks, i: int) -> list[Artist]:
    """Draw a task with both regions; return the handles of a legend."""
    free, truth = tasks.maps[tasks.map_of[i]].astype(bool), tasks.region[i].astype(bool)
    image = np.where(free[..., None], np.ones(3), np.array(to_rgb(OBSTACLE)))
    opacity = np.where(free, 1.0, _OPACITY_ON_OBSTACLES)[..., None]
    for mask, colour in (
        (predicted & truth, _FOUND),
        (predicted & ~truth, _EXCESS),
        (~predicted & truth, _MISSED),
    ):
        blend = opacity * np.array(to_rgb(colour)) + (1 - opacity) * image
        image[mask] = blend[mask]
    axes.imshow(image, extent=(0, tasks.size, tasks.size, 0), interpolation="nearest")
    meanings = (
        ("in both", _FOUND),
        ("predicted only", _EXCESS),
        ("true only", _MISSED),
        ("obstacle", OBSTACLE),
    )
    return [
        *(Patch(color=colour, label=label) for label, colour in meanings),
        *mark_endpoints(axes, tasks.start[i], tasks.goal[i], scale=0.9),
    ]
