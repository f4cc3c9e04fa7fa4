"""How should headings follow a heat map? Robots with a shape, with several ways to sample headings.

    python benchmarks/studies/headings.py --json benchmarks/results/headings.json
    python benchmarks/studies/headings.py --maps DIR/*.png --tasks DIR/tasks.csv --json FILE

Without ``--maps`` the maps are generated, and the ways to sample are those of a curve: spread,
uniform fraction, reversals, direction to the goal against direction along a path. With it they are
few: OMPL's own sampler, the positions of the learned heat map alone, and its headings as well.
Times are seconds of one thread's CPU until the first path, inference and headings included, and
until a path within 10 % of the shortest that any run has found. Each run is a line of ``--rows`` as
soon as it has ended; a run that is there already is not done again.
"""

from __future__ import annotations

import argparse
import json
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from math import atan2, inf, pi
from pathlib import Path
from time import thread_time
from typing import Any

import numpy as np
from ompl import base as ob
from ompl import geometric as og
from ompl import util as ou

from cbagan_ompl import (
    GridMap,
    HeadingSpread,
    Heatmap,
    MapError,
    Predictor,
    Robot,
    RobotMotionValidator,
    RobotValidityChecker,
    attach,
    load_model,
    tasks_of,
)
from cbagan_ompl.common.files import write_json
from cbagan_ompl.map_generators import MAP_GENERATORS
from cbagan_ompl.maps.grid_search import shortest_path
from cbagan_ompl.maps.tasks import load_tasks
from cbagan_ompl.planning import compat
from cbagan_ompl.robots.shape_checker import ShapeChecker

LENGTH, WIDTH, RANGE, TOLERANCE, WITHIN = 12.0, 6.0, 30.0, 1.0, 1.1
SPACES = {
    "SE2": {},
    "Dubins 10": {"turning_radius": 10.0},
    "Dubins 5": {"turning_radius": 5.0},
    "Reeds-Shepp 10": {"turning_radius": 10.0, "reverse": True},
}
# Maps on which the way is not straight, generated at half their size and enlarged for the robot.
GENERATORS = (
    "bug_trap",
    "caves",
    "cell_maze",
    "curved_walls",
    "halls",
    "maze",
    "narrow_passage",
    "offices",
    "shelves",
    "walls_with_gaps",
    "warehouse",
)
SIDE, WIDE, SHORTEST, DETOUR = 256, 4.0, 300.0, 1.5
POSITIONS_ONLY = HeadingSpread(uniform_fraction=1)
WAYS: dict[str, HeadingSpread | None] = {
    "OMPL's own": None,
    "positions only": POSITIONS_ONLY,
    "default": HeadingSpread(),
}
CURVE = WAYS | {
    **{f"spread {s:g}": HeadingSpread(spread=s) for s in (0.15, 0.25, 0.6, 0.9)},
    **{f"uniform {u:g}": HeadingSpread(uniform_fraction=u) for u in (0.05, 0.1, 0.4)},
    "along the path": HeadingSpread(),
}
REVERSALS = {f"reversed {r:g}": HeadingSpread(reverse_fraction=r) for r in (0.0, 0.1, 0.35, 0.5)}


@dataclass
class PoseTask:
    """A map, and poses (x, y, yaw) to plan between."""

    name: str
    grid: GridMap
    start: tuple[float, float, float]
    goal: tuple[float, float, float]
    length: float


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--maps", nargs="+", metavar="MAP", help="files, or bundled:NAME")
    parser.add_argument("--tasks", metavar="FILE", help="tasks on the maps (CSV)")
    parser.add_argument("--tasks-per-map", type=int, default=3)
    parser.add_argument("--count", type=int, default=24, help="tasks on generated maps")
    parser.add_argument("--spaces", default=",".join(SPACES))
    parser.add_argument("--planners", default="RRT,RRTstar")
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--time", type=float, default=2.0, help="CPU seconds of a run")
    parser.add_argument("--first", action="store_true", help="end runs with their first path")
    parser.add_argument("--rows", metavar="FILE", default="headings.jsonl")
    parser.add_argument("--json", metavar="FILE")
    args = parser.parse_args()
    ou.setLogLevel(ou.LOG_NONE)
    tasks = list(file_tasks(args)) if args.maps else list(generated_tasks(args.count))
    predictor = load_model()
    rows = Path(args.rows)
    done = [json.loads(line) for line in rows.read_text().splitlines()] if rows.exists() else []
    known = {tuple(row["key"]) for row in done}
    for seed in range(args.seeds):
        for task in tasks:
            for key, robot, way in runs(args, task, seed):
                if key not in known:
                    result = measure(task, robot, key, way, predictor, args)
                    done.append({"key": key, **result})
                    with rows.open("a") as file:
                        file.write(json.dumps(done[-1]) + "\n")
    summary = summarise(done)
    for line in summary:
        print(line)
    if args.json is not None:
        write_json(args.json, {"ompl": compat.ompl_version(), "time": args.time, "rows": summary})


