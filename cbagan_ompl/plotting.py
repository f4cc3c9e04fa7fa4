"""The figure of a plan: map, heat map, tree, path, start and goal, in world coordinates."""

from __future__ import annotations

from os import PathLike
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import FixedFormatter, FixedLocator, MaxNLocator
from numpy.typing import NDArray

from .common.figures import (
    BLACK,
    BLUE,
    OBSTACLE,
    UNKNOWN,
    check_figure_path,
    ignore_markup,
    mark_endpoints,
    write_figure,
)
from .common.files import as_path
from .common.text import one_line
from .errors import ConfigError, show
from .maps.checks import check_grid
from .maps.grid_map import GridMap

if TYPE_CHECKING:
    from .planning.plan_result import PlanResult

_INFLATED = "#a6a6a6"
_HEAT = LinearSegmentedColormap.from_list("heat", ["#ffffff", "#fff0b3", "#f7c948", "#e69f00"])

# Inches: the map's longer side, the strips for title, tick labels and legend, and a margin.
_MAP_SIZE = 7.0
_TITLE, _TICKS, _LEGEND, _MARGIN = 0.65, 0.5, 0.6, 0.2

# Around the free part of a map, as a fraction of its longer side, and in pixels at least.
_PADDING, _LEAST_PADDING = 0.03, 3

# Line width of a tree in points: the more edges, the thinner.
_WIDEST, _THINNEST, _WIDTH_OF_ONE = 0.6, 0.12, 20.0

_MOST_TICKS = 8

# Length of an arrow for a heading, pixels of the map; least distance between two poses that are
# shown, as a fraction of the map's longer side.
_ARROW, _LEAST_APART = 8.0, 0.03

_LONGEST_NAME = 60  # of a map, characters of the headline


def save_figure(
    result: PlanResult, grid: GridMap, path: str | PathLike[str], *, show_tree: bool = True
) -> None:
    """Draw a plan and save the figure.

    Args:
        result: from :func:`cbagan_ompl.plan`, with ``keep_tree=True`` for its tree.
        grid: the map as loaded, before it was inflated.
        path: the file; its suffix chooses the format (.png, .pdf, .svg, .jpg).
        show_tree: whether to draw the tree, where the result has one.

    Raises:
        ConfigError: a suffix that stands for no known format, or a folder that cannot be
            written to.

    Example:
        >>> import tempfile
        >>> from cbagan_ompl import GridMap, plan
        >>> grid = GridMap.load("bundled:rooms")
        >>> result = plan(grid, (30, 30), (60, 60), sampler="uniform", time=0.1, seed=0)
        >>> with tempfile.NamedTemporaryFile(suffix=".png") as file:
        ...     save_figure(result, grid, file.name)
    """
    from .planning.plan_result import PlanResult

    if not isinstance(result, PlanResult):
        raise ConfigError(f"save_figure draws the result of plan, got {show(result)}")
    check_grid(grid)
    check_figure_path(as_path(path, ConfigError))
    write_figure(make_figure(result, grid, show_tree=show_tree), path)


def make_figure(result: PlanResult, grid: GridMap, *, show_tree: bool = True) -> Figure:
    """Return the figure of a plan; arguments as for :func:`save_figure`."""
    left, top, right, bottom = _visible_box(grid)
    scale = _MAP_SIZE / max(right - left, bottom - top)
    map_width, map_height = (right - left) * scale, (bottom - top) * scale
    width = max(map_width, 0.8 * _MAP_SIZE) + 2 * _TICKS
    height = map_height + _TITLE + _TICKS + _LEGEND + _MARGIN
    low = _LEGEND + _TICKS
    figure = Figure(figsize=(width, height))
    axes = figure.add_axes(
        ((width - map_width) / 2 / width, low / height, map_width / width, map_height / height)
    )
    handles = draw_plan(axes, result, grid, show_tree=show_tree)
    _label_axes(axes, grid)
    figure.text(0.5, 1 - 0.25 / height, _headline(result), ha="center", va="center", fontsize=11)
    figure.text(0.5, 1 - 0.48 / height, _summary(result), ha="center", va="center", fontsize=9)
    figure.legend(handles=handles, loc="lower center", ncols=4, frameon=False, fontsize=9)
    ignore_markup(figure)
    return figure


