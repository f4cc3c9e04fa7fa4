"""Plots of a benchmark, for colour-blind readers and for print in black and white."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import cycle
from math import inf
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter
from numpy.typing import NDArray

from .logs import GEOMETRIC, ExperimentLog, number
from .measures import BEST_KNOWN, INFERENCE, NODES, logged_costs
from .settings import BASELINE
from .statistics import Interval, Results

_DOTS_PER_INCH = 200
_PANEL_WIDTH, _PANEL_HEIGHT, _LEGEND_WIDTH, _LEGEND_HEIGHT = 3.2, 2.7, 1.7, 0.45
_ROW_HEIGHT = 0.32
_MOST_COLUMNS = 3
_TIMES = 200


@dataclass(frozen=True)
class _Style:
    """How a sampler is drawn: a colour of Okabe and Ito's, and what tells it apart in grey."""

    color: str
    dashes: tuple[int, ...]
    marker: str
    hatch: str

    @property
    def line(self) -> Any:
        """What matplotlib takes as a line style."""
        return (0, self.dashes) if self.dashes else "-"


_STYLES = (
    _Style("#000000", (4, 2), "s", ""),
    _Style("#0072B2", (), "o", "////"),
    _Style("#009E73", (5, 1, 1, 1), "^", "...."),
    _Style("#E69F00", (1, 1), "D", "xxxx"),
    _Style("#CC79A7", (3, 1, 1, 1, 1, 1), "v", "||||"),
    _Style("#D55E00", (7, 2), "P", "----"),
    _Style("#56B4E9", (2, 2), "X", "++++"),
)


@dataclass(frozen=True)
class _Run:
    """What is drawn of a run; times in seconds with inference, costs of the best known one."""

    costs: list[tuple[float, float]]
    limit: float
    nodes: float


_Runs = dict[str, dict[str, list[_Run]]]


def save_plots(logs: Sequence[ExperimentLog], results: Results, folder: Path) -> None:
    """Draw the plots of a benchmark, each as ``.png`` and as ``.pdf``.

    Args:
        logs: of its tasks.
        results: what they amount to.
        folder: where to save them.
    """
    runs = _runs(logs)
    figures = {
        "success": _curves(runs, _draw_success, "share of runs solved"),
        "cost": _curves(runs, _draw_cost, "cost / best known, quartiles"),
        "first_solution": _boxes(runs, _first_solution, "first solution with inference, s"),
        "nodes": _boxes(runs, _nodes, "nodes"),
    }
    if any(BASELINE in samplers and len(samplers) > 1 for samplers in runs.values()):
        for measure, label in (
            ("first_solution", "time to first solution"),
            ("within_2_percent", "time to 2 % of the best known cost"),
        ):
            figures[f"ratio_{measure}"] = _ratios(results, runs, f"{measure}_total_s", label)
    for name, figure in figures.items():
        for suffix in (".png", ".pdf"):
            figure.savefig(folder / f"{name}{suffix}", dpi=_DOTS_PER_INCH)


def _runs(logs: Sequence[ExperimentLog]) -> _Runs:
    runs: _Runs = {}
    for log in logs:
        best = number(log.parameters.get(BEST_KNOWN)) or inf
        for planner in log.planners:
            name, sampler = planner.name.removeprefix(GEOMETRIC).split("_", 1)
            drawn = runs.setdefault(name, {}).setdefault(sampler, [])
            for i, run in enumerate(planner.runs):
                inference = float(run[INFERENCE])
                points = planner.progress[i] if planner.progress else ()
                costs = [(t + inference, c / best) for t, c in logged_costs(run, points)]
                drawn.append(_Run(costs, log.time_limit, float(run[NODES])))
    return runs


