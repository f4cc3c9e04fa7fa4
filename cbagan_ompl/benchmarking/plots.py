"""The plots of a benchmark: success, cost over time, first paths, nodes, ratios to OMPL's own."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import inf
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from ..common.figures import write_figure
from ..common.text import one_line
from .logs import GEOMETRIC, ExperimentLog, number
from .measures import BEST_KNOWN, FIRST_NODES, INFERENCE, NODES_ADDED, logged_costs
from .plot_styles import Panels, Style, legend_handles, styles_of
from .settings import BASELINE
from .statistics import Results, Summary, within_key

_DOTS_PER_INCH = 200
_HEIGHT = 2.7  # of a panel, inches
_RATIO_HEIGHT, _RATIO_ROW_HEIGHT = 0.9, 0.32
_TIMES = 400  # points of a curve of costs

# Kinds of map, of which a benchmark may have as many as maps, and characters of their names.
_MOST_FAMILIES, _LONGEST_LABEL = 60, 40

# Costs are drawn on a logarithmic axis, those nearer to the best known one at its lower end.
_LEAST_EXCESS = 0.1


@dataclass(frozen=True)
class _Run:
    """What is drawn of a run.

    Attributes:
        costs: each better solution, (seconds with inference, cost in multiples of the best known).
        limit: time limit, seconds.
        nodes: that the planner had added when it found its first path, or at its end.
    """

    costs: list[tuple[float, float]]
    limit: float
    nodes: float

    @property
    def first_solution(self) -> float:
        """Time of the first path, the limit for a run without one, seconds."""
        return self.costs[0][0] if self.costs else self.limit


# Planner -> sampler -> runs.
_Runs = dict[str, dict[str, list[_Run]]]


def save_plots(logs: Sequence[ExperimentLog], results: Results, within: int, folder: Path) -> None:
    """Draw the plots of a benchmark, each as ``.png`` and as ``.pdf``.

    A planner that has nothing to show in a plot is left out of it, and so is a plot without
    planners: the cost over time of planners that stop at their first path, and the time to a good
    path where neither the sampler nor OMPL's own gets there.

    Args:
        logs: logs of the tasks.
        results: the statistics of the logs.
        within: threshold of a good path, percent above the best known cost.
        folder: where to save the plots.

    Raises:
        ConfigError: a plot cannot be written.
    """
    runs = _collect_runs(logs)
    improving = {name: some for name, some in runs.items() if _any_improves(some)}
    good_paths = f"time to {within} % of the best known cost"
    figures = {
        "success": _success_figure(runs),
        "cost": _cost_figure(improving, within) if improving else None,
        "first_solution": _boxes_figure(
            runs, lambda run: run.first_solution, "first path with inference, s"
        ),
        "nodes": _boxes_figure(runs, lambda run: run.nodes, "nodes to the first path"),
        "ratio_first_solution": _ratio_figure(
            results, "first_solution_total_s", "time to the first path"
        ),
        f"ratio_within_{within}_percent": _ratio_figure(
            results, within_key(within, total=True), good_paths
        ),
    }
    for name, figure in figures.items():
        for suffix in (".png", ".pdf"):
            path = folder / f"{name}{suffix}"
            if figure is None:
                path.unlink(missing_ok=True)  # of an earlier run of the same benchmark
            else:
                write_figure(figure, path, _DOTS_PER_INCH)


def _collect_runs(logs: Sequence[ExperimentLog]) -> _Runs:
    runs: _Runs = {}
    for log in logs:
        best = number(log.parameters.get(BEST_KNOWN)) or inf
        for planner in log.planners:
            name, sampler = planner.name.removeprefix(GEOMETRIC).split("_", 1)
            collected = runs.setdefault(name, {}).setdefault(sampler, [])
            for i, run in enumerate(planner.runs):
                inference = float(run[INFERENCE])
                points = planner.progress[i] if planner.progress else ()
                costs = [(t + inference, c / best) for t, c in logged_costs(run, points)]
                nodes = float(run[FIRST_NODES] or run[NODES_ADDED])
                collected.append(_Run(costs, log.time_limit, nodes))
    return runs


def _any_improves(by_sampler: Mapping[str, Sequence[_Run]]) -> bool:
    """Return whether a planner has found a path that is better than its first one."""
    return any(len(run.costs) > 1 for runs in by_sampler.values() for run in runs)


def _styles(runs: _Runs) -> dict[str, Style]:
    samplers = dict.fromkeys(sampler for by_sampler in runs.values() for sampler in by_sampler)
    return styles_of(samplers)


def _success_figure(runs: _Runs) -> Figure:
    """Draw for each planner the fraction of the runs that have a path, over time."""
    panels, styles = Panels(list(runs), _HEIGHT), _styles(runs)
    begin = min(run.first_solution for some in runs.values() for r in some.values() for run in r)
    for axes, by_sampler in zip(panels.axes, runs.values(), strict=True):
        for sampler, of_sampler in by_sampler.items():
            times = sorted(run.costs[0][0] for run in of_sampler if run.costs)
            fractions = np.arange(len(times) + 1) / len(of_sampler)
            x = [begin, *times, max(_end(of_sampler), *times, begin)]
            line = styles[sampler].line
            axes.step(x, [*fractions, fractions[-1]], where="post", **line)
        axes.grid(axis="y", color="0.9", linewidth=0.6)
        axes.set_ylim(-0.03, 1.03)
    panels.use_logarithm("x")
    panels.label(x="planning and inference, s", y="fraction of runs with a path")
    panels.add_legend(legend_handles(styles))
    return panels.figure


def _cost_figure(runs: _Runs, within: int) -> Figure:
    """Draw for each planner the median cost over time and its quartiles."""
    panels, styles = Panels(list(runs), _HEIGHT), _styles(runs)
    for axes, by_sampler in zip(panels.axes, runs.values(), strict=True):
        for sampler, of_sampler in by_sampler.items():
            _draw_cost(axes, of_sampler, styles[sampler])
        axes.axhline(within, color="0.4", linewidth=0.8)
        axes.text(
            0.01, within, f"{within} %", transform=axes.get_yaxis_transform(), va="bottom", size=7
        )
    panels.use_logarithm("x")
    panels.use_logarithm("y")
    panels.label(
        x="planning and inference, s", y="cost above the best known, %\nmedian and quartiles"
    )
    panels.add_legend(legend_handles(styles))
    return panels.figure


def _draw_cost(axes: Axes, runs: list[_Run], style: Style) -> None:
    """Draw the median and the quartiles from the time on at which half of the runs have a path."""
    firsts = sorted(run.costs[0][0] for run in runs if run.costs)
    half = -(-len(runs) // 2)
    if len(firsts) < half:
        return
    times = np.geomspace(firsts[half - 1], max(_end(runs), firsts[-1]), _TIMES)
    costs = np.array([_costs_at(run, times) for run in runs])
    excess = np.maximum(100 * (costs - 1), _LEAST_EXCESS)
    low, median, high = np.quantile(excess, (0.25, 0.5, 0.75), axis=0, method="inverted_cdf")
    axes.plot(times, median, **style.line)
    # The upper quartile is infinite until three quarters of the runs have a path.
    top = np.where(np.isfinite(high), high, median)
    axes.fill_between(times, low, top, color=style.color, alpha=0.15, linewidth=0)


def _end(runs: Sequence[_Run]) -> float:
    return max(run.limit for run in runs)


def _costs_at(run: _Run, times: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the cost of a run at some times, infinite before its first path."""
    when = [time for time, _ in run.costs]
    costs = np.array([inf, *(cost for _, cost in run.costs)])
    reached: NDArray[np.float64] = costs[np.searchsorted(when, times, side="right")]
    return reached


