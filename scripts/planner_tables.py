"""The tables of planners and samplers of benchmarks, as Markdown."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from cbagan_ompl.common.markdown import table

#: Ratios to OMPL's own sampler, by their names, with the head of their column.
RATIOS = {
    "nodes_to_first": "nodes to the first path",
    "first_solution_s": "time to it",
    "first_solution_total_s": "all counted in",
    "nodes_to_5_percent": "nodes to 5 %",
    "within_5_percent_s": "time to 5 %",
    "within_5_percent_total_s": "all counted in",
}

#: The same without nodes, for an overview.
RATIOS_OF_TIME = {
    "first_solution_s": "first path, planning alone",
    "first_solution_total_s": "first path, all counted in",
    "within_5_percent_s": "within 5 %, planning alone",
    "within_5_percent_total_s": "within 5 %, all counted in",
}

Json = Mapping[str, Any]


def ratios_table(
    summary: Json,
    ratios: Mapping[str, str] = RATIOS,
    samplers: Sequence[str] | None = None,
    planners: Sequence[str] | None = None,
) -> str:
    """Return the table of the ratios to OMPL's own sampler.

    Args:
        summary: the ``summary.json`` of a benchmark.
        ratios: the measures that are shown, and the heads of their columns.
        samplers: that are shown, in this order; all but OMPL's own by default.
        planners: that are shown; all by default.
    """
    own = {row["planner"]: row for row in summary["overall"] if not row["ratios"]}
    rows = [
        [
            planner_name(summary, row["planner"]),
            row["sampler"],
            f"{own[row['planner']]['success']:.0%} / {row['success']:.0%}",
            *ratio_cells(row, own[row["planner"]], ratios),
        ]
        for row in in_order(summary["overall"], samplers, planners)
        if row["ratios"]
    ]
    return table(["planner", "sampler", "solved", *ratios.values()], rows)


def times_table(summary: Json, samplers: Sequence[str]) -> str:
    """Return the table of milliseconds, everything counted in: what to pick on such maps.

    Args:
        summary: the ``summary.json`` of a benchmark.
        samplers: that are shown, in this order.
    """
    rows = []
    for row in in_order(summary["overall"], samplers, None):
        reached = 1 - row["censored"]["within_5_percent_total_s"]
        rows.append(
            [
                planner_name(summary, row["planner"]),
                row["sampler"],
                f"{row['success']:.0%}",
                milliseconds(row, "first_solution_total_s"),
                f"{reached:.0%}",
                milliseconds(row, "within_5_percent_total_s"),
                length(row["measures"]["final_cost"]["median"]),
            ]
        )
    header = ["planner", "sampler", "solved", "first path", "within 5 %: runs", "time"]
    return table([*header, "length at the end"], rows)


def planner_name(summary: Json, planner: str) -> str:
    """Return the name of a planner, which says so where its paths are simplified."""
    simplified = planner in summary["settings"].get("simplify", ())
    return f"{planner} + simplify" if simplified else planner


def in_order(
    rows: Sequence[Json], samplers: Sequence[str] | None, planners: Sequence[str] | None
) -> list[Json]:
    """Return the rows of some samplers and planners, the samplers of a planner in this order."""
    shown = [
        row
        for row in rows
        if (samplers is None or row["sampler"] in samplers)
        and (planners is None or row["planner"] in planners)
    ]
    order = list(dict.fromkeys(row["planner"] for row in shown))
    wanted = list(samplers or dict.fromkeys(row["sampler"] for row in shown))
    return sorted(shown, key=lambda r: (order.index(r["planner"]), wanted.index(r["sampler"])))


def ratio_cells(row: Json, own: Json, ratios: Mapping[str, str]) -> list[str]:
    """Return the ratios; a dash where most runs of both end before they get there."""
    return [
        "-"
        if row["censored"][measure] >= 0.5 <= own["censored"][measure]
        else interval_of(row["ratios"][measure])
        for measure in ratios
    ]


def interval_of(interval: Mapping[str, float | None]) -> str:
    median, low, high = (ratio_text(interval[key]) for key in ("median", "low", "high"))
    return f"{median} [{low}, {high}]"


def ratio_text(value: float | None) -> str:
    """Return a ratio; a missing one is infinite: more than half of the runs did not get there."""
    return "∞" if value is None or math.isinf(value) else f"{value:.2f}"


def milliseconds(row: Json, measure: str) -> str:
    """Return a median time; a dash where most runs did not get there."""
    if row["censored"][measure] >= 0.5:
        return "-"
    return f"{1000 * row['measures'][measure]['median']:.3g} ms"


def length(value: float | None) -> str:
    """Return a length in multiples of the best known one; a dash for that of no path."""
    return "-" if value is None or math.isinf(value) else f"{value:.3f}"
