"""A car in parking lots and a robot in a warehouse: the SVG scenarios of Bench-MR.

    python benchmarks/studies/car_suites.py DIR --rows car_suites.jsonl --json car_suites.json

``DIR`` holds parking1.svg, parking2.svg, warehouse.svg, car.svg and warehouse_robot.svg of
https://github.com/robot-motion/bench-mr. Reeds-Shepp curves of radius 4, checked exactly. Times are
seconds of one thread's CPU until the first path, heat map included; Informed RRT* goes on to the
limit, and the cost of its path is told. With ``--hybrid PYTHON``, an interpreter that has
fastsim-navigation, its Hybrid A* has the same tasks: it needs no samples, and its first path is its
last. Its paths are looked at with the same exact check, pose by pose.

The tasks are those that the authors of the scenarios ran. In which frame they are is not written
down: they are shifted by SHIFTS, in the middle of the shifts under which every pose is free.
"""

from __future__ import annotations

import argparse
import json
import subprocess
from collections.abc import Callable, Iterator
from functools import cache
from itertools import product
from math import inf
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from time import process_time
from typing import Any

import numpy as np
from pose_runs import PoseTask, make_setup, solve
from run_rows import RunRows

from cbagan_ompl import GridMap, HeadingSpread, Heatmap, Robot, attach, load_model
from cbagan_ompl.common.files import write_json
from cbagan_ompl.planning import compat
from cbagan_ompl.planning.compat import ou
from cbagan_ompl.robots.footprint_files import load_footprint
from cbagan_ompl.robots.shape_checker import ShapeChecker

