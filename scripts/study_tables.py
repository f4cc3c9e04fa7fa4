"""The tables of controls, of overlapped inference, of the paper's networks and of footprints."""

from __future__ import annotations

from statistics import median

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
    """Return how well the region fits rectangles that turn."""
    rows = []
    for row in read("footprints.json")["rows"]:
        name = f"**{row['heatmap']}**" if row["heatmap"] == "as shipped" else row["heatmap"]
        iou = spread(row["iou"], ".2f")
        shares = [f"{row[score][0]:.2f}" for score in ("recall", "precision")]
        paths = [spread([100 * share for share in row["within"]], ".0f"), f"{row['held'][0]:.0%}"]
        longer = "-" if row["ratio"] is None else f"{100 * (row['ratio'][0] - 1):.1f} %"
        rows.append([row["tasks"], row["rectangle"], name, iou, *shares, *paths, longer])
    header = ["tasks", "rectangle", "network on, or heat map", "IoU", "recall", "precision"]
    return table([*header, "path within 5 % (%)", "any path", "longer, median"], rows)


def spread(interval: list[float], form: str) -> str:
    """Return a mean with the ends of its interval."""
    mean, low, high = interval
    return f"{mean:{form}} ({low:{form}} to {high:{form}})"
