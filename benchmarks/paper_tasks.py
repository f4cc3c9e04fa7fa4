"""The paper's test tasks: region scores of a model, and what its samples are worth to a planner.

    python benchmarks/paper_tasks.py DATASET --output benchmarks/results/paper_tasks.json

DATASET is the folder of the published (map, point, ROI) set. All its test tasks are scored; on a
seeded choice of them RRT and RRT* are run with OMPL's own sampler and with the learned one, with
the same parameters and seeds, the two samplers taking turns. Planning time and inference time are
reported apart. Runs that do not reach a target within the limit count as the limit.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import bootstrap
from tqdm import tqdm

from cbagan_ompl import GridMap, Heatmap, Predictor, load_model, plan
from cbagan_ompl.datasets.layout import Tasks, load_dataset
from cbagan_ompl.evaluation.metrics import region_scores
from cbagan_ompl.planning.compat import ompl_version

# Pixels of the 64 x 64 maps. RRT's gives trees of the size that the paper reports.
RANGES = {"RRT": 2.0, "RRTstar": 10.0}
SAMPLERS = ("uniform", "learned")
WITHIN = 1.02


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("dataset", help="folder of the data set")
    parser.add_argument("--model", help="exported model (default: the bundled one)")
    parser.add_argument("--tasks", type=int, default=300, help="tasks to plan (default: 300)")
    parser.add_argument("--runs", type=int, default=5, help="seeds per task (default: 5)")
    parser.add_argument("--time", type=float, default=0.3, help="limit of RRT* (default: 0.3 s)")
    parser.add_argument("--seed", type=int, default=0, help="chooses the tasks (default: 0)")
    parser.add_argument("--output", help="JSON file of the result")
    args = parser.parse_args()

    predictor = load_model(args.model)
    tasks = load_dataset(args.dataset).test
    chosen = np.sort(np.random.default_rng(args.seed).choice(len(tasks), args.tasks, replace=False))
    runs = [plan_task(tasks, i, predictor, args) for i in tqdm(chosen, desc="planning")]
    result = {
        "ompl_version": ompl_version(),
        "model": predictor.record["name"],
        "tasks": args.tasks,
        "runs_per_task": args.runs,
        "time_limit_s": args.time,
        "seed": args.seed,
        "range_px": RANGES,
        "region": score_regions(tasks, predictor),
        "planning": {name: compare(runs, name) for name in runs[0]},
    }
    print(json.dumps(result, indent=2))
    if args.output:
        Path(args.output).parent.mkdir(parents=True, exist_ok=True)
        Path(args.output).write_text(json.dumps(result, indent=2) + "\n", encoding="utf-8")


def ends(tasks: Tasks, i: int) -> tuple[GridMap, NDArray[np.float64], NDArray[np.float64]]:
    grid = GridMap(tasks.maps[tasks.map_of[i]])
    return grid, tasks.start[i].astype(float), tasks.goal[i].astype(float)


def score_regions(tasks: Tasks, predictor: Predictor) -> dict[str, dict[str, float]]:
    """Scores on the ROI class over all tasks, next to the predictors that know nothing."""
    predicted = {
        name: np.zeros(tasks.region.shape, bool) for name in ("model", "straight line", "all free")
    }
    for i in tqdm(range(len(tasks)), desc="scoring"):
        grid, start, goal = ends(tasks, i)
        predicted["model"][i] = predictor.predict(grid, start, goal, repair=False).region
        predicted["straight line"][i] = Heatmap.straight_line(grid, start, goal).region
        predicted["all free"][i] = grid.free
    free = tasks.maps[tasks.map_of].astype(bool)
    truth = tasks.region.astype(bool)
    return {
        name: region_scores(regions, truth, free, tasks.start, tasks.goal)
        for name, regions in predicted.items()
    }


def plan_task(
    tasks: Tasks, i: int, predictor: Predictor, args: argparse.Namespace
) -> dict[str, dict[str, float]]:
    """Median over the runs of each measure, for each sampler."""
    grid, start, goal = ends(tasks, i)
    measured: dict[str, dict[str, list[float]]] = {}

    def note(measure: str, sampler: str, value: float) -> None:
        measured.setdefault(measure, {}).setdefault(sampler, []).append(value)

    optimising: dict[str, list[Any]] = {sampler: [] for sampler in SAMPLERS}
    for seed in range(args.runs):
        for sampler in SAMPLERS:
            common: dict[str, Any] = {"sampler": sampler, "seed": seed, "goal_tolerance": 0.0}
            if sampler == "learned":
                common["model"] = predictor
            first = plan(grid, start, goal, "RRT", time=2, range=RANGES["RRT"], **common)
            note("RRT nodes", sampler, first.nodes)
            note("RRT iterations", sampler, first.iterations)
            note("RRT planning, s", sampler, first.planning_s)
            note("RRT solved", sampler, first.solved)
            note("inference, s", sampler, first.inference_s)
            best = plan(
                grid, start, goal, "RRTstar", time=args.time, range=RANGES["RRTstar"], **common
            )
            note("RRT* solved", sampler, best.solved)
            optimising[sampler].append(best)
    oracle = plan(
        grid, start, goal, "RRTstar", "corridor", args.time, range=RANGES["RRTstar"],
        seed=0, goal_tolerance=0.0,
    )  # fmt: skip
    best_known = min(run.cost for run in [oracle, *optimising["uniform"], *optimising["learned"]])
    for sampler, results in optimising.items():
        for run in results:
            good = run.progress[run.progress[:, 1] <= WITHIN * best_known, 0]
            reached = float(good[0]) if run.solved and len(good) else args.time
            note("RRT* planning to 2 % of best known, s", sampler, reached)
            note("RRT* total to 2 % of best known, s", sampler, reached + run.inference_s)
    return {
        measure: {
            sampler: float(np.mean(values) if "solved" in measure else np.median(values))
            for sampler, values in by_sampler.items()
        }
        for measure, by_sampler in measured.items()
    }


def compare(runs: list[dict[str, dict[str, float]]], measure: str) -> dict[str, Any]:
    """A measure over the tasks, learned against uniform."""
    uniform, learned = (np.array([run[measure][sampler] for run in runs]) for sampler in SAMPLERS)
    if "solved" in measure:
        return {"uniform": uniform.mean(), "learned": learned.mean()}
    summary = {"uniform": float(np.median(uniform)), "learned": float(np.median(learned))}
    if not uniform.all():
        return summary
    summary["learned/uniform, median over tasks"] = interval(learned / uniform)
    summary["learned/uniform, of the medians"] = summary["learned"] / summary["uniform"]
    return summary


def interval(ratios: NDArray[np.float64]) -> dict[str, float]:
    """Median with its bootstrap 95 % interval over the tasks."""
    spread = bootstrap((ratios,), np.median, n_resamples=2000, rng=0, method="percentile")
    return {
        "median": float(np.median(ratios)),
        "low": float(spread.confidence_interval.low),
        "high": float(spread.confidence_interval.high),
    }


if __name__ == "__main__":
    main()