def draw_plan(
    axes: Axes, result: PlanResult, grid: GridMap, *, show_tree: bool = True
) -> list[Artist]:
    """Draw a plan on some axes, in pixels of the map, without ticks.

    Args:
        axes: where to draw.
        result: as for :func:`save_figure`.
        grid: the same.
        show_tree: the same.

    Returns:
        What a legend needs.
    """
    handles: list[Artist] = [*_draw_map(axes, result, grid)]
    if show_tree and result.tree is not None and len(result.tree):
        handles.append(_draw_tree(axes, grid.to_pixel(result.tree)))
    if result.solved:
        handles.append(_draw_path(axes, grid.to_pixel(result.trajectory[:, :2])))
    if result.robot.has_heading:
        handles += _draw_poses(axes, result, grid)
    start, goal = (grid.to_pixel(endpoint[:2]) for endpoint in (result.start, result.goal))
    handles += mark_endpoints(axes, start, goal)
    left, top, right, bottom = _visible_box(grid)
    axes.set(xlim=(left, right), ylim=(bottom, top), xticks=[], yticks=[])
    return handles


def _visible_box(grid: GridMap) -> tuple[int, int, int, int]:
    """Return the part of the map that holds all free pixels: left, top, right, bottom, pixels."""
    rows, columns = np.flatnonzero(grid.free.any(1)), np.flatnonzero(grid.free.any(0))
    padding = max(_LEAST_PADDING, round(_PADDING * max(np.ptp(rows), np.ptp(columns))))
    return (
        max(0, int(columns[0]) - padding),
        max(0, int(rows[0]) - padding),
        min(grid.width, int(columns[-1]) + 1 + padding),
        min(grid.height, int(rows[-1]) + 1 + padding),
    )


def _draw_map(axes: Axes, result: PlanResult, grid: GridMap) -> list[Patch]:
    heat = np.zeros(grid.shape, np.float32) if result.heatmap is None else result.heatmap.values
    axes.imshow(heat, cmap=_HEAT, vmin=0, vmax=1, extent=(0, grid.width, grid.height, 0))
    handles = []
    if result.heatmap is not None:
        handles.append(Patch(facecolor=_HEAT(1.0), label=f"heat map ({result.sampler})"))
    unknown = np.zeros(grid.shape, np.bool_) if grid.unknown is None else grid.unknown
    inflated = np.zeros(grid.shape, np.bool_)
    if result.heatmap is not None:
        inflated = grid.free & ~result.heatmap.grid.free
    for mask, color, label in (
        (inflated, _INFLATED, "too near for the robot"),
        (~grid.free & ~unknown, OBSTACLE, "obstacle"),
        (~grid.free & unknown, UNKNOWN, "unknown"),
    ):
        if mask.any():
            _paint(axes, mask, color)
            handles.append(Patch(facecolor=color, label=label))
    return handles


def _paint(axes: Axes, mask: NDArray[np.bool_], color: str) -> None:
    height, width = mask.shape
    cover = LinearSegmentedColormap.from_list("cover", [color, color])
    axes.imshow(
        np.ma.masked_where(~mask, mask),
        cmap=cover,
        extent=(0, width, height, 0),
        interpolation="nearest",
    )


def _draw_tree(axes: Axes, edges: NDArray[np.float64]) -> Line2D:
    width = float(np.clip(_WIDTH_OF_ONE / np.sqrt(len(edges)), _THINNEST, _WIDEST))
    axes.add_collection(LineCollection(list(edges), colors=BLUE, linewidths=width, alpha=0.6))
    return Line2D([], [], color=BLUE, linewidth=0.8, label="tree")


def _draw_path(axes: Axes, path: NDArray[np.float64]) -> Line2D:
    axes.plot(*path.T, color="white", linewidth=4.5, solid_capstyle="round")
    (line,) = axes.plot(*path.T, color=BLACK, linewidth=2.2, label="path")
    return line


