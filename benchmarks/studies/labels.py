"""Which label guides planners best? Planning with labels as heat maps, on synthetic maps.

    python benchmarks/studies/labels.py --maps 16 --json benchmarks/results/labels.json

A network can at best predict the labels that it is trained on. Here planners sample the labels
themselves: the exact ones of several widths (EPSILON of cbagan_ompl.datasets.geodesic_labels), and
the paper's, the union of 50 runs of RRT. Ratios are to OMPL's own sampler, geometric means over the
tasks.
"""

from __future__ import annotations

import argparse
from collections import defaultdict
from functools import partial
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray
from sharpness import measure
from tqdm import trange

from cbagan_ompl import GridMap, Heatmap, plan
from cbagan_ompl.common.files import write_json
from cbagan_ompl.datasets.generation import ITERATIONS, RANGE, RUNS
from cbagan_ompl.datasets.geodesic import distance_field
from cbagan_ompl.datasets.geodesic_labels import geodesic_label
from cbagan_ompl.datasets.rrt_labels import rrt_region
from cbagan_ompl.datasets.synthetic import SyntheticSettings, generate_map_tasks
from cbagan_ompl.planning.compat import ompl_version

EPSILONS = (0.01, 0.02, 0.05, 0.1)
LONGEST_EDGE, TIME = 20.0, 0.4
PLANNERS = ("RRT", "RRTstar", "InformedRRTstar")
# Training uses part 0, validation and test parts 1 and 2, the study of the sharpness part 3.
PART = 4


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--maps", type=int, default=30, help="one task on each (default: 30)")
    parser.add_argument("--runs", type=int, default=3, help="of each planner (default: 3)")
    parser.add_argument("--json", metavar="FILE")
    args = parser.parse_args()
    ratios: dict[str, dict[str, list[float]]] = defaultdict(lambda: defaultdict(list))
    seconds: dict[str, list[float]] = defaultdict(list)
    for number in trange(args.maps):
        synthetic = generate_map_tasks(SyntheticSettings(), PART, number)
        grid, endpoints = GridMap(synthetic.maps[0]), (synthetic.start[0], synthetic.goal[0])
        labels, optimum = labels_of(grid, endpoints, number, seconds)
        for planner in PLANNERS:
            measured = partial(median_measure, grid, endpoints, planner, optimum, args.runs)
            own = measured(sampler="uniform")
            for name, values in labels.items():
                heatmap = Heatmap(values, grid)
                ratios[name][planner].append(measured(heatmap=heatmap, sharpness=1.0) / own)
    table = {
        name: {planner: float(np.exp(np.mean(np.log(r)))) for planner, r in by_planner.items()}
        | {"label_ms": 1e3 * float(np.median(seconds[name]))}
        for name, by_planner in ratios.items()
    }
    for name, row in table.items():
        print(name, {key: round(value, 3) for key, value in row.items()})
    if args.json is not None:
        write_json(args.json, {"ompl": ompl_version(), "maps": args.maps, "ratios": table})


def labels_of(
    grid: GridMap, endpoints: tuple[Any, Any], seed: int, seconds: dict[str, list[float]]
) -> tuple[dict[str, NDArray[Any]], float]:
    """Return the labels of a task by name, and the length of its shortest path.

    What they took goes into ``seconds``, by the same names.
    """
    (u, v), (x, y) = (point.astype(int).tolist() for point in endpoints)
    began = perf_counter()
    from_start, from_goal = distance_field(grid.free, (u, v)), distance_field(grid.free, (x, y))
    exact = perf_counter() - began
    labels: dict[str, NDArray[Any]] = {}
    for epsilon in EPSILONS:
        name = f"exact, {epsilon:.0%}"
        labels[name] = geodesic_label(from_start, from_goal, (x, y), epsilon)
        seconds[name].append(exact)
    began = perf_counter()
    task = grid.check_task(*endpoints)
    labels["RRT"] = rrt_region(grid, task, RUNS, grid.width * RANGE, ITERATIONS, seed)
    seconds["RRT"].append(perf_counter() - began)
    kept = {name: values for name, values in labels.items() if values.any()}
    return kept, float(from_start[y, x])


def median_measure(
    grid: GridMap,
    endpoints: tuple[Any, Any],
    planner: str,
    optimum: float,
    runs: int,
    **options: Any,
) -> float:
    """Return the median over the runs: nodes of RRT, time to 5 % of the shortest path of others."""
    results = [
        plan(grid, *endpoints, planner=planner, range=LONGEST_EDGE, time=TIME, seed=seed, **options)
        for seed in range(runs)
    ]
    return float(np.median([measure(result, optimum, TIME) for result in results]))


if __name__ == "__main__":
    main()
