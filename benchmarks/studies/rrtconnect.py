"""RRTConnect, then simplification, with learned samples and with OMPL's own.

    python benchmarks/studies/rrtconnect.py MAPS/png/*.png --tasks MAPS/tasks.csv \
        --json benchmarks/results/rrtconnect_ompl_2.0.1.json

Planning alone, without inference, to the first path; the length after OMPL's path simplifier, in
multiples of the task's optimal cost. The samplers take turns, with two termination conditions: a
function in Python, as `plan` has it, and OMPL's own, as in `setup.solve(2.0)`. With a limit of a
second or more OMPL waits for a thread of its own at the end, which adds up to 20 ms to each solve;
processor time does not count that wait. Without maps the tasks are synthetic ones, on maps that are
generated as those of training, with other seeds; on them constants are chosen.
"""

from __future__ import annotations

import argparse
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from math import inf
from time import perf_counter, thread_time
from typing import Any

import numpy as np
from ompl import geometric as og
from ompl import util as ou
from tqdm import tqdm

from cbagan_ompl import GridMap, Heatmap, attach, load_model
from cbagan_ompl.benchmarking.intervals import ratio_interval
from cbagan_ompl.benchmarking.tasks import BenchmarkTask, select_tasks
from cbagan_ompl.common.files import write_json
from cbagan_ompl.datasets.geodesic import distance_field
from cbagan_ompl.datasets.synthetic import SyntheticSettings, generate_map_tasks
from cbagan_ompl.maps.tasks import Task
from cbagan_ompl.planning import compat
from cbagan_ompl.planning.problem import make_setup, set_range
from cbagan_ompl.planning.workspace import Workspace
from cbagan_ompl.sampling.options import NO_ADAPTATION

# None is OMPL's choice, a fifth of the diagonal.
RANGES, TIME = {"20 px": 20.0, "OMPL's choice": None}, 2.0
CONDITIONS = ("in Python", "OMPL's own")
SAMPLERS: dict[str, dict[str, Any] | None] = {
    "uniform": None,
    "learned": {},
    "learned, without adaptation": {"adaptation": NO_ADAPTATION},
}
# Training uses part 0, validation and test parts 1 and 2, the study of the sharpness part 3.
PART = 4


@dataclass(frozen=True)
class Run:
    """One solve: seconds of the clock and of the processor, and what came of it."""

    clock_s: float
    processor_s: float
    simplified: float
    iterations: int
    samples: int


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("maps", nargs="*", metavar="MAP")
    parser.add_argument("--tasks", metavar="FILE")
    parser.add_argument("--tasks-per-map", type=int, metavar="N")
    parser.add_argument("--synthetic", type=int, default=60, help="tasks where no maps are given")
    parser.add_argument("--model", metavar="FILE")
    parser.add_argument("--runs", type=int, default=5, help="of each sampler on each task")
    parser.add_argument("--sharpness", type=float, help="of the learned samples")
    parser.add_argument("--json", metavar="FILE")
    args = parser.parse_args()
    if args.maps:
        tasks = select_tasks(args.maps, args.tasks, args.tasks_per_map).tasks
    else:
        tasks = synthetic_tasks(args.synthetic)
    ou.setLogLevel(ou.LOG_ERROR)
    runs = plan_all(tasks, load_model(args.model), args.runs, args.sharpness)
    costs = np.array([one.task.optimal_cost or np.nan for one in tasks])[:, None]
    rows = {
        length: {
            condition: {
                sampler: summarize(done, by_sampler["uniform"], costs)
                for sampler, done in by_sampler.items()
            }
            for condition, by_sampler in by_condition.items()
        }
        for length, by_condition in runs.items()
    }
    result = {"ompl": compat.ompl_version(), "tasks": len(tasks), "runs": args.runs, "ranges": rows}
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
    tasks: Sequence[BenchmarkTask], predictor: Any, runs: int, sharpness: float | None
) -> dict[str, dict[str, dict[str, list[list[Run]]]]]:
    """Return the runs of each task, by range, condition and sampler."""
    done: Any = defaultdict(lambda: defaultdict(lambda: defaultdict(list)))
    for one in tqdm(tasks):
        heatmap = predictor.predict(one.grid, *one.grid.check_task(one.task.start, one.task.goal))
        for name, length in RANGES.items():
            for condition in CONDITIONS:
                own: dict[str, list[Run]] = defaultdict(list)
                for seed in range(runs):
                    for sampler, changes in SAMPLERS.items():
                        options = None if changes is None else {"sharpness": sharpness, **changes}
                        own[sampler].append(solve(one, heatmap, options, condition, length, seed))
                for sampler, results in own.items():
                    done[name][condition][sampler].append(results)
    return done  # type: ignore[no-any-return]


