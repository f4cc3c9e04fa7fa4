"""Replanning from a moving start: OMPL's own RRT, a fresh prediction each cycle, and Replanner.

    python benchmarks/studies/replanning.py --json benchmarks/results/replanning_ompl_2.0.1.json

A robot follows its path a step a cycle and plans again from where it is with RRT, which stops at
its first path. Each of the three has a robot of its own; their cycles alternate. A cycle is timed
as a whole, in processor time: checks of the task, heat map, planning, check of the path. With
obstacles, in a quarter of the cycles a block appears on the path ahead, unless it would close the
only way.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from time import process_time
from typing import Any

import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

from cbagan_ompl import GridMap, PlanResult, Replanner, TaskError, bundled_maps, load_model, plan
from cbagan_ompl.benchmarking.tasks import BenchmarkTask, select_tasks
from cbagan_ompl.common.files import write_json
from cbagan_ompl.planning.compat import ompl_version

# A cycle of 10 Hz in milliseconds, and how far the robot goes in one, in pixels. The limit is
# longer, because it is one of the clock, which also runs while others have the processor.
CYCLE_MS, STEP = 100.0, 6.0
OPTIONS: dict[str, Any] = {"planner": "RRT", "time": 1.0, "range": 20.0}
VARIANTS = ("uniform", "fresh", "kept")

# Side of a block that appears in pixels, how far ahead, and in which fraction of the cycles.
BLOCK, AHEAD, FREQUENCY = 6, (25.0, 60.0), 0.25


class Robot:
    """Drives to the goal of a task and plans anew in each cycle.

    Attributes:
        cycles: (milliseconds, whether a path was found, whether the heat map was kept).
    """

    def __init__(self, variant: str, task: BenchmarkTask, model: Any, obstacles: bool) -> None:
        self.grid: GridMap = task.grid
        self.position = np.array(task.task.start, float)
        self.goal = np.array(task.task.goal, float)
        self.cycles: list[tuple[float, bool, bool]] = []
        self._way: NDArray[np.float64] = self.position[None]
        self._rng = np.random.default_rng(0)
        self._obstacles = obstacles
        self._replan = self._planner(variant, model)

    @property
    def is_there(self) -> bool:
        """Whether the goal is a step away or less."""
        return bool(np.hypot(*(self.goal - self.position)) <= STEP)

    def cycle(self, number: int) -> None:
        """Plan from where the robot is, and go a step."""
        if self._obstacles and self._rng.random() < FREQUENCY:
            self._add_obstacle()
        began = process_time()
        result = self._replan(number)
        self.cycles.append((1e3 * (process_time() - began), result.solved, result.heatmap_kept))
        if result.solved:
            self._way = result.trajectory
        self._drive()

    def _planner(self, variant: str, model: Any) -> Callable[[int], PlanResult]:
        if variant == "kept":
            replanner = Replanner(self.grid, self.goal, model=model, seed=0, **OPTIONS)
            return lambda number: replanner.plan(self.position, self.grid)
        source = {"sampler": "uniform"} if variant == "uniform" else {"model": model}
        return lambda number: plan(
            self.grid, self.position, self.goal, **OPTIONS, **source, seed=number
        )

    def _drive(self) -> None:
        """Go a step along the path, as far as it is free of what has appeared since."""
        distances = np.hypot(*np.diff(self._way, axis=0).T).cumsum()
        last = int(np.searchsorted(distances, STEP))
        ahead = self._way[: last + 1]
        if len(ahead) > 1 and self.grid.path_is_free(ahead):
            self.position = ahead[-1]
            self._way = self._way[last:]

    def _add_obstacle(self) -> None:
        distances = np.hypot(*np.diff(self._way, axis=0).T).cumsum()
        first, last = np.searchsorted(distances, AHEAD)
        if last <= first:
            return
        column, row = self._way[self._rng.integers(first, last)].astype(int) - BLOCK // 2
        free = self.grid.free.copy()
        free[max(row, 0) : row + BLOCK, max(column, 0) : column + BLOCK] = False
        changed = GridMap(free, name=self.grid.name)
        try:
            changed.check_task(self.position, self.goal)
        except TaskError:
            return
        self.grid = changed


def drive(tasks: list[BenchmarkTask], model: Any, most: int, obstacles: bool) -> dict[str, Any]:
    """Return for each variant what its cycles were like, over all tasks."""
    cycles: dict[str, list[tuple[float, bool, bool]]] = {variant: [] for variant in VARIANTS}
    for task in tqdm(tasks, desc="obstacles" if obstacles else "no obstacles"):
        robots = {variant: Robot(variant, task, model, obstacles) for variant in VARIANTS}
        for number in range(most):
            for robot in robots.values():
                if not robot.is_there:
                    robot.cycle(number)
        for variant, robot in robots.items():
            cycles[variant] += robot.cycles
    return {variant: summary(rows) for variant, rows in cycles.items()}


def summary(rows: list[tuple[float, bool, bool]]) -> dict[str, float]:
    times, solved, kept = (np.array(column) for column in zip(*rows, strict=True))
    median, p95 = np.percentile(times, (50, 95))
    return {
        "cycles": len(rows),
        "median_ms": round(float(median), 2),
        "p95_ms": round(float(p95), 2),
        "in_time": round(float((solved & (times <= CYCLE_MS)).mean()), 4),
        "kept": round(float(kept.mean()), 4),
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("maps", nargs="*", metavar="MAP", help="default: the bundled maps")
    parser.add_argument("--tasks", metavar="FILE", help="default: those that come with the maps")
    parser.add_argument("--tasks-per-map", type=int, metavar="N")
    parser.add_argument("--cycles", type=int, default=30, metavar="N", help="most for a task")
    parser.add_argument("--json", metavar="FILE")
    args = parser.parse_args()
    maps = args.maps or [f"bundled:{name}" for name in bundled_maps()]
    tasks = select_tasks(maps, args.tasks, args.tasks_per_map).tasks
    model = load_model()
    drive(tasks[:1], model, 3, obstacles=False)  # first calls take longer
    result = {"ompl": ompl_version(), "tasks": len(tasks), "cycle_ms": CYCLE_MS, "step": STEP}
    for name, obstacles in (("static", False), ("obstacles", True)):
        result[name] = drive(tasks, model, args.cycles, obstacles)
        for variant, values in result[name].items():
            print(name, variant, values)
    if args.json is not None:
        write_json(args.json, result)


if __name__ == "__main__":
    main()
