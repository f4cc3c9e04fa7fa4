"""Overlapped inference: the first path with the heat map made meanwhile, or waited for, or none.

    python benchmarks/studies/overlap.py --json overlap_bundled.json
    python benchmarks/studies/overlap.py MAPS/png/*.png --tasks MAPS/tasks.csv --json FILE

Wall-clock seconds from the call of ``plan`` to the first path, inference counted, in turns. A ratio
is that of the medians over the runs of a task to OMPL's own sampler; shown is the median over the
tasks, with a bootstrap interval over maps. Runs that are in ``--rows`` are not done again, and
after ``--seconds`` the script ends with what there is: on a machine that others use, call it again.
With ``taskset -c 0`` it says what a single core makes of it.
"""

from __future__ import annotations

import argparse
import json
import os
from collections import defaultdict
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from cbagan_ompl import bundled_maps, load_model, plan
from cbagan_ompl.benchmarking.tasks import BenchmarkTask, select_tasks
from cbagan_ompl.common.files import write_json
from cbagan_ompl.evaluation.bootstrap import bootstrap_weights
from cbagan_ompl.planning.compat import ompl_version
from cbagan_ompl.planning.overlapping import can_overlap

LIMIT, RANGE = 2.0, 20.0
PLANNERS = ("RRT", "RRTConnect")
WAYS: dict[str, dict[str, Any]] = {
    "uniform": {"sampler": "uniform"},
    "waiting": {},
    "overlap": {"overlap": True},
}


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
        settings = {"ompl": ompl_version(), "limit": LIMIT, "tasks": len(tasks), "runs": args.runs}
        settings |= {"cores": len(os.sched_getaffinity(0)), "overlapped": can_overlap()}
        write_json(args.json, {**settings, "rows": summary})


def measure(task: BenchmarkTask, planner: str, seed: int, model: Any) -> dict[str, Any]:
    """Return the seconds to the first path of each way, and when the heat map came."""
    result: dict[str, Any] = {"load": round(os.getloadavg()[0], 1)}
    ways = list(WAYS.items())
    for name, how in ways[seed % 3 :] + ways[: seed % 3]:
        own = how if "sampler" in how else {"model": model, **how}
        limits = {"time": LIMIT, "range": RANGE, "seed": seed}
        done = plan(task.grid, task.task.start, task.task.goal, planner, **limits, **own)
        result[name] = done.first_solution_total_s
        if done.overlap:
            result["arrival"] = done.heatmap_arrival_s
    return result


def summarise(done: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return medians in ms and ratios to OMPL's own sampler, with intervals, for each planner."""
    summary = []
    for planner in PLANNERS:
        tasks = defaultdict(list)
        for row in done:
            if row["key"][0] == planner:
                tasks[tuple(row["key"][1:3])].append(row)
        names = sorted({name for name, _ in tasks})
        map_of = np.array([names.index(name) for name, _ in tasks])
        weights = bootstrap_weights(map_of, seed=0)
        times = {
            way: np.array(
                [
                    np.median([LIMIT if r[way] is None else r[way] for r in runs])
                    for runs in tasks.values()
                ]
            )
            for way in WAYS
        }
        runs = [row for rows in tasks.values() for row in rows]
        arrivals = [row["arrival"] for row in runs if row.get("arrival") is not None]
        for way in WAYS:
            ratios = times[way] / times["uniform"]
            resampled = [np.median(np.repeat(ratios, counts)) for counts in weights.astype(int)]
            low, high = np.percentile(resampled, (2.5, 97.5))
            summary.append(
                {
                    "planner": planner,
                    "way": way,
                    "runs": len(runs),
                    "solved": round(float(np.mean([row[way] is not None for row in runs])), 3),
                    "first_ms": round(1e3 * float(np.median(times[way])), 2),
                    "ratio": [round(float(x), 3) for x in (np.median(ratios), low, high)],
                    "load": round(float(np.median([row["load"] for row in runs])), 1),
                    "arrival_ms": None
                    if way != "overlap" or not arrivals
                    else round(1e3 * float(np.median(arrivals)), 1),
                }
            )
    return summary


if __name__ == "__main__":
    main()