RADIUS, MARGIN, TOLERANCE = 4.0, 2.0, 0.25
OWN, POSITIONS, DEFAULT, CORRIDOR = "OMPL's own", "positions only", "default", "corridor"
SAMPLERS = (OWN, POSITIONS, DEFAULT, CORRIDOR)
PLANNERS = ("RRTConnect", "RRTstar", "InformedRRTstar")
Key = tuple[str, int, str, str, int]
Scene = tuple[list[PoseTask], Robot]
RESOLUTIONS = {"parking1": 0.05, "parking2": 0.05, "warehouse": 0.2}
ROBOTS = {"parking1": "car", "parking2": "car", "warehouse": "warehouse_robot"}
SHIFTS = {"parking1": (1.5, -5.0), "parking2": (1.45, -4.85), "warehouse": (11.25, -12.25)}
_AISLE, _SLOT, _BAY = (0, -2.27), (7.72, -7.72, -1.58), (10.91, 2.73, 1.57)
TASKS = {
    "parking1": (
        ((*_AISLE, 0), _SLOT),
        (_SLOT, (*_AISLE, 3.14)),
        (_SLOT, (10, -7.72, 1.58)),
        (_SLOT, (15, -2.27, 0)),
        ((15, -2.27, 3.14), _SLOT),
    ),
    "parking2": (
        ((*_AISLE, 0), _BAY),
        (_BAY, (*_AISLE, 3.14)),
        ((*_AISLE, 0), (13.5, -7, 1.57)),
        ((13.5, -7, 1.57), (*_AISLE, 3.14)),
        ((13.5, -7, 1.57), _BAY),
    ),
    "warehouse": (
        ((-2.5, 4.55, -1.58), (65, 2.5, -1.58)),
        ((-2.5, -55, 0), (55, 5.5, 0)),
        ((14.5, -28, 1.58), (48, -28, 1.58)),
        ((65, -55, 3.14), (14.5, 0, 1.58)),
        ((3, -5, 3.14), (66, -5, 1.58)),
    ),
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", metavar="DIR")
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--time", type=float, default=2.0, help="CPU seconds of a run")
    parser.add_argument("--hybrid", metavar="PYTHON", help="with fastsim-navigation")
    parser.add_argument("--rows", metavar="FILE", default="car_suites.jsonl")
    parser.add_argument("--json", metavar="FILE")
    args = parser.parse_args()
    ou.setLogLevel(ou.LOG_NONE)
    done = RunRows(args.rows)
    scenes = {name: load(args.folder, name) for name in TASKS}
    for run in runs(scenes, args.seeds):
        if run not in done.keys:
            tasks, robot = scenes[run[0]]
            done.add(run, measure(tasks[run[1]], robot, run, args.time))
    summary = summarise(done.rows)
    if args.hybrid is not None:
        for name, (tasks, robot) in scenes.items():
            summary.append(hybrid(name, tasks, robot, args))
    for row in summary:
        print(row)
    if args.json is not None:
        head = {"ompl": compat.ompl_version(), "time": args.time, "seeds": args.seeds}
        write_json(args.json, head | {"rows": summary})


def runs(scenes: dict[str, Scene], seeds: int) -> Iterator[Key]:
    """Yield scene, number of the task, planner, sampler and seed of each run."""
    for seed in range(seeds):
        for name, (tasks, _) in scenes.items():
            for number in range(len(tasks)):
                for planner, sampler in product(PLANNERS, SAMPLERS):
                    yield name, number, planner, sampler, seed


@cache
def sources() -> dict[str, Callable[..., Heatmap]]:
    """Return what makes heat maps, loaded and compiled."""
    predict, grid = load_model().predict, GridMap.load("bundled:rooms")
    for source in (predict, Heatmap.corridor):
        source(grid, (20, 20), (230, 230)).directed((230, 230))
    return {CORRIDOR: Heatmap.corridor, POSITIONS: predict, DEFAULT: predict}


def load(folder: str, name: str) -> Scene:
    path = Path(folder)
    grid = GridMap.load(path / f"{name}.svg", resolution=RESOLUTIONS[name], margin=MARGIN)
    robot = load_footprint(path / f"{ROBOTS[name]}.svg", turning_radius=RADIUS, reverse=True)
    dx, dy = SHIFTS[name]
    ends = [[(x + dx, y + dy, float(yaw)) for x, y, yaw in task] for task in TASKS[name]]
    return [PoseTask(name, grid, start, goal, 0.0, 0.0) for start, goal in ends], robot


def measure(task: PoseTask, robot: Robot, key: Key, limit: float) -> dict[str, Any]:
    """Return the seconds until the first path and the cost of the last; None without one."""
    _, _, planner, sampler, seed = key
    compat.seed_ompl(seed + 1)
    setup = make_setup(task, robot, planner, range=None, tolerance=TOLERANCE)
    is_first = planner != "InformedRRTstar"
    if sampler == OWN:
        return result_of(solve(setup, limit, is_first), 0.0)
    source = sources()[sampler]
    spread = HeadingSpread(uniform_fraction=1) if sampler == POSITIONS else HeadingSpread()
    began = process_time()
    heatmap = source(task.grid, task.start, task.goal, robot=robot)
    with attach(setup, heatmap, seed=seed, heading=spread):
        inference = process_time() - began
        costs = solve(setup, limit, is_first)
    return result_of(costs, inference)


def result_of(costs: list[tuple[float, float]], inference: float) -> dict[str, Any]:
    if not costs:
        return {"first": None, "cost": None}
    return {"first": inference + costs[0][0], "cost": costs[-1][1]}


def summarise(done: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return success, the median time to the first path and the mean cost where all are solved."""
    groups: dict[tuple[str, str, str], dict[tuple[int, int], Any]] = {}
    for row in done:
        scene, number, planner, sampler, seed = row["key"]
        group = groups.setdefault((scene, planner, sampler), {})
        group[number, seed] = row["first"], row["cost"]
    summary = []
    for (scene, planner, sampler), runs in groups.items():
        others = [groups[scene, planner, one] for one in SAMPLERS]
        common = [run for run in runs if all(one[run][1] is not None for one in others)]
        times = [inf if time is None else time for time, _ in runs.values()]
        middle = median(times)
        costs = [runs[run][1] for run in common]
        summary.append(
            {"scene": scene, "planner": planner, "sampler": sampler, "runs": len(runs)}
            | {"solved": round(float(np.isfinite(times).mean()), 3)}
            | {"first_ms": round(1e3 * middle, 1) if middle < inf else None}
            | {"cost": round(float(np.mean(costs)), 2) if costs else None, "common": len(common)}
        )
    return summary


def hybrid(
    name: str, tasks: list[PoseTask], robot: Robot, args: argparse.Namespace
) -> dict[str, Any]:
    """Return the row of Hybrid A*, which another interpreter runs."""
    grid = tasks[0].grid
    assert grid.origin is not None, "maps of SVG files are in world units"
    with TemporaryDirectory() as folder:
        file = Path(folder) / "tasks.npz"
        np.savez(
            file,
            free=grid.free,
            resolution=grid.resolution,
            origin=grid.origin[:2],
            footprint=robot.vertices,
            turning_radius=RADIUS,
            limit=args.time,
            poses=[(task.start, task.goal) for task in tasks],
        )
        script = Path(__file__).with_name("hybrid_astar.py")
        command = [args.hybrid, str(script), str(file)]
        output = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    results = json.loads(output.splitlines()[-1])
    checker = ShapeChecker.of(grid, robot)
    solved = [one for one in results if one["path"] and one["status"].upper() == "SUCCESS"]
    free = [all(checker.pose_is_free(*pose) for pose in one["path"]) for one in solved]
    lengths = [np.hypot(*np.diff(np.array(one["path"])[:, :2], axis=0).T).sum() for one in solved]
    times = [one["seconds"] for one in solved] + [inf] * (len(results) - len(solved))
    middle = median(times)
    return (
        {"scene": name, "planner": "Hybrid A* (fastsim-navigation)", "sampler": None}
        | {"runs": len(results), "solved": len(solved) / len(results)}
        | {"first_ms": round(1e3 * middle, 1) if middle < inf else None}
        | {"cost": round(float(np.mean(lengths)), 2) if lengths else None, "free": sum(free)}
        | {"statuses": [one["status"] for one in results]}
    )


if __name__ == "__main__":
    main()