def solve(
    one: BenchmarkTask,
    heatmap: Heatmap,
    options: dict[str, Any] | None,
    condition: str,
    length: float | None,
    seed: int,
) -> Run:
    """Plan once; with OMPL's own sampler where there are no options."""
    compat.seed_ompl(seed)
    setup = make_setup(one.workspace, one.grid.check_task(one.task.start, one.task.goal), 1.0)
    setup.setPlanner(og.RRTConnect(setup.getSpaceInformation()))
    if length is not None:
        set_range(setup.getPlanner(), length)
    setup.setup()
    attachment = None if options is None else attach(setup, heatmap, seed=seed, **options)
    iterations = 0
    until = inf

    def stop() -> bool:
        nonlocal iterations
        iterations += 1
        return perf_counter() > until

    limit = TIME if condition == "OMPL's own" else compat.termination_condition(stop)
    began, worked = perf_counter(), thread_time()
    until = began + TIME
    status = setup.solve(limit)
    clock_s, processor_s = perf_counter() - began, thread_time() - worked
    samples = 0 if attachment is None else sum(attachment.sample_counts.values())
    if attachment is not None:
        attachment.force_detach()
    if not compat.is_exact(status):
        return Run(TIME, TIME, inf, iterations, samples)
    setup.simplifySolution()
    return Run(clock_s, processor_s, setup.getSolutionPath().length(), iterations, samples)


def summarize(done: list[list[Run]], own: list[list[Run]], costs: np.ndarray) -> dict[str, Any]:
    """Return the figures of a sampler; ratios are medians over tasks of medians over runs."""
    lengths = values_of(done, "simplified") / costs
    row: dict[str, Any] = {"solved": float(np.isfinite(values_of(done, "simplified")).mean())}
    for name in ("clock_s", "processor_s", "iterations"):
        values, baseline = values_of(done, name), values_of(own, name)
        scale, unit = (1e3, name.replace("_s", "_ms")) if name.endswith("_s") else (1, name)
        row[unit] = scale * float(np.median(values))
        row[f"{unit}_p90"] = scale * float(np.percentile(values, 90))
        interval = ratio_interval(list(values), list(baseline))
        row[f"{name.removesuffix('_s')}_ratio"] = [interval.median, interval.low, interval.high]
    row["our_samples"] = float(np.median(values_of(done, "samples")))
    row["simplified_length"] = float(np.median(lengths))
    row["simplified_length_p90"] = float(np.percentile(lengths, 90, method="lower"))
    return row


def values_of(done: list[list[Run]], name: str) -> np.ndarray:
    return np.array([[float(getattr(run, name)) for run in runs] for runs in done])


def print_result(result: dict[str, Any]) -> None:
    for length, by_condition in result["ranges"].items():
        for condition, rows in by_condition.items():
            print(f"\nrange {length}, condition {condition}:")
            for sampler, row in rows.items():
                shown = {name: np.round(value, 3).tolist() for name, value in row.items()}
                print(f"  {sampler:28s}", shown)


if __name__ == "__main__":
    main()