def runs(
    args: argparse.Namespace, task: PoseTask, seed: int
) -> Iterator[tuple[tuple[Any, ...], Robot, HeadingSpread | None]]:
    """Yield the key, the robot and the way to sample of each run of a task."""
    for space in args.spaces.split(","):
        robot = Robot.rectangle(LENGTH, WIDTH, **SPACES[space])
        ways = WAYS if args.maps else CURVE | (REVERSALS if robot.reverse else {})
        for planner in args.planners.split(","):
            for name, way in ways.items():
                yield (space, planner, name, task.name, seed), robot, way


def measure(
    task: PoseTask,
    robot: Robot,
    key: tuple[Any, ...],
    way: HeadingSpread | None,
    predictor: Predictor,
    args: argparse.Namespace,
) -> dict[str, Any]:
    """Return the times of a run and the costs of its paths."""
    _, planner, name, _, seed = key
    compat.seed_ompl(seed)
    setup = make_setup(task, robot, planner)
    attachment, inference = None, 0.0
    if way is not None:
        inflated = task.grid.inflated(robot.inscribed_radius)
        began = thread_time()
        heatmap = predictor.predict(inflated, task.start[:2], task.goal[:2])
        if name == "along the path":
            heatmap = directed_along(heatmap, task)
        attachment = attach(setup, heatmap, seed=seed, heading=way)
        inference = thread_time() - began
    costs = solve(setup, args.time, args.first)
    if attachment is not None:
        attachment.detach()
    return {"inference": inference, "costs": costs}


def make_setup(task: PoseTask, robot: Robot, planner: str) -> Any:
    kind = getattr(ob, robot.state_space)
    space = kind() if robot.turning_radius is None else kind(robot.turning_radius)
    bounds = ob.RealVectorBounds(2)
    for axis, (low, high) in enumerate(zip(*task.grid.bounds, strict=True)):
        bounds.setLow(axis, float(low))
        bounds.setHigh(axis, float(high))
    space.setBounds(bounds)
    setup = og.SimpleSetup(space)
    si = setup.getSpaceInformation()
    setup.setStateValidityChecker(RobotValidityChecker(si, task.grid, robot))
    si.setMotionValidator(RobotMotionValidator(si, task.grid, robot))
    start, goal = (make_state(space, pose) for pose in (task.start, task.goal))
    setup.setStartAndGoalStates(start, goal, TOLERANCE)
    instance = getattr(og, planner)(si)
    instance.setRange(RANGE)
    setup.setPlanner(instance)
    return setup


def make_state(space: Any, pose: tuple[float, float, float]) -> Any:
    state = compat.new_state(space)
    typed = compat.typed_state(state)
    typed.setX(pose[0])
    typed.setY(pose[1])
    typed.setYaw(pose[2])
    return state


def solve(setup: Any, limit: float, first: bool) -> list[tuple[float, float]]:
    """Return (CPU seconds, cost) of each better path."""
    planner = setup.getPlanner()
    goes_on = hasattr(planner, "bestCost")
    costs: list[tuple[float, float]] = []
    best = inf
    began = thread_time()

    def stop() -> bool:
        nonlocal best
        elapsed = thread_time() - began
        if goes_on and (cost := compat.best_cost(planner)) < best:
            best = cost
            costs.append((elapsed, best))
        return elapsed >= limit or (first and best < inf)

    is_exact = compat.is_exact(setup.solve(compat.termination_condition(stop)))
    if not goes_on and is_exact:
        costs.append((thread_time() - began, setup.getSolutionPath().length()))
    return costs if is_exact else []


def directed_along(heatmap: Heatmap, task: PoseTask) -> Heatmap:
    """Return the heat map with the direction of the nearest pixel of the cheapest path over it."""
    import cv2

    grid = heatmap.grid
    ends = [tuple(map(int, grid.to_pixel(pose[:2]))) for pose in (task.start, task.goal)]
    path = shortest_path(grid.free, *ends, 1 / (heatmap.values + np.float32(0.02)))
    assert path is not None
    ahead, behind = (np.clip(np.arange(len(path)) + k, 0, len(path) - 1) for k in (8, -8))
    angles = np.arctan2(*(path[ahead] - path[behind]).T[::-1])
    off_path = np.ones(grid.shape, np.uint8)
    off_path[path[:, 1], path[:, 0]] = 0
    labels = cv2.distanceTransformWithLabels(
        off_path, cv2.DIST_L2, cv2.DIST_MASK_5, labelType=cv2.DIST_LABEL_PIXEL
    )[1]
    by_label = np.zeros(labels.max() + 1)
    by_label[labels[path[:, 1], path[:, 0]]] = angles
    return heatmap.with_heading(by_label[labels])


