"""The tables of planning with controls and of overlapped inference, as Markdown."""

from __future__ import annotations

from suite_tables import Json, read

from cbagan_ompl.common.markdown import table

VERSIONS = ("2.0.1", "1.7.0")
MAPS = {"bundled": "bundled maps", "generated": "generated maps", "real_maps": "real maps"}


def control() -> str:
    """Return success and times of control planners, for both versions of OMPL."""
    header = ["maps", "car", "sampler"]
    for version in VERSIONS:
        header += [f"{version}: solved", "first path, quartiles (ms)", "ratio"]
    rows: dict[tuple[str, str, str], list[str]] = {}
    for maps in ("generated", "real_maps"):
        for version in VERSIONS:
            for row in read(f"control_{maps}_ompl_{version}.json")["rows"]:
                key = (MAPS[maps], row["car"], row["sampler"])
                rows.setdefault(key, []).extend(control_cells(row))
    return table(header, [[*key, *cells] for key, cells in rows.items()])


def control_cells(row: Json) -> list[str]:
    quartiles = " / ".join("-" if q is None else f"{q:.0f}" for q in row["first_ms"])
    return [f"{row['solved']:.0%}", quartiles, f"{row['ratio']:.2f}"]


def overlap() -> str:
    """Return the times to the first path with overlapped inference and without."""
    ways = {"uniform": "OMPL's own", "waiting": "waiting", "overlap": "overlap"}
    files = {
        f"{MAPS[maps]}, {version}": f"overlap_{maps}_ompl_{version}.json"
        for maps in ("bundled", "real_maps")
        for version in VERSIONS
    }
    files["bundled maps, 2.0.1, one core"] = "overlap_one_core.json"
    rows = []
    for name, file in files.items():
        for row in read(file)["rows"]:
            middle, low, high = row["ratio"]
            arrival = "" if row["arrival_ms"] is None else f"{row['arrival_ms']:.0f} ms"
            cells = [f"{row['solved']:.0%}", f"{row['first_ms']:.1f} ms"]
            ratio = "" if row["way"] == "uniform" else f"{middle:.2f} [{low:.2f}, {high:.2f}]"
            rows.append([name, row["planner"], ways[row["way"]], *cells, ratio, arrival])
    header = ["", "planner", "heat map", "solved", "first path", "ratio", "heat map there after"]
    return table(header, rows)
