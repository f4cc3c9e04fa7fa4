"""Write the tables of the documentation from the result files in benchmarks/results.

    python scripts/results_tables.py
    python scripts/results_tables.py --summaries results/summary.json

Without options it writes one Markdown table a file into docs/results/generated, where the pages of
the documentation include them, and the table of the README. With ``--summaries`` it prints the
table of planners and samplers for the ``summary.json`` of benchmarks of your own.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path

from calibrate import calibration_table, files_table
from inference_speed import speed_table as speed_of_models
from planner_tables import Json, ratios_table
from robot_tables import car_suites, robot_costs, robot_paths, wrong_poses
from search_speed import speed_table
from study_tables import control, footprints, overlap, paper_networks, spread
from suite_tables import (
    ROOT,
    VERSIONS,
    conditions,
    overhead,
    overview,
    read,
    rrtconnect,
    suite_tables,
    with_table,
)

from cbagan_ompl.common.files import make_folder, write_atomically
from cbagan_ompl.common.markdown import table

OUTPUT = ROOT / "docs" / "results" / "generated"
#: What the bundled model is trained on.
BUNDLED_LABEL = "exact, 5%"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--output", type=Path, default=OUTPUT, metavar="DIR", help="folder of the tables"
    )
    parser.add_argument(
        "--readme", type=Path, default=ROOT / "README.md", metavar="FILE", help="file of its table"
    )
    parser.add_argument(
        "--summaries", nargs="+", type=Path, metavar="FILE", help="print the table of these instead"
    )
    args = parser.parse_args()
    if args.summaries is not None:
        print("\n\n".join(ratios_table(read(path)) for path in args.summaries))
        return
    make_folder(args.output)
    for name, make in {**TABLES, **suite_tables()}.items():
        write_atomically(args.output / f"{name}.md", made(make) + "\n")
    args.readme.write_text(with_table(args.readme.read_text(encoding="utf-8")), encoding="utf-8")


def made(make: Callable[[], str]) -> str:
    """Return a table, or that it is not measured yet."""
    try:
        return make()
    except FileNotFoundError as error:
        return f"*Not measured with this version yet: `{Path(error.filename).name}`.*"


def unseen_maps_connectivity() -> str:
    regions = dict(read("unseen_maps_ompl_2.0.1.json")["regions"])
    regions["all"] = regions.pop("all")  # last
    rows = {
        "connected (8)": "connected",
        "connected (8), after repair": "connected_after_repair",
        "fraction of free space": "share_of_free_space",
    }
    return table(
        ["", *regions],
        [
            [name, *(f"{region[key]:.0%}" for region in regions.values())]
            for name, key in rows.items()
        ],
    )


def unseen_maps_inference() -> str:
    timings = read("unseen_maps_ompl_2.0.1.json")["timings"]
    rows = {
        "one prediction with the bundled model": "total_ms",
        "of which the network": "inference_ms",
        "of which the check that the region is connected": "kept_ms",
        "repair, where the region is not connected": "repair_ms",
        "the paper's CBAGAN at the same resolution": "cbagan_ms",
        "a SAGAN of the paper's size at the same resolution": "sagan_ms",
    }
    return table(
        ["", "median time"],
        [[name, f"{timings[key]:.1f} ms"] for name, key in rows.items() if key in timings],
    )


def wrong_heatmaps() -> str:
    versions = [read(f"unseen_maps_ompl_{version}.json")["wrong_heatmaps"] for version in VERSIONS]
    header = [text for version in VERSIONS for text in (f"{version}: first path", "solved")]
    lines = []
    for kind in versions[0]:
        line = ["OMPL's own sampler" if kind == "uniform" else kind]
        for rows in versions:
            line += [f"{rows[kind]['first_path_ratio']:.2f}", f"{rows[kind]['solved']:.1%}"]
        lines.append(line)
    return table(["heat map", *header], lines)


def wrong_heatmaps_by_planner() -> str:
    rows = []
    for version in VERSIONS:
        for planner, heatmaps in read(f"wrong_heatmaps_ompl_{version}.json")["planners"].items():
            slowest = max(heatmaps, key=lambda name: heatmaps[name]["effort_ratio"])
            losing = min(heatmaps, key=lambda name: heatmaps[name]["solved"])
            effort, row = heatmaps[slowest]["effort_ratio"], heatmaps[losing]
            solved = f"{row['uniform_solved']:.0%} / {row['solved']:.0%}"
            rows.append([version, planner, f"{effort:.2f}", slowest, solved])
    return table(["OMPL", "planner", "effort", "with", "solved: own / worst"], rows)


def labels() -> str:
    planners = ("RRT", "RRTstar", "InformedRRTstar")
    header = ["label", "RRT: nodes", "RRTstar: to 5 %", "InformedRRTstar: to 5 %", "time for one"]
    rows = []
    for label, values in read("labels.json")["ratios"].items():
        name = "union of RRT" if label == "RRT" else label.replace("%", " %")
        name = f"**{name}**" if label == BUNDLED_LABEL else name
        shown = (f"{values[planner]:.2f}" for planner in planners)
        rows.append([name, *shown, f"{values['label_ms']:.0f} ms"])
    return table(header, rows)


def sharpness() -> str:
    columns = {
        "RRT": "RRT: nodes",
        "RRTstar": "RRTstar: to 5 %",
        "InformedRRTstar": "InformedRRTstar: to 5 %",
    }
    ratios = read("sharpness.json")["median_ratios"]
    return table(
        ["exponent", *columns.values()],
        [
            [f"{float(exponent):g}", *(f"{ratios[planner][exponent]:.2f}" for planner in columns)]
            for exponent in ratios["RRT"]
        ],
    )


def ablation() -> str:
    variants = read("ablation.json")["variants"]
    rows = []
    for name, scores in variants.items():
        runs = scores["seeds"]
        dice = sum(run["dice"] for run in runs) / len(runs)
        least = min(run["connectivity"] for run in runs)
        difference = spread(scores["difference"], "+.4f") if "difference" in scores else "-"
        ious = spread(scores["iou"], ".4f")
        rows.append([name, str(len(runs)), ious, difference, f"{dice:.4f}", f"{100 * least:.1f} %"])
    header = ["network", "seeds", "IoU", "difference from the whole", "Dice"]
    return table([*header, "connected (8), least"], rows)


def refinement() -> str:
    rows = []
    for row in read("refinement.json")["maps"]:
        for model, result in row["scores"].items():
            values = result["scores"] | {"intervals": result["intervals"]}
            cells = [bracketed(values, name) for name in ("iou", "dice", "connectivity")]
            rows.append([row["map"], model.replace("refined-", "refined, seed "), *cells])
    return table(["map", "model", "IoU", "Dice", "connected (8)"], rows)


def bracketed(values: Json, name: str) -> str:
    low, high = values["intervals"][name]
    return f"{values[name]:.3f} [{low:.3f}, {high:.3f}]"


def generated_maps() -> str:
    models = read("generated_maps.json")["models"]
    names = {"before": "version 0.2", "not learned": "not learned", "bundled": "bundled model"}
    header = ["kind of maps"]
    for name in names.values():
        header += [f"connected (8): {name}", "IoU"]
    header += ["angle: not learned", "bundled model"]
    rows = []
    for kind in models["bundled"]:
        row = [kind]
        for name in names:
            scores = models[name][kind]
            row += [f"{100 * scores['connected']:.1f} %", f"{scores['iou']:.3f}"]
        angles = (models[name][kind]["angles"] for name in ("not learned", "bundled"))
        row += [f"{angle['median']:.2f}, {angle['p90']:.2f}" for angle in angles]
        rows.append(row)
    return table(header, rows)


def connected(scores: Json) -> str:
    return f"{100 * scores['connectivity']:.1f} %"


def regions() -> str:
    predictions, noise = read("evaluation.json")["predictions"], read("label_noise.json")
    names = {
        "cbagan": "**`cbagan`** (recipe `best`, 26 epochs)",
        "sagan-stored": "SAGAN as published with the data (stored images, 21.2 M)",
        "two labels": "*one label as a prediction of another*",
        "majority": "*the majority of five labels as a prediction of another*",
        "all free space": "all free space",
        "straight line": "a band around the straight line",
    }
    rows = []
    for key, name in names.items():
        if key in noise:
            scores = (f"*{noise[key][score]:.3f}*" for score in ("iou", "dice"))
            rows.append([name, *scores, "", "", ""])
        else:
            rows.append([name, *region_cells(predictions[key])])
    header = ["", "IoU", "Dice", "connected (8)", "parameters", "inference"]
    return table(header, rows)


def region_cells(prediction: Json) -> list[str]:
    scores, (low, high) = prediction["scores"], prediction["intervals"]["iou"]
    parameters, inference = prediction.get("parameters"), prediction.get("inference_ms")
    return [
        f"{scores['iou']:.3f} [{low:.3f}, {high:.3f}]",
        f"{scores['dice']:.3f}",
        connected(scores),
        "" if parameters is None else f"{parameters:,}",
        "" if inference is None else f"{inference:.1f} ms",
    ]


def label_noise() -> str:
    names = {
        "two labels": "two labels of one task",
        "majority": "the majority of five labels and another one",
        "own labels and the first": "a published label and one of ours",
        "own labels and the majority": "a published label and the majority of ours",
    }
    noise = read("label_noise.json")
    rows = [
        [name, f"{noise[key]['iou']:.3f}", f"{noise[key]['dice']:.3f}"]
        for key, name in names.items()
    ]
    return table(["agreement of", "IoU", "Dice"], rows)


def networks() -> str:
    trained = read("networks.json")["test"]
    predictions = read("evaluation.json")["predictions"]
    tasks = read("paper_tables.json")["all_test_tasks"]
    # Key of networks.json and of the other files, spatial and channel attention, name.
    rows = (
        ("cbagan", "cbagan-10-epochs", "yes", "yes", "CBAGAN"),
        ("sa", "cbagan-sa", "yes", "no", ""),
        ("ca", "cbagan-ca", "no", "yes", ""),
        ("none", "cbagan-none", "no", "no", ""),
        ("sagan", "sagan", "", "", "SAGAN (self-attention)"),
    )
    lines = []
    for network, model, spatial, channel, name in rows:
        seeds = trained[network].values()
        iou, dice = (
            ", ".join(f"{scores[score]:.{digits}f}" for scores in seeds)
            for score, digits in (("iou", 4), ("dice", 3))
        )
        inference = f"{tasks[model]['inference_ms'][0]:.1f} ms"
        parameters = f"{predictions[model]['parameters']:,}"
        nodes = nodes_of(tasks[model])
        lines.append([spatial, channel, name, parameters, iou, dice, nodes, inference])
    header = ["spatial", "channel", "network", "parameters", "IoU", "Dice", "RRT nodes"]
    return table([*header, "inference"], lines)


def nodes_of(samples: Json) -> str:
    median, low, high = samples["nodes"]
    return f"{median:.0f} [{low:.0f}, {high:.0f}]"


def paper_tables() -> str:
    results = read("paper_tables.json")
    names = {"uniform": "OMPL's", "sagan": "SAGAN", "cbagan": "CBAGAN", "worlds": "bundled model"}
    groups = {name.split(",")[0]: samplers for name, samplers in results["maps"].items()}
    groups[f"all {results['all_test_tasks']['tasks']:,} test tasks"] = results["all_test_tasks"]
    rows = []
    for group, samplers in groups.items():
        for sampler, name in names.items():
            values = samplers[sampler]
            planning, inference = (values[key][0] for key in ("planning_ms", "inference_ms"))
            rows.append(
                [
                    group if sampler == "uniform" else "",
                    name,
                    nodes_of(values),
                    f"{planning:.1f} ms",
                    f"{inference:.1f} ms" if inference else "",
                ]
            )
    return table(["", "sampler", "nodes", "planning", "inference"], rows)


def replanning() -> str:
    scenes = {"static": "none", "obstacles": "appear"}
    variants = {"uniform": "OMPL's own sampler", "fresh": "predicted anew", "kept": "Replanner"}
    rows = []
    for maps in ("bundled", "real_maps"):
        results = read(f"replanning_{maps}.json")
        name = f"{maps.replace('_', ' ')}, {results['tasks']} tasks"
        for scene, obstacles in scenes.items():
            for variant, heatmap in variants.items():
                values = results[scene][variant]
                times = [f"{values[key]:.1f} ms" for key in ("median_ms", "p95_ms")]
                shares = [f"{100 * values[key]:.1f} %" for key in ("in_time", "kept")]
                rows.append([name, obstacles, heatmap, *times, *shares])
    header = ["maps", "obstacles", "heat map", "median", "95 % within", "path in 100 ms", "kept"]
    return table(header, rows)


#: What makes each table, by the name of its file.
TABLES: dict[str, Callable[[], str]] = {
    "unseen_maps_connectivity": unseen_maps_connectivity,
    "unseen_maps_inference": unseen_maps_inference,
    "overview": overview,
    "conditions": conditions,
    "rrtconnect": rrtconnect,
    "overhead": overhead,
    "wrong_heatmaps": wrong_heatmaps,
    "wrong_heatmaps_by_planner": wrong_heatmaps_by_planner,
    "sharpness": sharpness,
    "labels": labels,
    "generated_maps": generated_maps,
    "ablation": ablation,
    "refinement": refinement,
    "regions": regions,
    "label_noise": label_noise,
    "networks": networks,
    "paper_networks": paper_networks,
    "paper_tables": paper_tables,
    "replanning": replanning,
    "calibration": lambda: calibration_table(read("calibration.json")),
    "calibration_real_maps": lambda: files_table(read("calibration.json")),
    "inference_speed": lambda: speed_of_models(read("inference_speed.json")),
    "robot_paths": robot_paths,
    "robot_costs": robot_costs,
    "wrong_poses": wrong_poses,
    "car_suites": car_suites,
    "footprints": footprints,
    "control": control,
    "overlap": overlap,
    "search_speed": lambda: speed_table(read("search_speed.json")),
}


if __name__ == "__main__":
    main()