def generated_tasks(count: int) -> Iterator[PoseTask]:
    """Yield tasks whose shortest way for a wide disc is long and has a detour."""
    rng = np.random.default_rng(20)
    number = found = 0
    while found < count:
        name = GENERATORS[number % len(GENERATORS)]
        half = MAP_GENERATORS[name](rng, SIDE // 2, SIDE // 2)
        grid = GridMap(np.kron(half, np.ones((2, 2), bool)), name=f"{name}-{number}")
        number += 1
        try:
            wide = grid.inflated(WIDE)
        except MapError:  # nothing is left
            continue
        pixels = np.argwhere(wide.free)[:, ::-1]
        for _ in range(40):
            start, goal = pixels[rng.integers(len(pixels), size=2)] + 0.5
            if np.hypot(*(goal - start)) < 80:
                continue
            if wide.components[tuple(start.astype(int)[::-1])] == wide.components[
                tuple(goal.astype(int)[::-1])
            ] and (task := pose_task(grid.name, grid, wide, start, goal, SHORTEST)):
                found += 1
                yield task
                break


def file_tasks(args: argparse.Namespace) -> Iterator[PoseTask]:
    """Yield the few tasks on each map that are the longest for the robot."""
    for word in args.maps:
        grid = GridMap.load(word)
        inflated = grid.inflated(WIDTH / 2)
        tasks = load_tasks(args.tasks, grid) if args.tasks else tasks_of(word, grid)
        poses = [
            pose_task(f"{grid.name}-{number}", grid, inflated, task.start, task.goal, 0.0)
            for number, task in enumerate(tasks)
        ]
        fitting = [task for task in poses if task is not None]
        yield from sorted(fitting, key=lambda task: -task.length)[: args.tasks_per_map]


def pose_task(
    name: str, grid: GridMap, wide: GridMap, start: Any, goal: Any, shortest: float
) -> PoseTask | None:
    """Return a task with the yaws of the shortest path at its ends; None if the robot collides."""
    ends = [tuple(map(int, grid.to_pixel(point))) for point in (start, goal)]
    fits = wide.is_free(np.array((start, goal))).all()
    path = shortest_path(wide.free, *ends) if fits else None
    if path is None:
        return None
    length = float(np.hypot(*np.diff(path, axis=0).T).sum())
    if shortest and length < max(shortest, DETOUR * np.hypot(*(path[-1] - path[0]))):
        return None
    reach = min(12, len(path) - 1)
    checker = ShapeChecker.of(grid, Robot.rectangle(LENGTH, WIDTH))
    poses = []
    for point, (du, dv) in ((start, path[reach] - path[0]), (goal, path[-1] - path[-1 - reach])):
        # Where the robot does not fit that way round, the nearest heading in which it does.
        turns = [0.0, *(s * k * pi / 12 for k in range(1, 6) for s in (1, -1))]
        x, y, yaw = float(point[0]), float(point[1]), atan2(dv, du)
        free = [yaw + turn for turn in turns if checker.pose_is_free(x, y, yaw + turn)]
        if not free:
            return None
        # A yaw of pi is out of OMPL's bounds.
        poses.append((x, y, (free[0] + pi) % (2 * pi) - pi))
    return PoseTask(name, grid, *poses, length)


def summarise(done: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return success, quartiles of the times in ms and ratios, by space, planner and sampler."""
    best: dict[tuple[str, ...], float] = defaultdict(lambda: inf)
    groups = defaultdict(list)
    for row in done:
        space, planner, way, task, _ = row["key"]
        groups[space, planner, way].append(row)
        for _, cost in row["costs"]:
            best[space, task] = min(best[space, task], cost)
    summary = []
    for (space, planner, way), rows in groups.items():
        first, within = [], []
        for row in rows:
            good = WITHIN * best[space, row["key"][3]]
            times = [row["inference"] + time for time, cost in row["costs"]]
            costs = [cost for _, cost in row["costs"]]
            first.append(times[0] if times else inf)
            within.append(next((t for t, c in zip(times, costs, strict=True) if c <= good), inf))
        summary.append(
            {
                "space": space,
                "planner": planner,
                "sampler": way,
                "runs": len(rows),
                "solved": round(float(np.isfinite(first).mean()), 3),
                "first_ms": quartiles(first),
                "within_ms": quartiles(within),
                "inference_ms": quartiles([row["inference"] for row in rows])[1],
            }
        )
    return summary


def quartiles(times: list[float]) -> list[float | None]:
    """Return the quartiles in ms; None where a run without a path is in the way."""
    values = np.percentile(times, (25, 50, 75), method="nearest")
    return [round(1e3 * float(value), 1) if np.isfinite(value) else None for value in values]


if __name__ == "__main__":
    main()