def _styles(runs: _Runs) -> dict[str, _Style]:
    """A style for each sampler, the first one for the baseline."""
    samplers = dict.fromkeys(sampler for by_sampler in runs.values() for sampler in by_sampler)
    others = [sampler for sampler in samplers if sampler != BASELINE]
    styles = dict(zip(others, cycle(_STYLES[1:]), strict=False))
    return {sampler: styles.get(sampler, _STYLES[0]) for sampler in samplers}


_Draw = Callable[[Axes, list[_Run], _Style], None]


def _curves(runs: _Runs, draw: _Draw, label: str) -> Figure:
    """A panel for each planner, a curve over time for each sampler."""
    styles = _styles(runs)
    # The costs of planners that stop at their first solution would dwarf those of the others.
    figure, panels = _figure(list(runs), _PANEL_HEIGHT, share_y=draw is not _draw_cost)
    panels[0].set_ylabel(label)
    for axes, by_sampler in zip(panels, runs.values(), strict=True):
        for sampler, of_sampler in by_sampler.items():
            draw(axes, of_sampler, styles[sampler])
        axes.grid(color="0.9", linewidth=0.6)
        axes.set_xscale("log")
        axes.set_xlabel("planning and inference, s")
        _plain_numbers(axes)
    handles = [
        Line2D([], [], color=style.color, linestyle=style.line, linewidth=1.8, label=sampler)
        for sampler, style in styles.items()
    ]
    _add_legend(figure, handles)
    return figure


