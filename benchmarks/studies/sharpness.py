"""How peaked should a heat map be? Planning with powers of it, on synthetic maps.

    python benchmarks/studies/sharpness.py --json benchmarks/results/sharpness.json \
        --plot sharpness.png

A power of the heat map is what the network would predict after training with a narrower region: the
exponent 2 halves the detour at which a value falls to one half. The maps are generated as those of
training, with other seeds. Ratios are to OMPL's own sampler, medians over the tasks.
"""

from __future__ import annotations

import argparse
from collections import defaultdict

import numpy as np
from matplotlib.figure import Figure
from tqdm import trange

from cbagan_ompl import GridMap, PlanResult, load_model, plan
from cbagan_ompl.benchmarking.plot_styles import STYLES
from cbagan_ompl.common.files import write_json
from cbagan_ompl.datasets.geodesic import distance_field
from cbagan_ompl.datasets.synthetic import SyntheticSettings, generate_map_tasks
from cbagan_ompl.planning.compat import ompl_version

EXPONENTS = (0.5, 1.0, 2.0, 3.0, 4.0, 8.0)
RANGE, TIME, WITHIN = 20.0, 0.5, 1.05
MEASURES = {"RRT": "nodes", "RRTstar": "time to 5 %", "InformedRRTstar": "time to 5 %"}
# Training uses part 0, validation and test parts 1 and 2.
PART = 3


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--model", metavar="FILE")
    parser.add_argument("--maps", type=int, default=60, help="one task on each (default: 60)")
    parser.add_argument("--json", metavar="FILE")
    parser.add_argument("--plot", metavar="FILE")
    args = parser.parse_args()
    predictor = load_model(args.model)
    ratios: dict[str, dict[float, list[float]]] = defaultdict(lambda: defaultdict(list))
    for number in trange(args.maps):
        synthetic = generate_map_tasks(SyntheticSettings(), PART, number)
        grid, start, goal = GridMap(synthetic.maps[0]), synthetic.start[0], synthetic.goal[0]
        (u, v), (x, y) = start.astype(int).tolist(), goal.astype(int).tolist()
        optimum = float(distance_field(grid.free, (u, v))[y, x])
        heatmap = predictor.predict(grid, start, goal)
        for planner in MEASURES:
            options = {"planner": planner, "range": RANGE, "time": TIME, "seed": number}
            own = measure(plan(grid, start, goal, sampler="uniform", **options), optimum, TIME)
            for exponent in EXPONENTS:
                result = plan(grid, start, goal, heatmap=heatmap, sharpness=exponent, **options)
                ratios[planner][exponent].append(measure(result, optimum, TIME) / own)
    medians = {
        planner: {
            str(exponent): float(np.median(values)) for exponent, values in by_exponent.items()
        }
        for planner, by_exponent in ratios.items()
    }
    for planner, by_exponent in medians.items():
        print(
            planner,
            MEASURES[planner],
            {key: round(m, 3) for key, m in by_exponent.items()},
        )
    if args.json is not None:
        write_json(args.json, {"ompl": ompl_version(), "maps": args.maps, "median_ratios": medians})
    if args.plot is not None:
        draw(medians, args.plot)


def measure(result: PlanResult, optimum: float, limit: float) -> float:
    """Return the nodes of RRT, or the time of others until the path is within 5 % of the shortest.

    Runs that do not get there count with the time limit.
    """
    if result.planner == "RRT":
        return float(result.nodes)
    times = [time for time, cost in result.progress if cost <= WITHIN * optimum]
    return times[0] if times else limit


def draw(medians: dict[str, dict[str, float]], path: str) -> None:
    figure = Figure(figsize=(5.2, 3.4), layout="constrained")
    axes = figure.subplots()
    for (planner, by_exponent), style in zip(medians.items(), STYLES[1:], strict=False):
        label = f"{planner}, {MEASURES[planner]}"
        axes.plot(
            [float(exponent) for exponent in by_exponent],
            list(by_exponent.values()),
            label=label,
            **style.line | {"markevery": None},
        )
    axes.set_xscale("log", base=2)
    axes.set(xlabel="exponent of the heat map", ylabel="ratio to OMPL's own sampler", ylim=(0, 1))
    axes.set_xticks(EXPONENTS, [f"{exponent:g}" for exponent in EXPONENTS])
    axes.legend(frameon=False, fontsize=8)
    figure.savefig(path, dpi=120)


if __name__ == "__main__":
    main()
