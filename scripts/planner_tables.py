"""The table of planners and samplers of one benchmark or several, as Markdown."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from cbagan_ompl.common.markdown import table

#: Columns of the tables of planners and samplers: ratios to OMPL's own sampler, by their names.
RATIOS = {
    "nodes": "nodes",
    "within_5_percent_s": "to 5 %",
    "within_5_percent_total_s": "with inference",
}
RATIOS_WITH_FIRST = {
    "nodes": "nodes",
    "first_solution_s": "first path",
    "first_solution_total_s": "with inference",
    "within_5_percent_s": "to 5 %",
    "within_5_percent_total_s": "with inference",
}

Json = Mapping[str, Any]


def planners_table(
    summaries: Sequence[Json],
    ratios: Mapping[str, str] = RATIOS,
    samplers: Sequence[str] | None = None,
) -> str:
    """Return the table of planners and samplers, for several versions of OMPL side by side.

    Args:
        summaries: the ``summary.json`` of a benchmark, once for each version of OMPL.
        ratios: the measures that are shown, and the names of their columns.
        samplers: that are shown, in this order; all but OMPL's own by default.
    """
    header = ["planner", "sampler"]
    rows: dict[tuple[str, str], list[str]] = {}
    for summary in summaries:
        header += [f"{summary['ompl_version']}: solved", *ratios.values()]
        own = {row["planner"]: row for row in summary["overall"] if not row["ratios"]}
        for row in summary["overall"]:
            if row["ratios"] and (samplers is None or row["sampler"] in samplers):
                cells = rows.setdefault((row["planner"], row["sampler"]), [])
                cells += ratio_cells(row, own[row["planner"]], ratios)
    planners = list(dict.fromkeys(planner for planner, _ in rows))
    order = list(samplers or dict.fromkeys(sampler for _, sampler in rows))
    names = sorted(rows, key=lambda name: (planners.index(name[0]), order.index(name[1])))
    return table(header, [[*name, *rows[name]] for name in names])


def ratio_cells(row: Json, own: Json, ratios: Mapping[str, str]) -> list[str]:
    """Return how many runs were solved, by OMPL's own sampler and by this one, and the ratios."""
    shown = [
        # Where most runs of both end at the limit, a ratio of limits would say nothing.
        "-"
        if row["censored"][measure] >= 0.5 <= own["censored"][measure]
        else interval_of(row["ratios"][measure])
        for measure in ratios
    ]
    return [f"{own['success']:.0%} / {row['success']:.0%}", *shown]


def interval_of(interval: Mapping[str, float | None]) -> str:
    median, low, high = (ratio_text(interval[key]) for key in ("median", "low", "high"))
    return f"{median} [{low}, {high}]"


def ratio_text(value: float | None) -> str:
    """Return a ratio; a missing one is infinite: more than half of the runs did not get there."""
    return "∞" if value is None or math.isinf(value) else f"{value:.2f}"
