"""The tables of planning with controls and of overlapped inference, as Markdown."""

from __future__ import annotations

from suite_tables import VERSIONS, Json, read

from cbagan_ompl.common.markdown import table

MAPS = {
    "bundled": "bundled maps",
    "generated": "generated maps",
    "real_maps": "real maps",
    "street_maps": "street maps",
}


def control() -> str:
    """Return success and times of control planners, for both versions of OMPL."""
    rows: list[list[str]] = []
    for maps in ("generated", "real_maps"):
        for version in VERSIONS:
            for row in read(f"control_{maps}_ompl_{version}.json")["rows"]:
                name = f"{MAPS[maps]}, {version}"
                rows.append([name, row["car"], row["planner"], row["sampler"], *control_cells(row)])
    header = ["maps, OMPL", "car", "planner", "sampler"]
    return table([*header, "solved", "first path, quartiles (ms)", "ratio"], rows)


def control_cells(row: Json) -> list[str]:
    quartiles = " / ".join("-" if q is None else f"{q:.0f}" for q in row["first_ms"])
    return [f"{row['solved']:.0%}", quartiles, f"{row['ratio']:.2f}"]


def overlap() -> str:
    """Return the times to the first path with overlapped inference and without."""
    files = {
        f"{MAPS[maps]}, {version}": f"overlap_{maps}_ompl_{version}.json"
        for maps in ("bundled", "real_maps", "street_maps")
        for version in VERSIONS
    }
    files["bundled maps, 2.0.1, one core"] = "overlap_one_core.json"
    rows = []
    for name, file in files.items():
        for row in read(file)["rows"]:
            middle, low, high = row["clock_ratio"]
            arrival = "-" if row["arrival_ms"] is None else f"{row['arrival_ms']:.0f} ms"
            cells = [f"{row['solved']:.0%}", f"{row['clock_ms']:.1f} ms"]
            ratio = "-" if row["way"] == "uniform" else f"{middle:.2f} [{low:.2f}, {high:.2f}]"
            rows.append([name, row["planner"], row["way"], *cells, ratio, arrival])
    header = ["maps, OMPL", "planner", "heat map", "solved", "first path", "ratio", "arrival"]
    return table(header, rows)
