"""Robots with heading on real and bundled maps: how soon is there a path, with which sampler?

    python benchmarks/studies/robot_paths.py bundled:rooms MAPS/png/*.png --tasks MAPS/tasks.csv \
        --rows robot_paths.jsonl --json robot_paths.json

Which tasks are run was written down before the first run:

* Of each map, of all its tasks, the one with the longest shortest path on the map inflated by 3.5
  pixels among those whose path is at least 1.2 times as long as the distance. Inflation adds up to
  the diagonal of a pixel: the path leads through gaps of ten pixels, in which a rectangle of 12 x 6
  has room to turn. Maps without such a task are left out.
* Start and goal have the yaws of that path at its ends.
* A task that no sampler and no seed solves in a space with any planner is taken to be infeasible
  there and left out, and so named in the result.
* Tight: the same tasks in SE(2). The rectangle is as wide as 95 % of the narrowest gap on the
  widest way from start to goal, and 1.5 times as long; where it collides at an end it is turned, at
  most 75 degrees, and the task left out where that is not enough.

Samplers: OMPL's own; the positions of the learned heat map alone; the default, with headings; the
corridor of a grid search, with headings. RRT has the first and the third. Times are seconds of one
thread's CPU until the first path, and for RRT*, in the first seeds, until within 10 % of the
shortest path that any run has found. They include the heat map and its headings. Each run is a
line of ``--rows`` as soon as it has ended; a run that is there already is not done again. Runs are
in the order of their seeds, and the summary takes the seeds of which all runs have ended.
"""

from __future__ import annotations

import argparse
from collections import defaultdict
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from math import inf
from time import process_time
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pose_runs import SPACES, PoseTask, make_setup, pose_task, solve
from run_rows import RunRows
from scipy.ndimage import distance_transform_edt

from cbagan_ompl import (
    CbaganOmplError,
    GridMap,
    HeadingSpread,
    Heatmap,
    MapError,
    Predictor,
    Robot,
    attach,
    load_model,
    tasks_of,
)
from cbagan_ompl.common.files import write_json
from cbagan_ompl.maps.tasks import load_tasks
from cbagan_ompl.planning import compat
from cbagan_ompl.planning.compat import ou

LENGTH, WIDTH, DISC, DETOUR, WITHIN, TIGHT = 12.0, 6.0, 3.5, 1.2, 1.1, 0.95
OWN, POSITIONS, DEFAULT, CORRIDOR = "OMPL's own", "positions only", "default", "corridor"
SAMPLERS = (OWN, POSITIONS, DEFAULT, CORRIDOR)
TIGHT_SPACE = "SE2 tight"
PLANNERS = ("RRTstar", "RRT")
RESAMPLES = 300

FloatArray = NDArray[np.float64]
Measure = Callable[[FloatArray, FloatArray], float | None]


@dataclass(frozen=True)
class Run:
    """One run: what it is known by, and what it takes."""

    key: tuple[str, str, str, str, int]
    task: PoseTask
    robot: Robot
    first: bool


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("maps", nargs="+", metavar="MAP", help="files, or bundled:NAME")
    parser.add_argument("--tasks", metavar="FILE", help="tasks on the maps that are files (CSV)")
    parser.add_argument("--spaces", default=",".join((*SPACES, TIGHT_SPACE)))
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--full-seeds", type=int, default=1, help="seeds in which RRT* goes on")
    parser.add_argument("--time", type=float, default=2.0, help="CPU seconds of a run")
    parser.add_argument("--rows", metavar="FILE", default="robot_paths.jsonl")
    parser.add_argument("--json", metavar="FILE")
    parser.add_argument("--summary-only", action="store_true", help="run nothing")
    args = parser.parse_args()
    ou.setLogLevel(ou.LOG_NONE)
    tasks = [task for word in args.maps for task in tasks_on(word, args.tasks)]
    for _, task, robot in tasks:
        print(f"{task.name}: {task.length:.0f}, detour {task.detour:.2f}, {robot!r}")
    done = RunRows(args.rows)
    plan = list(runs(args, tasks))
    if not args.summary_only:
        predictor = load_model()
        warm_up(predictor)
        for run in plan:
            if run.key not in done.keys:
                done.add(run.key, measure(run, predictor, args.time))
    missing = {run.key[-1] for run in plan if run.key not in done.keys}
    seeds = min(missing, default=args.seeds)
    result = summarise([row for row in done.rows if row["key"][-1] < seeds], args.time)
    for row in result["rows"]:
        print(row)
    head = {"ompl": compat.ompl_version(), "time": args.time, "seeds": seeds}
    if args.json is not None:
        write_json(args.json, head | {"full_seeds": args.full_seeds} | result)


