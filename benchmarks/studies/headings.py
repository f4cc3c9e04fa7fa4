"""How should samples follow the headings of a heat map? Robots with a shape on generated maps.

    python benchmarks/studies/headings.py --rows headings.jsonl --json headings.json \
        --plot docs/images/headings.png

One option at a time is changed: the spread, the uniform fraction, the fraction before the goal, the
reversals, how far the map is inflated that the network sees, and whether the heading is that of the
cheapest way to the goal or that of the nearest pixel of one path. The robot is a rectangle of
12 x 6 pixels. Times are seconds of one thread's CPU until the first path, heat map and headings
included; a run without a path in time counts as twice the limit in the geometric mean. Each run is
a line of ``--rows`` as soon as it has ended; a run that is there already is not done again.
"""

from __future__ import annotations

import argparse
from collections import defaultdict
from dataclasses import asdict, replace
from itertools import product
from math import inf
from time import process_time
from typing import Any

import cv2
import numpy as np
from pose_runs import (
    PoseTask,
    generated_tasks,
    seeded_setup,
    solve,
)
from run_rows import RunRows

from cbagan_ompl import HeadingSpread, Heatmap, Predictor, Robot, TaskError, attach, load_model
from cbagan_ompl.common.files import write_json
from cbagan_ompl.maps.grid_search import shortest_path
from cbagan_ompl.planning import compat
from cbagan_ompl.planning.compat import ou

OWN, DEFAULT, ALONG, INFLATED = "OMPL's own", "default", "along the path", "inflated by"
CURVES = {
    "spread": (0.1, 0.2, 0.8, 1.6),
    "uniform_fraction": (0.05, 0.4, 0.7, 1.0),
    "approach_fraction": (0.0, 0.1, 0.5, 0.8),
    "reverse_fraction": (0.0, 0.1, 0.35, 0.5),
}
INFLATIONS = (1.6, 4.5, 6.0)
# Only one space has reversals.
UNUSED = {
    "SE2": {"reverse_fraction"},
    "Dubins 10": {"reverse_fraction"},
    "Reeds-Shepp 10": set[str](),
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=20, help="tasks")
    parser.add_argument("--seeds", type=int, default=1, help="runs of each task")
    parser.add_argument("--planners", default="RRTstar,RRT")
    parser.add_argument("--time", type=float, default=0.7, help="CPU seconds of a run")
    parser.add_argument("--rows", metavar="FILE", default="headings.jsonl")
    parser.add_argument("--json", metavar="FILE")
    parser.add_argument("--plot", metavar="FILE")
    args = parser.parse_args()
    ou.setLogLevel(ou.LOG_NONE)
    predictor = load_model()
    done = RunRows(args.rows)
    tasks = list(generated_tasks(args.count))
    runs = product(args.planners.split(","), range(args.seeds), range(len(tasks)), UNUSED)
    for planner, seed, number, space in runs:
        for way in ways_of(space):
            key = space, planner, way, number, seed
            if key not in done.keys:
                done.add(key, measure(tasks[number], key, predictor, args.time))
    summary = summarise(done.rows, args.time)
    for row in summary:
        print(row)
    defaults = asdict(HeadingSpread())
    if args.json is not None:
        head = {"ompl": compat.ompl_version(), "time": args.time, "defaults": defaults}
        write_json(args.json, head | {"tasks": args.count, "seeds": args.seeds, "rows": summary})
    if args.plot is not None:
        plot(summary, defaults, args.plot)


def ways_of(space: str) -> list[str]:
    """Return the ways to sample, by name."""
    curves = [(name, value) for name in CURVES.keys() - UNUSED[space] for value in CURVES[name]]
    changed = [f"{name} {value:g}" for name, value in sorted(curves)]
    inflated = [f"{INFLATED} {radius:g}" for radius in INFLATIONS]
    return [OWN, DEFAULT, ALONG, *inflated, *changed]


def measure(
    task: PoseTask, key: tuple[str, str, str, int, int], predictor: Predictor, limit: float
) -> dict[str, Any]:
    """Return the time until the first path; None without one."""
    space, planner, way, number, repetition = key
    seed = number + 1000 * repetition
    robot, setup = seeded_setup(task, space, planner, seed)
    if way == OWN:
        return {"first": first(solve(setup, limit, True), 0.0)}
    began = process_time()
    heatmap = make_heatmap(task, robot, way, predictor)
    with attach(setup, heatmap, seed=seed, heading=spread_of(way)):
        inference = process_time() - began
        costs = solve(setup, limit, True)
    return {"first": first(costs, inference)}


