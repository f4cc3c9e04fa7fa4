"""The planning columns of the paper's tables: RRT with OMPL's sampler and with those of models.

    python benchmarks/studies/paper_tables.py DATASET --model cbagan=models/cbagan.pt \
        --model sagan=models/sagan.pt --json benchmarks/results/paper_tables.json

DATASET is the folder of the published (map, point, ROI) set. First RRT runs many times on three
tasks: of the first three of the ten original maps (maps 0, 10 and 20) the first task in test.csv
whose straight line is blocked. Then it runs once on every test task. The samplers take turns, with
the same parameters and seeds: OMPL's own, and each model with the adaptation and, as the paper
samples, without. Planning times exclude inference, which is given apart.
"""

from __future__ import annotations

import argparse
from typing import Any

import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

from cbagan_ompl import Adaptation, GridMap, Predictor, load_model, plan
from cbagan_ompl.common.files import write_json
from cbagan_ompl.datasets.dataset import Dataset, Tasks, load_dataset
from cbagan_ompl.planning.compat import ompl_version

# The paper gives a step of 0.2 and no unit. Two pixels of the 64 give trees of the size it reports.
RANGE = 2.0
ITERATIONS = 5000  # the paper's
COPIES = 10  # maps from each original
MEASURES = ("nodes", "planning_ms", "inference_ms", "total_ms")

PLAIN = ", not adapted"

Runs = dict[str, NDArray[np.float64]]
Samplers = dict[str, dict[str, Any]]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("dataset", metavar="DATASET")
    parser.add_argument("--model", action="append", required=True, metavar="NAME=FILE")
    parser.add_argument("--runs", type=int, default=100, help="on each of the three tasks")
    parser.add_argument("--tasks", type=int, help="only so many of the test tasks")
    parser.add_argument("--json", metavar="FILE")
    args = parser.parse_args()
    models = dict(text.split("=", 1) for text in args.model)
    samplers: Samplers = {"uniform": {"sampler": "uniform"}}
    for name, file in models.items():
        samplers |= samplers_of(name, load_model(file))
    dataset = load_dataset(args.dataset)
    tasks = dataset.test

    result: dict[str, Any] = {
        "ompl": ompl_version(),
        "range_px": RANGE,
        "iterations": ITERATIONS,
        "runs": args.runs,
        "maps": {},
    }
    for i in three_tasks(dataset):
        jobs = [(i, seed) for seed in range(args.runs)]
        name = f"map {dataset.map_numbers[tasks.map_of[i]]}, test task {i}"
        result["maps"][name] = summary(run_all(tasks, jobs, samplers))
    jobs = [(i, i) for i in range(len(tasks))[: args.tasks]]
    result["all_test_tasks"] = {"tasks": len(jobs), **summary(run_all(tasks, jobs, samplers))}
    print_tables(result)
    if args.json is not None:
        write_json(args.json, result)


def three_tasks(dataset: Dataset) -> list[int]:
    """Return the numbers of the three test tasks that the rule above chooses."""
    tasks, chosen = dataset.test, []
    for original in range(3):
        of_map = np.flatnonzero(np.array(dataset.map_numbers)[tasks.map_of] == original * COPIES)
        blocked = (i for i in of_map.tolist() if not straight_line_is_free(tasks, i))
        chosen.append(next(blocked))
    return chosen


def straight_line_is_free(tasks: Tasks, i: int) -> bool:
    endpoints = np.stack((tasks.start[i], tasks.goal[i])).astype(np.float64)
    return GridMap(tasks.free[i]).path_is_free(endpoints)


def samplers_of(name: str, model: Predictor) -> Samplers:
    """Return the samplers of a model, with the adaptation and, as the paper samples, without."""
    return {
        name: {"model": model},
        f"{name}{PLAIN}": {"model": model, "adaptation": Adaptation.of(())},
    }


def run_all(tasks: Tasks, jobs: list[tuple[int, int]], samplers: Samplers) -> dict[str, Runs]:
    """Return the measures of every sampler for every (task, seed), shape (jobs,).

    Runs without a path have NaN.

    Args:
        tasks: of the data set.
        jobs: numbers of tasks, with seeds.
        samplers: arguments of ``plan``, by the names of the rows.
    """
    rows: dict[str, list[list[float]]] = {name: [] for name in samplers}
    names = list(samplers)
    grids = {i: GridMap(tasks.free[i]) for i, _ in jobs}
    for turn, (i, seed) in enumerate(tqdm(jobs)):
        first = turn % len(names)
        for name in names[first:] + names[:first]:
            run = plan(
                grids[i],
                tasks.start[i],
                tasks.goal[i],
                planner="RRT",
                range=RANGE,
                iterations=ITERATIONS,
                time=10,
                seed=seed,
                **samplers[name],
            )
            seconds = (run.planning_s, run.inference_s, run.total_s)
            row = [run.nodes, *(1000 * s for s in seconds)]
            rows[name].append(row if run.solved else [np.nan] * len(row))
    return {
        name: dict(zip(MEASURES, np.array(values).T, strict=True)) for name, values in rows.items()
    }


def summary(runs: dict[str, Runs]) -> dict[str, Any]:
    """Return medians, and median ratios to the uniform sampler, with bootstrap 95 % intervals."""
    return {
        name: {
            "solved": float(np.isfinite(values["nodes"]).mean()),
            **{measure: interval(values[measure]) for measure in MEASURES},
            "nodes_ratio": interval(values["nodes"] / runs["uniform"]["nodes"]),
        }
        for name, values in runs.items()
    }


def interval(values: NDArray[np.float64]) -> list[float]:
    """Return the median and its 95 % interval; runs without a path count as infinite."""
    values = np.where(np.isfinite(values), values, np.inf)
    rng = np.random.default_rng(0)
    resamples = np.median(values[rng.integers(len(values), size=(1000, len(values)))], axis=1)
    return [float(np.median(values)), *np.percentile(resamples, (2.5, 97.5)).tolist()]


def print_tables(result: dict[str, Any]) -> None:
    for name, samplers in [*result["maps"].items(), ("all test tasks", result["all_test_tasks"])]:
        print(f"\n{name}\n\n| sampler | nodes | nodes / uniform | planning | inference | solved |")
        print("|---|---|---|---|---|---|")
        for sampler, values in samplers.items():
            if isinstance(values, dict):
                cells = [cell(values["nodes"], 0), cell(values["nodes_ratio"], 2)]
                cells += [
                    cell(values[f"{what}_ms"], 1, " ms") for what in ("planning", "inference")
                ]
                print(f"| {sampler} | {' | '.join(cells)} | {values['solved']:.1%} |")


def cell(values: list[float], digits: int, unit: str = "") -> str:
    middle, low, high = (f"{value:.{digits}f}" for value in values)
    return f"{middle}{unit} [{low}, {high}]"


if __name__ == "__main__":
    main()