def tasks_on(word: str, file: str | None) -> Iterator[tuple[bool, PoseTask, Robot]]:
    """Yield the task on a map, and the tight one: (whether it is tight, task, its rectangle)."""
    grid = GridMap.load(word)
    try:
        wide = grid.inflated(DISC)
    except MapError:  # nothing is left
        return
    is_bundled = word.startswith("bundled:")
    tasks = tasks_of(word, grid) if is_bundled or file is None else load_tasks(file, grid)
    poses = [(pose_task(grid.name, grid, wide, task.start, task.goal), task) for task in tasks]
    turning = [pair for pair in poses if pair[0] is not None and pair[0].detour >= DETOUR]
    if not turning:
        return
    chosen, task = max(turning, key=lambda pair: pair[0].length)
    yield False, chosen, Robot.rectangle(LENGTH, WIDTH)
    width = TIGHT * widest(grid, task.start, task.goal)
    robot = Robot.rectangle(1.5 * width, width)
    tight = pose_task(grid.name, grid, wide, task.start, task.goal, robot)
    if tight is not None:
        yield True, tight, robot


def widest(grid: GridMap, start: Any, goal: Any) -> int:
    """Return how wide the narrowest gap is on the widest way, in pixels, at most 20.

    Gaps of odd and even width look the same from the middle of a pixel: the odd one is taken.
    """
    distance = distance_transform_edt(np.pad(grid.free, 1))[1:-1, 1:-1]
    for radius in range(10, 1, -1):
        try:
            GridMap(distance >= radius, grid.resolution, grid.origin).check_task(start, goal)
        except CbaganOmplError:
            continue
        return 2 * radius - 1
    return 1


def runs(args: argparse.Namespace, tasks: list[tuple[bool, PoseTask, Robot]]) -> Iterator[Run]:
    for seed in range(args.seeds):
        for is_tight, task, shape in tasks:
            for space in args.spaces.split(","):
                if is_tight != (space == TIGHT_SPACE):
                    continue
                robot = Robot.polygon(shape.corners, **SPACES.get(space, {}))
                for planner in PLANNERS[: 1 if is_tight else None]:
                    first = planner == "RRT" or seed >= args.full_seeds
                    for sampler in SAMPLERS if planner == "RRTstar" else (OWN, DEFAULT):
                        yield Run((space, planner, sampler, task.name, seed), task, robot, first)


def warm_up(predictor: Predictor) -> None:
    """Load and compile what is loaded and compiled once."""
    grid, ends = GridMap.load("bundled:rooms"), ((20, 20, 0), (230, 230, 0))
    for options in SPACES.values():
        robot = Robot.rectangle(LENGTH, WIDTH, **options)
        setup = make_setup(PoseTask("rooms", grid, *ends, 0.0, 0.0), robot, "RRTstar")
        for source in (predictor.predict, Heatmap.corridor):
            heatmap = source(grid, *ends, robot=robot).directed((230, 230))
            with attach(setup, heatmap, seed=0):
                solve(setup, 0.1, first=True)


def measure(run: Run, predictor: Predictor, limit: float) -> dict[str, Any]:
    """Return the time of the heat map, and the times and costs of the paths."""
    _, planner, sampler, _, seed = run.key
    compat.seed_ompl(seed + 1)
    setup = make_setup(run.task, run.robot, planner)
    if sampler == OWN:
        costs = solve(setup, limit, run.first)
        return {"inference": 0.0, "costs": costs, "full": not run.first}
    source = Heatmap.corridor if sampler == CORRIDOR else predictor.predict
    spread = HeadingSpread(uniform_fraction=1) if sampler == POSITIONS else HeadingSpread()
    began = process_time()
    heatmap = source(run.task.grid, run.task.start, run.task.goal, robot=run.robot)
    with attach(setup, heatmap, seed=seed, heading=spread):
        inference = process_time() - began
        costs = solve(setup, limit, run.first)
    return {"inference": inference, "costs": costs, "full": not run.first}


