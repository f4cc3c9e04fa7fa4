"""The table of the README from summaries of benchmarks: ratios to OMPL's own sampler.

python benchmarks/readme_table.py benchmarks/results/real_maps_ompl_*.json
"""

from __future__ import annotations

import argparse
import json
import math
from pathlib import Path
from typing import Any

COLUMNS = {
    "nodes": "nodes",
    "first_solution_s": "first path",
    "within_5_percent_s": "within 5 %",
    "within_5_percent_total_s": "the same with inference",
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("summaries", nargs="+", type=Path, metavar="SUMMARY")
    args = parser.parse_args()
    header = ["OMPL", "planner", "sampler", "solved", "OMPL's own solved", *COLUMNS.values()]
    print(f"| {' | '.join(header)} |\n|{'---|' * len(header)}")
    for path in args.summaries:
        summary = json.loads(path.read_text(encoding="utf-8"))
        own = {row["planner"]: row for row in summary["overall"] if not row["ratios"]}
        for row in summary["overall"]:
            if row["ratios"]:
                print(line(summary["ompl_version"], row, own[row["planner"]]))


def line(version: str, row: dict[str, Any], own: dict[str, Any]) -> str:
    solved = (f"{one['success']:.1%}" for one in (row, own))
    ratios = (
        # Where most runs of both end at the limit, a ratio of limits would say nothing.
        "-"
        if row["censored"][measure] >= 0.5 <= own["censored"][measure]
        else cell(row["ratios"][measure])
        for measure in COLUMNS
    )
    return f"| {' | '.join([version, row['planner'], row['sampler'], *solved, *ratios])} |"


def cell(interval: dict[str, float | None]) -> str:
    median, low, high = (number(interval[key]) for key in ("median", "low", "high"))
    return f"{median} [{low}, {high}]"


def number(value: float | None) -> str:
    """A missing value stands for an infinite one: more than half of the runs did not get there."""
    return "∞" if value is None or math.isinf(value) else f"{value:.2f}"


if __name__ == "__main__":
    main()
