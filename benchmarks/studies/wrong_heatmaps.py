"""What heat maps that are wrong on purpose cost each planner that a hook reaches.

    python benchmarks/studies/wrong_heatmaps.py --json wrong_heatmaps.json

One map of 256 x 256 px: two walls with a wide gap each, and a pocket. The effort of a run without a
path is that of its limit. It is counted in iterations of the planner to its first path, or in nodes
for planners that take no termination condition in Python, and compared with OMPL's own sampler.
Planners that go on after their first path without telling it run to a tenth of the limit: of them
the solved runs count.
"""

from __future__ import annotations

import argparse
from itertools import pairwise
from math import inf
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import fisher_exact
from tqdm import tqdm

from cbagan_ompl import GridMap, Heatmap, attach, plan, reached_planners
from cbagan_ompl.common.files import write_json
from cbagan_ompl.planning import compat
from cbagan_ompl.planning.compat import ompl_version, planner_class
from cbagan_ompl.planning.hooks import hangs_on_python_termination, stops_at_first
from cbagan_ompl.planning.problem import make_setup, set_range
from cbagan_ompl.planning.workspace import Workspace

SIDE, START, GOAL, RANGE = 256, (10.0, 10.0), (240.0, 240.0), 20.0
# Runs end after so many iterations, or seconds where iterations cannot be limited.
MOST, TIME = 20_000, 10.0


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--planners", default=",".join(reached_planners()), metavar="NAMES")
    parser.add_argument("--runs", type=int, default=30, help="of a planner with a heat map")
    parser.add_argument("--time", type=float, default=TIME, help="limit of a run, seconds")
    parser.add_argument("--most", type=int, default=MOST, help="iterations of a run at most")
    parser.add_argument("--json", metavar="FILE")
    args = parser.parse_args()
    grid = two_walls()
    heatmaps = {name: Heatmap(values, grid) for name, values in wrong_values(grid).items()}
    rows: dict[str, dict[str, dict[str, float]]] = {}
    for planner in tqdm(args.planners.split(",")):
        limits = {"time": args.time, "range": RANGE if has_range(planner) else None}
        if not hangs_on_python_termination(planner):
            limits["iterations"] = args.most
        own = measure(grid, planner, args.runs, limits, None)
        rows[planner] = {
            name: compare(measure(grid, planner, args.runs, limits, heatmap), own)
            for name, heatmap in heatmaps.items()
        }
    for planner, by_name in rows.items():
        for name, row in by_name.items():
            print(
                f"{planner:16s} {name:10s} effort x {row['effort_ratio']:5.2f}  solved "
                f"{row['solved']:.0%} (uniform {row['uniform_solved']:.0%}, p {row['p']:.3f})"
            )
    if args.json is not None:
        write_json(args.json, {"ompl": ompl_version(), "runs": args.runs, "planners": rows})


def two_walls() -> GridMap:
    """Return the map: walls with wide gaps, and a pocket that is open to the start's side."""
    free = np.ones((SIDE, SIDE), bool)
    free[80:84, :190] = free[160:164, 60:] = False
    free[20:60, 120] = free[20, 120:180] = free[59, 120:180] = False
    return GridMap(free)


def wrong_values(grid: GridMap) -> dict[str, NDArray[np.float32]]:
    """Return the values of heat maps by name."""
    right = Heatmap.corridor(grid, START, GOAL).values
    pixel = np.zeros(grid.shape, np.float32)
    pixel[250, 5] = 1
    pocket = np.zeros(grid.shape, np.float32)
    pocket[21:59, 121:180] = 1
    hole = np.where(grid.free, 1, 0).astype(np.float32)
    hole[60:184, 40:] = 0
    shifted = np.roll(right, (64, 64), (0, 1))
    return {
        "one pixel": pixel,
        "pocket": pocket,
        "hole": hole,
        "zigzag": zigzag(),
        "inverted": np.where(grid.free, 1 - right, 0).astype(np.float32),
        "shifted": np.where(grid.free, shifted, 0).astype(np.float32),
    }


def zigzag() -> NDArray[np.float32]:
    """Return a region of one pixel's width that joins start and goal in turns of eight pixels."""
    values = np.zeros((SIDE, SIDE), np.float32)
    corners = [(10, 10), (200, 10), (200, 120), (30, 120), (30, 240), (240, 240)]
    for (x0, y0), (x1, y1) in pairwise(corners):
        steps = max(abs(x1 - x0), abs(y1 - y0))
        for step in range(steps + 1):
            x, y = x0 + (x1 - x0) * step // steps, y0 + (y1 - y0) * step // steps
            side = 8 if step // 8 % 2 and 8 < step < steps - 8 else 0
            along_x = y0 == y1
            column, row = (x, y + side) if along_x else (x + side, y)
            values[row, column] = 1
            if step % 8 == 0 and 8 <= step < steps - 8:  # the step to the side
                if along_x:
                    values[y : y + 9, x] = 1
                else:
                    values[y, x : x + 9] = 1
    return values


def has_range(planner: str) -> bool:
    return hasattr(planner_class(planner), "setRange")


def measure(
    grid: GridMap, planner: str, runs: int, limits: dict[str, Any], heatmap: Heatmap | None
) -> list[tuple[float, bool]]:
    """Return (effort, whether it was solved) of each run."""
    if hasattr(planner_class(planner), "bestCost"):
        return [first_path(grid, planner, seed, limits, heatmap) for seed in range(runs)]
    if not stops_at_first(planner) and "iterations" in limits:
        limits = limits | {"iterations": limits["iterations"] // 10}
    how: dict[str, Any] = {"sampler": "uniform"} if heatmap is None else {"heatmap": heatmap}
    done = [plan(grid, START, GOAL, planner, seed=seed, **limits, **how) for seed in range(runs)]
    return [
        (float(run.nodes if run.iterations is None else run.iterations), run.solved) for run in done
    ]


def first_path(
    grid: GridMap, planner: str, seed: int, limits: dict[str, Any], heatmap: Heatmap | None
) -> tuple[float, bool]:
    """Return the iterations of a planner to its first path, after which it would go on."""
    compat.seed_ompl(seed)
    setup = make_setup(Workspace(grid), grid.check_task(START, GOAL), 1.0)
    instance = planner_class(planner)(setup.getSpaceInformation())
    set_range(instance, limits["range"])
    setup.setPlanner(instance)
    attachment = None if heatmap is None else attach(setup, heatmap, seed=seed)
    iterations = 0

    def stop() -> bool:
        nonlocal iterations
        if iterations >= limits["iterations"] or compat.best_cost(instance) < inf:
            return True
        iterations += 1
        return False

    setup.solve(compat.termination_condition(stop))
    solved = compat.best_cost(instance) < inf
    if attachment is not None:
        attachment.detach()
    return float(iterations), solved


def compare(done: list[tuple[float, bool]], own: list[tuple[float, bool]]) -> dict[str, float]:
    """Return the ratio of the efforts, medians, and how many runs were solved."""
    solved, own_solved = (sum(found for _, found in runs) for runs in (done, own))
    table = [[solved, len(done) - solved], [own_solved, len(own) - own_solved]]
    efforts, own_efforts = ([effort for effort, _ in runs] for runs in (done, own))
    return {
        "effort_ratio": float(np.median(efforts) / np.median(own_efforts)),
        "solved": solved / len(done),
        "uniform_solved": own_solved / len(own),
        "p": float(fisher_exact(table, alternative="less").pvalue),
    }


if __name__ == "__main__":
    main()