def _figure(
    planners: Sequence[str], height: float, share_y: bool = True
) -> tuple[Figure, list[Axes]]:
    """Empty panels, one for each planner."""
    columns = min(len(planners), _MOST_COLUMNS)
    rows = -(-len(planners) // columns)
    size = (_PANEL_WIDTH * columns + 0.6, height * rows + _LEGEND_HEIGHT)
    figure = Figure(figsize=size, layout="constrained")
    places = figure.subplots(rows, columns, sharex=True, sharey=share_y, squeeze=False).ravel()
    for unused in places[len(planners) :]:
        unused.set_axis_off()
    panels: list[Axes] = places[: len(planners)].tolist()
    for axes, planner in zip(panels, planners, strict=True):
        axes.set_title(planner, fontsize=10)
        axes.set_axisbelow(True)
        axes.tick_params(labelbottom=True)
    return figure, panels


def _add_legend(figure: Figure, handles: Sequence[Line2D]) -> None:
    """Below all panels, as many entries beside each other as there is room for."""
    columns = int(figure.get_figwidth() // _LEGEND_WIDTH)
    figure.legend(handles=handles, loc="outside lower center", ncols=columns, frameon=False)


def _plain_numbers(axes: Axes) -> None:
    """On a logarithmic x axis: 0.03 rather than a power of ten."""
    axes.xaxis.set_major_locator(LogLocator(subs=(1, 3)))
    axes.xaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.tick_params(axis="x", labelsize=8)


def _draw_success(axes: Axes, runs: list[_Run], style: _Style) -> None:
    times = sorted(run.costs[0][0] for run in runs if run.costs)
    if times:
        shares = np.arange(len(times) + 1) / len(runs)
        x = [times[0], *times, max(_end(runs), times[-1])]
        axes.step(x, [*shares, shares[-1]], where="post", **_pen(style))


def _draw_cost(axes: Axes, runs: list[_Run], style: _Style) -> None:
    firsts = [run.costs[0][0] for run in runs if run.costs]
    if not firsts:
        return
    times = np.geomspace(min(firsts), max(_end(runs), *firsts), _TIMES)
    costs = np.array([_costs_at(run, times) for run in runs])
    costs = np.quantile(costs, (0.25, 0.5, 0.75), axis=0, method="inverted_cdf")
    low, median, high = np.where(np.isfinite(costs), costs, np.nan)
    axes.plot(times, median, **_pen(style))
    for quartile in (low, high):
        axes.plot(times, quartile, **_pen(style) | {"linewidth": 0.6})
    axes.fill_between(times, low, high, color=style.color, alpha=0.12, linewidth=0)


def _end(runs: Sequence[_Run]) -> float:
    return max(run.limit for run in runs)


def _pen(style: _Style) -> dict[str, Any]:
    return {"color": style.color, "linestyle": style.line, "linewidth": 1.8}


def _costs_at(run: _Run, times: NDArray[np.float64]) -> NDArray[np.float64]:
    when = [time for time, _ in run.costs]
    costs = np.array([inf, *(cost for _, cost in run.costs)])
    reached: NDArray[np.float64] = costs[np.searchsorted(when, times, side="right")]
    return reached


def _first_solution(run: _Run) -> float:
    return run.costs[0][0] if run.costs else run.limit


def _nodes(run: _Run) -> float:
    return run.nodes


def _boxes(runs: _Runs, value: Callable[[_Run], float], label: str) -> Figure:
    """A panel for each planner, a box for each sampler: quartiles, and whiskers at 5 and 95 %."""
    styles = _styles(runs)
    figure, panels = _figure(list(runs), _PANEL_HEIGHT)
    panels[0].set_ylabel(label)
    for axes, by_sampler in zip(panels, runs.values(), strict=True):
        drawn = axes.boxplot(
            [[value(run) for run in of_sampler] for of_sampler in by_sampler.values()],
            widths=0.6,
            patch_artist=True,
            whis=(5, 95),
            showfliers=False,
            medianprops={"color": "black", "linewidth": 2},
        )
        for box, sampler in zip(drawn["boxes"], by_sampler, strict=True):
            style = styles[sampler]
            box.set(facecolor="white", edgecolor=style.color, hatch=style.hatch, linewidth=1.2)
        slanted: dict[str, Any] = {"rotation": 25, "ha": "right", "rotation_mode": "anchor"}
        axes.set_xticks(range(1, len(by_sampler) + 1), list(by_sampler), fontsize=8, **slanted)
        axes.set_yscale("log")
        axes.grid(axis="y", color="0.9", linewidth=0.6)
    return figure


def _ratios(results: Results, runs: _Runs, measure: str, label: str) -> Figure:
    """A panel for each planner, in it a row for each map and one for all."""
    groups = {"all maps": results.overall} | dict(sorted(results.families.items()))
    styles = {sampler: style for sampler, style in _styles(runs).items() if sampler != BASELINE}
    places = dict(zip(styles, np.linspace(-0.25, 0.25, len(styles) + 2)[1:-1], strict=True))
    figure, panels = _figure(list(runs), 0.9 + _ROW_HEIGHT * len(groups))
    for axes, planner in zip(panels, runs, strict=True):
        axes.axvline(1, color="0.4", linewidth=1)
        axes.grid(axis="x", color="0.9", linewidth=0.6)
        for row, summaries in enumerate(groups.values()):
            for summary in summaries:
                if summary.planner == planner and summary.ratios:
                    place, style = row + places[summary.sampler], styles[summary.sampler]
                    _draw_ratio(axes, summary.ratios[measure], place, style)
        axes.set_xscale("log")
        axes.set_xlabel(f"ratio to {BASELINE}")
        axes.tick_params(axis="y", labelsize=8)
    panels[0].set_yticks(range(len(groups)), list(groups))
    panels[0].set_ylim(len(groups) - 0.5, -0.5)
    handles = [
        Line2D([], [], color=style.color, marker=style.marker, label=sampler, linewidth=1.4)
        for sampler, style in styles.items()
    ]
    figure.suptitle(f"{label}, inference counted in", fontsize=10)
    _add_legend(figure, handles)
    return figure


def _draw_ratio(axes: Axes, ratio: Interval, place: float, style: _Style) -> None:
    axes.plot([ratio.low, ratio.high], [place, place], color=style.color, linewidth=1.4)
    axes.plot(ratio.median, place, color=style.color, marker=style.marker, markersize=5)
