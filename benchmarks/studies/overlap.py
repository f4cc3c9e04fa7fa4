"""Overlapped inference: the first path with the heat map made meanwhile, or waited for, or none.

    python benchmarks/studies/overlap.py --json overlap_bundled.json
    python benchmarks/studies/overlap.py MAPS/png/*.png --tasks MAPS/tasks.csv --json FILE

Seconds from the beginning to the first path, inference counted, in turns: by the clock, and of the
processor in the planner's thread, which on a busy machine says how much longer the planner plans,
but not how long it waits for the other thread. A ratio is that of the medians over the runs of a
task to OMPL's own sampler; shown is the median over the tasks, with a bootstrap interval over maps.
Runs that are in ``--rows`` are not done again, and after ``--seconds`` the script ends with what
there is: on a machine that others use, call it again. With ``taskset -c 0`` it says what a single
core makes of it.
"""

from __future__ import annotations

import argparse
import json
import os
from collections import defaultdict
from functools import partial
from pathlib import Path
from time import perf_counter, thread_time
from typing import Any

import numpy as np

from cbagan_ompl import attach, bundled_maps, load_model
from cbagan_ompl.benchmarking.tasks import BenchmarkTask, select_tasks
from cbagan_ompl.common.files import write_json
from cbagan_ompl.evaluation.bootstrap import bootstrap_weights
from cbagan_ompl.planning import compat
from cbagan_ompl.planning.overlapping import Prediction, can_overlap
from cbagan_ompl.planning.problem import make_setup

LIMIT, RANGE, TOLERANCE = 2.0, 20.0, 1.0
PLANNERS = ("RRT", "RRTConnect")
WAYS = ["uniform", "waiting", "overlap"]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("maps", nargs="*", metavar="MAP", help="default: the bundled ones")
    parser.add_argument("--tasks", metavar="FILE")
    parser.add_argument("--tasks-per-map", type=int, default=2)
    parser.add_argument("--runs", type=int, default=5)
    parser.add_argument("--seconds", type=float, default=float("inf"), help="end after these")
    parser.add_argument("--rows", metavar="FILE", default="overlap.jsonl")
    parser.add_argument("--json", metavar="FILE")
    args = parser.parse_args()
    end = perf_counter() + args.seconds
    maps = args.maps or [f"bundled:{name}" for name in bundled_maps()]
    tasks = select_tasks(maps, args.tasks, args.tasks_per_map).tasks
    rows = Path(args.rows)
    done = [json.loads(line) for line in rows.read_text().splitlines()] if rows.exists() else []
    known = {tuple(row["key"]) for row in done}
    model = load_model()
    for seed in range(args.runs):
        for task in tasks:
            for planner in PLANNERS:
                key = (planner, task.grid.name, task.number, seed)
                if key not in known and perf_counter() < end:
                    done.append({"key": key, **measure(task, planner, seed, model)})
                    with rows.open("a") as file:
                        file.write(json.dumps(done[-1]) + "\n")
    summary = summarise(done)
    for line in summary:
        print(line)
    if args.json is not None:
        settings = {
            "ompl": compat.ompl_version(),
            "limit": LIMIT,
            "tasks": len(tasks),
            "runs": args.runs,
        }
        settings |= {"cores": len(os.sched_getaffinity(0)), "overlapped": can_overlap()}
        write_json(args.json, {**settings, "rows": summary})


def measure(task: BenchmarkTask, planner: str, seed: int, model: Any) -> dict[str, Any]:
    """Return the seconds to the first path of each way, and when the heat map came."""
    result: dict[str, Any] = {"load": round(os.getloadavg()[0], 1)}
    for way in WAYS[seed % 3 :] + WAYS[: seed % 3]:
        result[way] = first_path(task, planner, way, seed, model)
    return result


def first_path(
    task: BenchmarkTask, planner: str, way: str, seed: int, model: Any
) -> dict[str, float | None]:
    """Return the seconds to the first path, by the clock and of the planner's thread."""
    endpoints = task.grid.check_task(task.task.start, task.task.goal)
    compat.seed_ompl(seed)
    setup = make_setup(task.workspace, endpoints, TOLERANCE)
    setup.setPlanner(compat.planner_class(planner)(setup.getSpaceInformation()))
    setup.getPlanner().setRange(RANGE)
    setup.setup()
    began, thread_began = perf_counter(), thread_time()
    predict = partial(model.predict, task.grid, *endpoints)
    attachment, prediction = None, None
    if way == "overlap":
        prediction = Prediction(predict)
        attachment = attach(setup, prediction.future, seed=seed)
        prediction.start()
    elif way == "waiting":
        attachment = attach(setup, predict(), seed=seed)
    end = thread_began + LIMIT
    status = setup.solve(compat.termination_condition(lambda: thread_time() >= end))
    clock, processor = perf_counter() - began, thread_time() - thread_began
    arrival = None if attachment is None or prediction is None else attachment.arrival_s
    if prediction is not None:
        prediction.wait()
    if attachment is not None:
        attachment.detach()
    is_solved = compat.is_exact(status)
    times = {"clock": clock, "processor": processor}
    return {"arrival": arrival, **{k: v if is_solved else None for k, v in times.items()}}


def summarise(done: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return medians in ms and ratios to OMPL's own sampler, with intervals, for each planner."""
    summary = []
    for planner in PLANNERS:
        tasks = defaultdict(list)
        for row in done:
            if row["key"][0] == planner:
                tasks[tuple(row["key"][1:3])].append(row)
        names = sorted({name for name, _ in tasks})
        weights = bootstrap_weights(np.array([names.index(name) for name, _ in tasks]), seed=0)
        runs = [row for rows in tasks.values() for row in rows]
        for way in WAYS:
            arrivals = [row[way]["arrival"] for row in runs if row[way]["arrival"] is not None]
            line: dict[str, Any] = {"planner": planner, "way": way, "runs": len(runs)}
            line["solved"] = float(np.mean([row[way]["clock"] is not None for row in runs]))
            line["load"] = float(np.median([row["load"] for row in runs]))
            line["arrival_ms"] = 1e3 * float(np.median(arrivals)) if arrivals else None
            for measure in ("clock", "processor"):
                times, own = (medians(tasks, of, measure) for of in (way, "uniform"))
                ratios = times / own
                resampled = [np.median(np.repeat(ratios, n)) for n in weights.astype(int)]
                interval = (np.median(ratios), *np.percentile(resampled, (2.5, 97.5)))
                line[f"{measure}_ms"] = 1e3 * float(np.median(times))
                line[f"{measure}_ratio"] = [float(value) for value in interval]
            summary.append({name: rounded(value) for name, value in line.items()})
    return summary


def medians(tasks: dict[Any, list[dict[str, Any]]], way: str, measure: str) -> Any:
    """Return the median over the runs of each task; a run without a path counts with the limit."""
    times = ([row[way][measure] or LIMIT for row in runs] for runs in tasks.values())
    return np.array([np.median(runs) for runs in times])


def rounded(value: Any) -> Any:
    if isinstance(value, list):
        return [rounded(one) for one in value]
    return round(value, 3) if isinstance(value, float) else value


if __name__ == "__main__":
    main()