def _boxes_figure(runs: _Runs, value: Callable[[_Run], float], label: str) -> Figure:
    """Draw for each planner a box for each sampler: quartiles, and whiskers at 5 and 95 %."""
    panels, styles = Panels(list(runs), _HEIGHT), _styles(runs)
    ticks = {sampler: tick for tick, sampler in enumerate(styles)}
    slanted = len(ticks) > 3
    for axes, by_sampler in zip(panels.axes, runs.values(), strict=True):
        for sampler, of_sampler in by_sampler.items():
            _draw_box(axes, [value(run) for run in of_sampler], ticks[sampler], styles[sampler])
        axes.set_xticks(
            list(ticks.values()),
            list(ticks),
            rotation=25 if slanted else 0,
            ha="right" if slanted else "center",
            rotation_mode="anchor",
        )
    panels.use_logarithm("y")
    panels.label(y=label)
    panels.add_note("mark: median, box: quartiles,\nwhiskers: 5 % and 95 % of the runs")
    return panels.figure


def _draw_box(axes: Axes, values: Sequence[float], position: float, style: Style) -> None:
    line = {"color": style.color, "linewidth": 1.2}
    axes.boxplot(
        [values],
        positions=[position],
        widths=0.6,
        patch_artist=True,
        whis=(5, 95),
        showfliers=False,
        manage_ticks=False,
        boxprops={"facecolor": "white", "edgecolor": style.color, "hatch": style.hatch},
        medianprops=line | {"linewidth": 2},
        whiskerprops=line,
        capprops=line,
    )
    axes.plot(
        position,
        np.median(values),
        marker=style.marker,
        markersize=8,
        color=style.color,
        markeredgecolor="white",
    )