def summarise(done: list[dict[str, Any]], limit: float) -> dict[str, Any]:
    """Return success, times in ms and ratios of medians, by space, planner and sampler."""
    best: dict[tuple[str, str], float] = defaultdict(lambda: inf)
    groups: dict[tuple[str, ...], dict[str, list[Any]]] = defaultdict(lambda: defaultdict(list))
    for row in done:
        space, planner, sampler, task, _ = row["key"]
        best[space, task] = min([best[space, task], *(cost for _, cost in row["costs"])])
        groups[space, planner, sampler][task].append(row)
    rows = []
    for (space, planner, sampler), by_task in groups.items():
        tasks = [task for task in by_task if best[space, task] < inf]
        own = groups[space, planner, OWN]
        first, own_first = (
            [np.array([time_to(run, inf) for run in some[task]]) for task in tasks]
            for some in (by_task, own)
        )
        row = {"space": space, "planner": planner, "sampler": sampler, "tasks": len(tasks)}
        row |= {"runs": sum(map(len, first)), "solved": describe(first, first, success)}
        row |= {"first_ms": quartiles(first), "sooner": describe(first, own_first, ratio(limit))}
        if planner == "RRTstar" and sum(run["full"] for run in by_task[tasks[0]]):
            within, own_within = (
                [
                    np.array([time_to(run, WITHIN * best[space, t]) for run in some[t][:full]])
                    for t in tasks
                ]
                for some in (by_task, own)
                for full in [sum(run["full"] for run in by_task[tasks[0]])]
            )
            row |= {"within_ms": quartiles(within)}
            row |= {"within_sooner": describe(within, own_within, ratio(limit))}
        heatmaps = [run["inference"] for task in tasks for run in by_task[task]]
        rows.append(row | {"heatmap_ms": round(1e3 * float(np.median(heatmaps)), 1)})
    infeasible = sorted([space, task] for (space, task), cost in best.items() if cost == inf)
    return {"infeasible": infeasible, "rows": rows}


def time_to(run: dict[str, Any], cost: float) -> float:
    """Return the seconds until a path of at most a cost, the heat map included; inf if never."""
    return next((run["inference"] + t for t, c in run["costs"] if c <= cost), inf)


def success(times: FloatArray, _: FloatArray) -> float:
    return round(float(np.isfinite(times).mean()), 3)


def ratio(limit: float) -> Callable[[FloatArray, FloatArray], float | None]:
    """Return the ratio of medians, OMPL's own taken for the limit where most runs are unsolved."""

    def sooner(times: FloatArray, own: FloatArray) -> float | None:
        median = float(np.median(times))
        return round(min(float(np.median(own)), limit) / median, 1) if median < inf else None

    return sooner


def describe(
    times: list[FloatArray], own: list[FloatArray], measure: Measure
) -> list[float | None]:
    """Return a measure and its bootstrap 95 % interval, over tasks and the runs of each.

    Unsolved medians are None, and count as 0 in the interval.
    """
    rng = np.random.default_rng(0)
    values = []
    for _ in range(RESAMPLES):
        picks = [
            (task, rng.random(len(times[task])))
            for task in rng.integers(len(times), size=len(times))
        ]
        some, others = (
            np.concatenate([which[t][(u * len(which[t])).astype(int)] for t, u in picks])
            for which in (times, own)
        )
        values.append(measure(some, others) or 0.0)
    low, high = np.percentile(values, (2.5, 97.5))
    return [measure(np.concatenate(times), np.concatenate(own)), round(low, 3), round(high, 3)]


def quartiles(times: list[FloatArray]) -> list[float | None]:
    """Return the quartiles in ms; None where a run without a path is in the way."""
    values = np.percentile(np.concatenate(times), (25, 50, 75), method="nearest")
    return [round(1e3 * float(value), 1) if np.isfinite(value) else None for value in values]


if __name__ == "__main__":
    main()
