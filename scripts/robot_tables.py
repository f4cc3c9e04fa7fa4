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
    return [
        row["space"],
        row["planner"],
        row["sampler"],
        str(row["runs"]),
        f"{solved:.0%} ({low:.0%} to {high:.0%})",
        quartile_cell(row["first_ms"]),
        ratio_cell(row["sooner"]),
    ]


def robot_costs() -> str:
    """Return the times of RRT* until it is near the best known path."""
    result = read("robot_paths_ompl_2.0.1.json")
    rows = [
        [
            row["space"],
            row["sampler"],
            str(row["tasks"] * result["full_seeds"]),
            quartile_cell(row["within_ms"]),
            ratio_cell(row["within_sooner"]),
        ]
        for row in result["rows"]
        if "within_ms" in row
    ]
    header = ["space", "sampler", "runs", "within 10 %, quartiles (ms)", "ratio of medians"]
    return table(header, rows)


def wrong_poses() -> str:
    """Return what wrong heat maps cost robots with heading."""
    by_heatmap: dict[str, dict[str, str]] = {}
    for row in read("wrong_poses_ompl_2.0.1.json")["rows"]:
        ratio, low, high = row["ratio"]
        cell = f"{ratio:.2f} ({low:.2f} to {high:.2f}), {row['solved']:.0%}"
        by_heatmap.setdefault(row["heatmap"], {})[f"{row['space']} {row['planner']}"] = cell
    columns = list(next(iter(by_heatmap.values())))
    rows = [[name, *(cells[column] for column in columns)] for name, cells in by_heatmap.items()]
    return table(["heat map", *columns], rows)


def quartile_cell(values: list[float | None]) -> str:
    return " / ".join("-" if value is None else f"{value:.0f}" for value in values)


def ratio_cell(values: list[float | None]) -> str:
    ratio, least, most = values
    return "-" if ratio is None else f"{ratio:.1f} ({least:.1f} to {most:.1f})"


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