def _draw_poses(axes: Axes, result: PlanResult, grid: GridMap) -> list[Artist]:
    """Draw the robot's outline along the path, or arrows where it has none, and at both ends."""
    poses = _spread_poses(result, grid)
    if result.robot.vertices is None:
        ahead = poses[:, :2] + _ARROW * grid.resolution * _directions(poses)
        tips, tails = grid.to_pixel(ahead), grid.to_pixel(poses[:, :2])
        axes.quiver(
            *tails.T, *(tips - tails).T, angles="xy", scale_units="xy", scale=1, color=BLACK,
            width=0.003,
        )  # fmt: skip
        return []
    outlines = [grid.to_pixel(result.robot.outline(pose)) for pose in poses]
    axes.add_collection(
        PolyCollection(outlines, facecolors="none", edgecolors=BLACK, linewidths=0.9, zorder=3)
    )
    # The front of a robot is where its heading points.
    noses = poses[:, :2] + result.robot.circumscribed_radius * _directions(poses)
    lines = np.stack((grid.to_pixel(poses[:, :2]), grid.to_pixel(noses)), axis=1)
    axes.add_collection(LineCollection(list(lines), colors=BLACK, linewidths=0.9, zorder=3))
    return [Patch(facecolor="none", edgecolor=BLACK, label="footprint")]


def _spread_poses(result: PlanResult, grid: GridMap) -> NDArray[np.float64]:
    """Return poses along the path that lie apart, both ends among them, (K, 3), world."""
    if not result.solved:
        return np.array([result.start, result.goal])
    trajectory = result.trajectory
    apart = max(2 * result.robot.circumscribed_radius, _LEAST_APART * max(grid.shape))
    along = np.concatenate(([0.0], np.hypot(*np.diff(trajectory[:, :2], axis=0).T).cumsum()))
    count = max(2, round(float(along[-1]) / apart) + 1)
    chosen = np.searchsorted(along, np.linspace(0, along[-1], count))
    return np.asarray(trajectory[np.minimum(chosen, len(trajectory) - 1)])


def _directions(poses: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.stack((np.cos(poses[:, 2]), np.sin(poses[:, 2])), axis=-1)


def _label_axes(axes: Axes, grid: GridMap) -> None:
    """Show world coordinates along the axes, or a scale bar where the map lies askew."""
    unit = "pixels" if grid.origin is None and grid.resolution == 1 else "world units"
    if grid.origin is not None:
        unit = "m"
        if grid.origin[2] != 0:
            _draw_scale_bar(axes, grid)
            return
    (left, right), (bottom, top) = axes.get_xlim(), axes.get_ylim()
    corners = grid.to_world([(left, bottom), (right, top)])
    for axis, limits, number in ((axes.xaxis, corners[:, 0], 0), (axes.yaxis, corners[:, 1], 1)):
        low, high = sorted(limits.tolist())
        values = MaxNLocator(_MOST_TICKS).tick_values(low, high)
        values = values[(values >= low) & (values <= high)]
        ticks = grid.to_pixel(np.stack((values, values), axis=-1))[:, number]
        axis.set_major_locator(FixedLocator(ticks.tolist()))
        axis.set_major_formatter(FixedFormatter([f"{value:g}" for value in values]))
    axes.tick_params(labelsize=8)
    axes.set_xlabel(f"x, {unit}", fontsize=8, labelpad=1)
    axes.set_ylabel(f"y, {unit}", fontsize=8, labelpad=1)


def _draw_scale_bar(axes: Axes, grid: GridMap) -> None:
    """Draw a bar of a round length, at most a quarter of the width, below the map."""
    left, right = axes.get_xlim()
    bottom, top = axes.get_ylim()
    most = (right - left) * grid.resolution / 4
    length = float(10 ** np.floor(np.log10(most)))
    length *= max(factor for factor in (1, 2, 5) if factor * length <= most)
    below = bottom + 0.03 * (bottom - top)
    bar = (left, left + length / grid.resolution)
    axes.plot(bar, (below, below), color=BLACK, linewidth=2.5, clip_on=False)
    axes.text(bar[1] + 0.01 * (right - left), below, f"{length:g} m", fontsize=8, va="center")


def _headline(result: PlanResult) -> str:
    outcome = f"cost {result.cost:.4g}" if result.solved else "no exact solution"
    name = one_line(result.map, _LONGEST_NAME)
    return f"{name}: {result.planner}, {result.sampler} sampler, {outcome}"


def _summary(result: PlanResult) -> str:
    first = result.first_solution_s
    return (
        f"planning {result.planning_s:.3g} s"
        + (f" (first solution {first:.3g} s)" if first is not None else "")
        + f", inference {result.inference_s:.3g} s, {result.nodes} nodes"
    )
