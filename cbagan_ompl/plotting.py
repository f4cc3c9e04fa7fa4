"""The picture of a plan: map, heat map, tree, path, start and goal."""

from __future__ import annotations

from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from .errors import ConfigError
from .maps.grid_map import GridMap

if TYPE_CHECKING:
    from .planning.plan_result import PlanResult

# Okabe and Ito's palette, which colour-blind readers can tell apart.
_TREE, _PATH, _START, _GOAL = "#0072B2", "#000000", "#009E73", "#D55E00"
_OBSTACLE = "#4d4d4d"
_INFLATED = "#a6a6a6"
_HEAT = LinearSegmentedColormap.from_list("heat", ["#ffffff", "#fff0b3", "#f7c948", "#e69f00"])

# Inches: the map's longer side, and the strips for the title and the legend.
_MAP_SIDE = 7.0
_MARGIN, _TITLE, _LEGEND = 0.15, 0.65, 0.75
_DOTS_PER_INCH = 150


def save_figure(result: PlanResult, grid: GridMap, path: str | PathLike[str]) -> None:
    """Draw a plan and save it.

    Args:
        result: from :func:`cbagan_ompl.plan`, with ``keep_tree=True`` for its tree.
        grid: the map as loaded, before it was inflated.
        path: the file; its suffix chooses the format (.png, .pdf, .svg, .jpg).

    Raises:
        ConfigError: a suffix that stands for no known format, or a folder that cannot be
            written to.
    """
    check_figure_path(path)
    figure = draw_plan(result, grid)
    try:
        figure.savefig(path, dpi=_DOTS_PER_INCH)
    except OSError as error:
        raise ConfigError(f"cannot write the picture {path}: {error.strerror or error}") from error


def check_figure_path(path: str | PathLike[str]) -> None:
    """Refuse a picture file of an unknown format before any work is done for it.

    Raises:
        ConfigError: the suffix stands for no format that can be written.
    """
    formats = FigureCanvasAgg.get_supported_filetypes()
    if Path(path).suffix.lstrip(".").lower() not in formats:
        raise ConfigError(
            f"cannot save a picture as {Path(path).name!r}; its suffix must be one of "
            f"{', '.join('.' + name for name in sorted(formats))}"
        )


def draw_plan(result: PlanResult, grid: GridMap) -> Figure:
    """The picture as a matplotlib figure; arguments as for :func:`save_figure`."""
    scale = _MAP_SIDE / max(grid.shape)
    map_width, map_height = grid.width * scale, grid.height * scale
    width = max(map_width, 0.8 * _MAP_SIDE) + 2 * _MARGIN
    height = map_height + _TITLE + _LEGEND
    figure = Figure(figsize=(width, height))
    axes = figure.add_axes(
        ((width - map_width) / 2 / width, _LEGEND / height, map_width / width, map_height / height)
    )
    handles = draw_heatmap(axes, result, grid)
    figure.text(0.5, 1 - 0.25 / height, _headline(result), ha="center", va="center", fontsize=11)
    figure.text(0.5, 1 - 0.48 / height, _figures(result), ha="center", va="center", fontsize=9)
    figure.legend(handles=handles, loc="lower center", ncols=4, frameon=False, fontsize=9)
    return figure


def draw_heatmap(axes: Axes, result: PlanResult, grid: GridMap) -> list[Artist]:
    """Draw a plan on some axes; ``result`` and ``grid`` as for :func:`save_figure`.

    Returns:
        What a legend needs.
    """
    handles = [*_draw_map(axes, result, grid), *_draw_plan(axes, result, grid)]
    axes.set(xlim=(0, grid.width), ylim=(grid.height, 0), xticks=[], yticks=[])
    return handles


def _draw_map(axes: Axes, result: PlanResult, grid: GridMap) -> list[Patch]:
    heat = np.zeros(grid.shape, np.float32) if result.heatmap is None else result.heatmap.values
    axes.imshow(heat, cmap=_HEAT, vmin=0, vmax=1, extent=(0, grid.width, grid.height, 0))
    handles = []
    if result.heatmap is not None:
        handles.append(Patch(facecolor=_HEAT(1.0), label=f"heat map ({result.sampler})"))
        inflated = grid.free & ~result.heatmap.grid.free
        if inflated.any():
            _paint(axes, inflated, _INFLATED)
            handles.append(Patch(facecolor=_INFLATED, label="inflated by the radius"))
    if not grid.free.all():
        _paint(axes, ~grid.free, _OBSTACLE)
        handles.append(Patch(facecolor=_OBSTACLE, label="obstacle"))
    return handles


def _paint(axes: Axes, mask: np.ndarray[tuple[int, int], np.dtype[np.bool_]], color: str) -> None:
    height, width = mask.shape
    cover = LinearSegmentedColormap.from_list("cover", [color, color])
    axes.imshow(
        np.ma.masked_where(~mask, mask),
        cmap=cover,
        extent=(0, width, height, 0),
        interpolation="nearest",
    )


def _draw_plan(axes: Axes, result: PlanResult, grid: GridMap) -> list[Line2D]:
    handles = []
    if result.tree is not None and len(result.tree):
        edges = grid.to_pixel(result.tree)
        axes.add_collection(LineCollection(list(edges), colors=_TREE, linewidths=0.4, alpha=0.6))
        handles.append(Line2D([], [], color=_TREE, linewidth=0.8, label="tree"))
    if result.solved:
        path = grid.to_pixel(result.path)
        axes.plot(*path.T, color="white", linewidth=4.5, solid_capstyle="round")
        handles += axes.plot(*path.T, color=_PATH, linewidth=2.2, label="path")
    for point, marker, color, label in (
        (result.start, "o", _START, "start"),
        (result.goal, "*", _GOAL, "goal"),
    ):
        handles += axes.plot(
            *grid.to_pixel(point),
            marker=marker,
            color=color,
            markersize=10 if marker == "o" else 15,
            markeredgecolor="white",
            linestyle="none",
            label=label,
            zorder=5,
        )
    return handles


def _headline(result: PlanResult) -> str:
    outcome = f"cost {result.cost:.4g}" if result.solved else "no exact solution"
    return f"{result.map}: {result.planner}, {result.sampler} sampler, {outcome}"


def _figures(result: PlanResult) -> str:
    first = result.first_solution_s
    return (
        f"planning {result.planning_s:.3g} s"
        + (f" (first solution {first:.3g} s)" if first is not None else "")
        + f", inference {result.inference_s:.3g} s, {result.nodes} nodes"
    )
