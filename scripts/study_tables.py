"""The tables of controls, of overlapped inference, of the paper's networks and of footprints."""

from __future__ import annotations

from statistics import median

from robot_tables import quartile_cell
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
    return [f"{row['solved']:.0%}", quartile_cell(row["first_ms"]), f"{row['ratio']:.2f}"]


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


def paper_networks() -> str:
    """Return the scores of the paper's networks, trained with its recipe."""
    names = {
        "cbagan": "CBAGAN: both kinds of attention",
        "sa": "spatial attention alone",
        "ca": "channel attention alone",
        "none": "no attention",
        "sagan": "SAGAN: self-attention",
        "segmentation": "CBAGAN without discriminators",
    }
    networks, rows = read("paper_networks.json")["networks"], []
    for key, name in names.items():
        row = networks[key]
        means = [f"{row[score][0]:.3f}" for score in ("dice", "right_pixels")]
        connected = f"{100 * row['connectivity'][0]:.1f} %"
        nodes = [spread(row[f"{way}_nodes_ratio"], ".2f") for way in ("plain", "adapted")]
        inference = median(run["plain"]["inference_ms"][0] for run in row["seeds"])
        times = [f"{inference:.1f} ms", f"{row['epoch_s'] / 3:.0f} min"]
        rows.append([name, spread(row["iou"], ".3f"), *means, connected, *nodes, *times])
    header = ["network", "IoU", "Dice", "right pixels", "connected (8)", "RRT nodes, not adapted"]
    return table([*header, "RRT nodes, adapted", "inference", "training"], rows)


def footprints() -> str:
    """Return how well the region fits rectangles that turn, and which paths it holds."""
    by_heatmap: dict[tuple[str, str], dict[str, Json]] = {}
    for row in read("footprints.json")["rows"]:
        by_heatmap.setdefault((row["tasks"], row["heatmap"]), {})[row["rectangle"]] = row
    sides = ("1:1", "2:1", "4:1")
    overlaps, paths = [], []
    for (tasks, heatmap), rows in by_heatmap.items():
        name = f"**{heatmap}**" if heatmap == "as shipped" else heatmap
        slender = rows["4:1"]
        ious = [spread(row["iou"], ".2f") for row in rows.values()]
        shares = [f"{slender[score][0]:.2f}" for score in ("recall", "precision", "used")]
        overlaps.append([tasks, name, *ious, *shares])
        held = [spread([100 * share for share in row["within"]], ".0f") for row in rows.values()]
        longer = "-" if slender["ratio"] is None else f"{100 * (slender['ratio'][0] - 1):.1f} %"
        some = [f"{rows[side]['held'][0]:.0%}" for side in sides[1:]]
        paths.append([tasks, name, *held, *some, longer])
    header = ["tasks", "heat map"]
    regions = [*(f"IoU, {side}" for side in sides), "recall, 4:1", "precision, 4:1", "used, 4:1"]
    routes = [f"within 5 %, {side} (%)" for side in sides]
    routes += ["any path, 2:1", "any path, 4:1", "longer, 4:1"]
    return "\n\n".join((table([*header, *regions], overlaps), table([*header, *routes], paths)))


def spread(interval: list[float], form: str) -> str:
    """Return a mean with the ends of its interval."""
    mean, low, high = interval
    return f"{mean:{form}} ({low:{form}} to {high:{form}})"