def _ratio_figure(results: Results, measure: str, label: str) -> Figure | None:
    """Draw for each planner the ratios to OMPL's own sampler, a row for each kind of map.

    Returns:
        None where no planner with another sampler gets there.
    """
    families = sorted(results.families.items())[:_MOST_FAMILIES]
    groups = {"all maps": results.overall} | dict(families)
    shown = [
        summary.planner
        for summary in results.overall
        if summary.ratios and not _both_at_limit(summary, results.overall, measure)
    ]
    if not shown:
        return None
    samplers = dict.fromkeys(s.sampler for s in results.overall)
    styles = {name: style for name, style in styles_of(samplers).items() if name != BASELINE}
    offsets = dict(zip(styles, np.linspace(-0.3, 0.3, len(styles) + 2)[1:-1], strict=True))
    planners = list(dict.fromkeys(shown))
    panels = Panels(planners, _RATIO_HEIGHT + _RATIO_ROW_HEIGHT * len(groups))
    any_hollow = False
    for axes, planner in zip(panels.axes, planners, strict=True):
        axes.axvline(1, color="0.4", linewidth=1)
        for row, summaries in enumerate(groups.values()):
            for summary in summaries:
                if summary.planner == planner and summary.ratios:
                    hollow = _both_at_limit(summary, summaries, measure)
                    any_hollow = any_hollow or hollow
                    position = row + offsets[summary.sampler]
                    _draw_ratio(axes, summary, measure, position, styles[summary.sampler], hollow)
    panels.use_logarithm("x")
    labels = [one_line(name, _LONGEST_LABEL) for name in groups]
    panels.axes[0].set_yticks(range(len(groups)), labels)
    panels.axes[0].set_ylim(len(groups) - 0.5, -0.5)
    panels.label(x=f"ratio to {BASELINE}, below 1 is better")
    note = " (hollow: most runs of both end at the limit)" if any_hollow else ""
    left_out = len(results.families) - len(families)
    if left_out:
        note += f" ({left_out} kinds of map left out)"
    panels.figure.suptitle(f"{label}, with inference{note}", fontsize=10)
    panels.add_legend(legend_handles(styles, dashed=False))
    return panels.figure


def _both_at_limit(summary: Summary, summaries: Sequence[Summary], measure: str) -> bool:
    """Return whether most runs with a sampler, and with OMPL's own, end before they get there."""
    own = next(s for s in summaries if (s.planner, s.sampler) == (summary.planner, BASELINE))
    return min(summary.censored[measure], own.censored[measure]) >= 0.5


def _draw_ratio(
    axes: Axes, summary: Summary, measure: str, position: float, style: Style, hollow: bool
) -> None:
    ratio = summary.ratios[measure]
    axes.plot([ratio.low, ratio.high], [position, position], color=style.color, linewidth=1.4)
    axes.plot(
        ratio.median,
        position,
        color=style.color,
        marker=style.marker,
        markersize=5,
        markerfacecolor="white" if hollow else style.color,
    )
