"""What heat maps that are wrong on purpose cost robots with heading, on generated maps.

    python benchmarks/studies/wrong_poses.py --rows wrong_poses.jsonl --json wrong_poses.json

The tasks, and the rectangle of 12 x 6 pixels, are those of ``headings.py``. The heat map is that of
the network; mirrored or shifted by a quarter; its opposite; noise; a single pixel; and itself with
all headings turned by pi or by a right angle. Times are seconds of one thread's CPU until the first
path, without the heat map; a run without a path in time counts as the limit. The ratio to OMPL's
own sampler is the geometric mean over the runs, each compared with the run of OMPL's own sampler
that has the same task and seed, with a bootstrap interval of 95 % over tasks. Tasks that nothing
solves in a space are left out. Each run is a line of ``--rows`` as soon as it has ended; a run that
is there already is not done again.
"""

from __future__ import annotations

import argparse
from collections import defaultdict
from itertools import product
from math import pi
from typing import Any

import numpy as np
from pose_runs import PoseTask, generated_tasks, seeded_setup, solve
from run_rows import RunRows

from cbagan_ompl import Heatmap, Predictor, attach, load_model
from cbagan_ompl.common.files import write_json
from cbagan_ompl.evaluation.bootstrap import percentile_interval
from cbagan_ompl.planning import compat
from cbagan_ompl.planning.compat import ou

OWN, RIGHT = "OMPL's own sampler", "right"
KINDS = (
    OWN,
    RIGHT,
    "mirrored",
    "shifted by a quarter",
    "inverted",
    "noise",
    "one pixel",
    "headings turned by pi",
    "headings turned by pi / 2",
)
ROBOTS = ("SE2", "Dubins 10", "Reeds-Shepp 10")
PLANNERS = ("RRTstar", "RRT")
RESAMPLES = 1000

Key = tuple[str, str, str, int, int]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=20, help="tasks")
    parser.add_argument("--seeds", type=int, default=2, help="runs of each task")
    parser.add_argument("--time", type=float, default=2.0, help="CPU seconds of a run")
    parser.add_argument("--rows", metavar="FILE", default="wrong_poses.jsonl")
    parser.add_argument("--json", metavar="FILE")
    args = parser.parse_args()
    ou.setLogLevel(ou.LOG_NONE)
    predictor = load_model()
    done = RunRows(args.rows)
    tasks = list(generated_tasks(args.count))
    runs = product(range(args.seeds), range(len(tasks)), ROBOTS, PLANNERS, KINDS)
    for seed, number, space, planner, kind in runs:
        key = space, planner, kind, number, seed
        if key not in done.keys:
            done.add(key, {"first": measure(tasks[number], key, predictor, args.time)})
    summary = summarise({tuple(row["key"]): row["first"] for row in done.rows}, args.time)
    for row in summary:
        print(row)
    if args.json is not None:
        head = {"ompl": compat.ompl_version(), "time": args.time, "tasks": args.count}
        write_json(args.json, head | {"seeds": args.seeds, "rows": summary})


def measure(task: PoseTask, key: Key, predictor: Predictor, limit: float) -> float | None:
    """Return the seconds until the first path; None without one."""
    space, planner, kind, number, repetition = key
    seed = number + 1000 * repetition
    robot, setup = seeded_setup(task, space, planner, seed)
    if kind == OWN:
        costs = solve(setup, limit, True)
    else:
        right = predictor.predict(task.grid, task.start, task.goal, robot=robot)
        with attach(setup, spoil(right.directed(task.goal[:2]), kind, seed), seed=seed):
            costs = solve(setup, limit, True)
    return costs[0][0] if costs else None


def spoil(right: Heatmap, kind: str, seed: int) -> Heatmap:
    """Return a heat map that is wrong in the way that a kind names."""
    if kind == RIGHT:
        return right
    if kind.startswith("headings"):
        assert right.heading is not None
        return right.with_heading(right.heading + (pi / 2 if kind.endswith("2") else pi))
    free, values = right.grid.free, right.values
    if kind == "mirrored":
        wrong = values[::-1, ::-1]
    elif kind == "shifted by a quarter":
        wrong = np.roll(values, (free.shape[0] // 4, free.shape[1] // 4), (0, 1))
    elif kind == "inverted":
        wrong = values.max() - values
    elif kind == "noise":
        wrong = np.random.default_rng(seed).random(free.shape)
    else:
        wrong = np.zeros(free.shape)
        wrong.ravel()[np.random.default_rng(seed).choice(np.flatnonzero(free))] = 1
    return Heatmap(np.where(free, np.maximum(wrong, 1e-6 * (kind != "one pixel")), 0), right.grid)


def summarise(times: dict[Key, float | None], limit: float) -> list[dict[str, Any]]:
    """Return success and the ratio of times to OMPL's own sampler, by robot, planner and kind."""
    feasible = {(space, number) for (space, _, _, number, _), first in times.items() if first}
    ratios: dict[tuple[str, str, str], dict[int, list[float]]] = defaultdict(
        lambda: defaultdict(list)
    )
    solved: dict[tuple[str, str, str], list[bool]] = defaultdict(list)
    for (space, planner, kind, number, seed), first in times.items():
        if (space, number) in feasible:
            own = times[space, planner, OWN, number, seed] or limit
            ratios[space, planner, kind][number].append(np.log((first or limit) / own))
            solved[space, planner, kind].append(first is not None)
    return [
        {"space": key[0], "planner": key[1], "heatmap": key[2], "runs": len(solved[key])}
        | {"solved": round(float(np.mean(solved[key])), 3), "ratio": interval(by_task)}
        for key, by_task in ratios.items()
    ]


def interval(by_task: dict[int, list[float]]) -> list[float]:
    """Return the geometric mean of ratios, and its bootstrap interval of 95 % over tasks."""
    means = np.array([np.mean(logs) for logs in by_task.values()])
    picks = np.random.default_rng(0).integers(len(means), size=(RESAMPLES, len(means)))
    low, high = percentile_interval(means[picks].mean(axis=1))
    return [round(float(np.exp(value)), 2) for value in (means.mean(), low, high)]


if __name__ == "__main__":
    main()
