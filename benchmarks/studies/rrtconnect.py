"""RRTConnect, then simplification, with learned samples and with OMPL's own.

    python benchmarks/studies/rrtconnect.py MAPS/png/*.png --tasks MAPS/tasks.csv \
        --json benchmarks/results/rrtconnect_ompl_2.0.1.json

Planning alone, without inference, to the first path; the length after OMPL's path simplifier, in
multiples of the task's optimal cost. Both samplers run in turns, with a termination condition in
Python: with one of OMPL's own, a limit of a second or more adds up to 20 ms to each run, because
OMPL then waits for a thread of its own. Without maps the tasks are synthetic ones, on maps that are
generated as those of training, with other seeds; on them constants are chosen.
"""

from __future__ import annotations

import argparse
from collections import defaultdict
from typing import Any

import numpy as np
from tqdm import tqdm

from cbagan_ompl import GridMap, PlanResult, load_model, plan
from cbagan_ompl.benchmarking.tasks import BenchmarkTask, select_tasks
from cbagan_ompl.common.files import write_json
from cbagan_ompl.datasets.geodesic import distance_field
from cbagan_ompl.datasets.synthetic import SyntheticSettings, generate_map_tasks
from cbagan_ompl.maps.tasks import Task
from cbagan_ompl.planning.compat import ompl_version
from cbagan_ompl.planning.workspace import Workspace
from cbagan_ompl.sampling.options import NO_ADAPTATION

# None is OMPL's choice, a fifth of the diagonal.
RANGES, TIME = {"20 px": 20.0, "OMPL's choice": None}, 2.0
SAMPLERS: dict[str, dict[str, Any]] = {
    "uniform": {},
    "learned": {},
    "learned, without adaptation": {"adaptation": NO_ADAPTATION},
}
# Training uses part 0, validation and test parts 1 and 2, the study of the sharpness part 3.
PART = 4


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("maps", nargs="*", metavar="MAP")
    parser.add_argument("--tasks", metavar="FILE")
    parser.add_argument("--synthetic", type=int, default=60, help="tasks where no maps are given")
    parser.add_argument("--model", metavar="FILE")
    parser.add_argument("--runs", type=int, default=5, help="of each sampler on each task")
    parser.add_argument("--sharpness", type=float, help="of the learned samples")
    parser.add_argument("--json", metavar="FILE")
    args = parser.parse_args()
    tasks = (
        select_tasks(args.maps, args.tasks).tasks if args.maps else synthetic_tasks(args.synthetic)
    )
    runs = plan_all(tasks, load_model(args.model), args.runs, args.sharpness)
    costs = np.array([one.task.optimal_cost or np.nan for one in tasks])[:, None]
    result: dict[str, Any] = {"ompl": ompl_version(), "tasks": len(tasks), "runs": args.runs}
    result["ranges"] = {
        range: {sampler: summarize(done, own["uniform"], costs) for sampler, done in own.items()}
        for range, own in runs.items()
    }
    print_result(result)
    if args.json is not None:
        write_json(args.json, result)


def synthetic_tasks(count: int) -> list[BenchmarkTask]:
    """Return one task on each of as many generated maps."""
    tasks = []
    for number in range(count):
        synthetic = generate_map_tasks(SyntheticSettings(), PART, number)
        grid, start, goal = GridMap(synthetic.maps[0]), synthetic.start[0], synthetic.goal[0]
        (u, v), (x, y) = start.astype(int).tolist(), goal.astype(int).tolist()
        optimum = float(distance_field(grid.free, (u, v))[y, x])
        tasks.append(BenchmarkTask(Workspace(grid), number, Task(start, goal, optimum)))
    return tasks


def plan_all(
    tasks: list[BenchmarkTask], predictor: Any, runs: int, sharpness: float | None
) -> dict[str, dict[str, list[list[PlanResult]]]]:
    """Return the runs of each task, by range and sampler."""
    done: dict[str, dict[str, list[list[PlanResult]]]] = defaultdict(lambda: defaultdict(list))
    for one in tqdm(tasks):
        start, goal = one.grid.check_task(one.task.start, one.task.goal)
        heatmap = predictor.predict(one.grid, start, goal)
        for name, length in RANGES.items():
            own: dict[str, list[PlanResult]] = defaultdict(list)
            for seed in range(runs):
                for sampler, changes in SAMPLERS.items():
                    how = {"sampler": "uniform"}
                    if sampler != "uniform":
                        how = {"heatmap": heatmap, "sharpness": sharpness, **changes}
                    limits = {"range": length, "time": TIME, "simplify": True, "seed": seed}
                    own[sampler].append(plan(one.grid, start, goal, "RRTConnect", **limits, **how))
            for sampler, results in own.items():
                done[name][sampler].append(results)
    return done


def summarize(
    done: list[list[PlanResult]], own: list[list[PlanResult]], costs: np.ndarray
) -> dict[str, float]:
    """Return the figures of a sampler; ratios are medians over tasks of medians over runs."""
    times, iterations = first_paths(done)
    own_times, own_iterations = first_paths(own)
    lengths = np.array([[run.cost for run in runs] for runs in done]) / costs
    samples = [[sum(run.sample_counts.values()) for run in runs] for runs in done]
    return {
        "solved": float(np.isfinite(lengths).mean()),
        "planning_ms": 1e3 * float(np.median(times)),
        "planning_ms_p90": 1e3 * float(np.percentile(times, 90)),
        "planning_ratio": ratio(times, own_times),
        "iterations": float(np.median(iterations)),
        "iterations_p90": float(np.percentile(iterations, 90)),
        "iterations_ratio": ratio(iterations, own_iterations),
        "our_samples": float(np.median(samples)),
        "simplified_length": float(np.median(lengths)),
        "simplified_length_p90": float(np.percentile(lengths, 90, method="lower")),
    }


def first_paths(done: list[list[PlanResult]]) -> tuple[np.ndarray, np.ndarray]:
    """Return seconds and iterations to the first path; a run without one counts with its limit."""
    times = [[run.planning_s if run.solved else TIME for run in runs] for runs in done]
    return np.array(times), np.array([[run.iterations for run in runs] for runs in done])


def ratio(values: np.ndarray, own: np.ndarray) -> float:
    return float(np.median(np.median(values, axis=1) / np.median(own, axis=1)))


def print_result(result: dict[str, Any]) -> None:
    for range, rows in result["ranges"].items():
        print(f"\nrange {range}:")
        for sampler, row in rows.items():
            print(f"  {sampler:28s}", {name: round(value, 3) for name, value in row.items()})


if __name__ == "__main__":
    main()
