"""The overhead of the benchmark: the speed of RRT* inside of it, relative to outside.

    python scripts/overhead.py --json benchmarks/results/overhead.json

The same task and parameters, once by the runner, with its count of collision checks, its records of
the best cost and OMPL's progress data, and once by a plain SimpleSetup that does as many
iterations: they become slower as the tree grows. Compared is processor time, so that other work on
the machine does not count; what a benchmark takes before and after a run is measured with a short
run and subtracted.
"""

from __future__ import annotations

import argparse
from time import process_time

import numpy as np
from tqdm import trange

from cbagan_ompl import GridMap, SamplerOptions, tasks_of
from cbagan_ompl.benchmarking.logs import parse_log
from cbagan_ompl.common.files import write_json
from cbagan_ompl.planning import compat
from cbagan_ompl.planning.compat import og, ou
from cbagan_ompl.planning.ompl_benchmark import PlannerVariant, RunOptions, run_benchmark
from cbagan_ompl.planning.problem import make_setup
from cbagan_ompl.planning.workspace import Endpoints, Workspace

MAP, RANGE = "bundled:walls_with_gaps", 20.0
# A run that is little more than what is around it, seconds.
_SHORT_S = 0.05


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=15, help="runs of each (default: 15)")
    parser.add_argument("--time", type=float, default=1.0, help="seconds of a run (default: 1)")
    parser.add_argument("--json", metavar="FILE", help="write the figures as JSON")
    args = parser.parse_args()
    grid = GridMap.load(MAP)
    first = tasks_of(MAP, grid)[0]
    task = grid.check_task(first.start, first.goal)
    ratios, rates = [], []
    for seed in trange(args.rounds):
        iterations, seconds = inside(grid, task, args.time, seed)
        few, fixed = inside(grid, task, _SHORT_S, seed)
        plain = outside(grid, task, iterations, seed) - outside(grid, task, few, seed)
        ratios.append(plain / (seconds - fixed))
        rates.append((iterations - few) / (seconds - fixed))
    if args.json:
        figures = {"median": float(np.median(ratios)), "ratios": ratios, "rates": rates}
        write_json(args.json, {"ompl": compat.ompl_version(), **figures})
    print(
        f"OMPL {compat.ompl_version()}: {np.median(rates):.0f} iterations per second inside, "
        f"{np.median(ratios):.3f} of those outside ({np.min(ratios):.3f} to {np.max(ratios):.3f})"
    )


def inside(grid: GridMap, task: Endpoints, time: float, seed: int) -> tuple[int, float]:
    """Return the iterations of a run of the benchmark, and its processor time, seconds."""
    options = RunOptions(1, time, RANGE, grid.resolution, SamplerOptions(seed=seed))
    began = process_time()
    recording = run_benchmark(
        "x", Workspace(grid), task, [PlannerVariant("RRTstar", "uniform", None)], options
    )
    seconds = process_time() - began
    run = parse_log(recording.logs[0]).planners[0].runs[0]
    return int(run["iterations INTEGER"]), seconds


def outside(grid: GridMap, task: Endpoints, iterations: int, seed: int) -> float:
    """Return the processor time of so many iterations, seconds."""
    with compat.log_level(ou.LOG_ERROR):
        compat.seed_ompl(seed)
        setup = make_setup(Workspace(grid), task, grid.resolution)
        planner = og.RRTstar(setup.getSpaceInformation())
        planner.setRange(RANGE)
        setup.setPlanner(planner)
        began = process_time()
        setup.solve(compat.termination_condition(lambda: planner.numIterations() >= iterations))
        return process_time() - began


if __name__ == "__main__":
    main()
