"""The tables of planning for robots with heading, as Markdown."""

from __future__ import annotations

from suite_tables import Json, read

from cbagan_ompl.common.markdown import table


def robot_paths() -> str:
    """Return success and times of robots on real and bundled maps."""
    header = ["space", "planner", "sampler", "runs", "solved", "first path, quartiles (ms)"]
    header.append("ratio of medians")
    return table(header, [path_cells(row) for row in read("robot_paths_ompl_2.0.1.json")["rows"]])


def path_cells(row: Json) -> list[str]:
    solved, low, high = row["solved"]
    quartiles = " / ".join("-" if q is None else f"{q:.0f}" for q in row["first_ms"])
    ratio, least, most = row["sooner"]
    ratios = "-" if ratio is None else f"{ratio:.1f} ({least:.1f} to {most:.1f})"
    return [
        row["space"],
        row["planner"],
        row["sampler"],
        str(row["runs"]),
        f"{solved:.0%} ({low:.0%} to {high:.0%})",
        quartiles,
        ratios,
    ]


def car_suites() -> str:
    """Return success, times and costs in Bench-MR's parking lots and warehouse."""
    header = ["scene", "planner", "sampler", "runs", "solved", "first path (ms)", "cost"]
    names = ("scene", "planner", "sampler")
    rows = [
        [
            *(row[name] or "-" for name in names),
            str(row["runs"]),
            f"{row['solved']:.0%}",
            number(row["first_ms"], ".0f"),
            number(row["cost"], ".1f"),
        ]
        for row in read("car_suites_ompl_2.0.1.json")["rows"]
    ]
    return table(header, rows)


def number(value: float | None, form: str) -> str:
    return "-" if value is None else f"{value:{form}}"