def first(costs: list[tuple[float, float]], inference: float) -> float | None:
    return inference + costs[0][0] if costs else None


def spread_of(way: str) -> HeadingSpread:
    name, _, value = way.partition(" ")
    return replace(HeadingSpread(), **{name: float(value)}) if name in CURVES else HeadingSpread()


def make_heatmap(task: PoseTask, robot: Robot, way: str, predictor: Predictor) -> Heatmap:
    if way.startswith(INFLATED):
        inflated = task.grid.inflated(float(way.removeprefix(INFLATED)))
        try:
            return predictor.predict(inflated, task.start[:2], task.goal[:2])
        except TaskError:  # nothing connects start and goal there
            pass
    heatmap = predictor.predict(task.grid, task.start, task.goal, robot=robot)
    return directed_along(heatmap, task) if way == ALONG else heatmap


def directed_along(heatmap: Heatmap, task: PoseTask) -> Heatmap:
    """Return the heat map with the direction of the nearest pixel of the cheapest path over it."""
    grid = heatmap.grid
    ends = [tuple(map(int, grid.to_pixel(pose[:2]))) for pose in (task.start, task.goal)]
    path = shortest_path(grid.free, *ends, 1 / (heatmap.values + np.float32(0.02)))
    assert path is not None
    ahead, behind = (np.clip(np.arange(len(path)) + k, 0, len(path) - 1) for k in (8, -8))
    angles = np.arctan2(*(path[ahead] - path[behind]).T[::-1])
    off_path = np.ones(grid.shape, np.uint8)
    off_path[path[:, 1], path[:, 0]] = 0
    labels = cv2.distanceTransformWithLabels(
        off_path, cv2.DIST_L2, cv2.DIST_MASK_5, labelType=cv2.DIST_LABEL_PIXEL
    )[1]
    by_label = np.zeros(labels.max() + 1)
    by_label[labels[path[:, 1], path[:, 0]]] = angles
    return heatmap.with_heading(by_label[labels])


def summarise(done: list[dict[str, Any]], limit: float) -> list[dict[str, Any]]:
    """Return success, quartiles of the times and their geometric mean, by space and planner."""
    groups: dict[tuple[str, str, str], list[float]] = defaultdict(list)
    for row in done:
        space, planner, way, *_ = row["key"]
        groups[space, planner, way].append(inf if row["first"] is None else row["first"])
    summary = []
    for (space, planner, way), times in groups.items():
        quartiles = np.percentile(times, (25, 50, 75), method="nearest")
        logs = np.log(np.minimum(times, 2 * limit))
        error = float(logs.std() / np.sqrt(len(logs)))
        summary.append(
            {"space": space, "planner": planner, "way": way, "runs": len(times)}
            | {"solved": round(float(np.isfinite(times).mean()), 3)}
            | {"first_ms": [round(1e3 * float(q), 1) if q < inf else None for q in quartiles]}
            | {"mean_ms": round(1e3 * float(np.exp(logs.mean())), 1)}
            | {"mean_error": round(error, 2)}
        )
    return summary


def plot(summary: list[dict[str, Any]], defaults: dict[str, float], path: str) -> None:
    """Draw the geometric mean of the time against each option."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11, 3.2), layout="constrained")
    for axes, name in zip(figure.subplots(1, len(CURVES), sharey=True), CURVES, strict=True):
        for space, unused in UNUSED.items():
            if name in unused:
                continue
            for planner, style in (("RRTstar", "-"), ("RRT", "--")):
                means = {
                    row["way"]: (row["mean_ms"], row["mean_error"])
                    for row in summary
                    if (row["space"], row["planner"]) == (space, planner)
                }
                if not means:
                    continue
                points = {value: means[f"{name} {value:g}"] for value in CURVES[name]}
                points[defaults[name]] = means[DEFAULT]
                xs = sorted(points)
                ys = np.array([points[x][0] for x in xs])
                errors = np.array([points[x][1] for x in xs])
                color = f"C{list(UNUSED).index(space)}"
                axes.plot(xs, ys, style, color=color, marker="o", ms=3, label=f"{space} {planner}")
                axes.fill_between(
                    xs, ys * np.exp(-errors), ys * np.exp(errors), color=color, alpha=0.08
                )
        axes.axvline(defaults[name], color="0.7", lw=0.8, zorder=0)
        axes.set(xlabel=name, yscale="log")
    figure.axes[0].set_ylabel("first path, ms (geometric mean)")
    figure.legend(*figure.axes[0].get_legend_handles_labels(), loc="outside upper center", ncols=6)
    figure.savefig(path, dpi=110)


if __name__ == "__main__":
    main()
