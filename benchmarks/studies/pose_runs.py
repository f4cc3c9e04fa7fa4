"""What the studies of robots with heading share: tasks with poses, setups, and timed runs."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import atan2, inf, pi
from time import thread_time
from typing import Any

import numpy as np
from ompl import base as ob
from ompl import geometric as og

from cbagan_ompl import GridMap, MapError, Robot, RobotMotionValidator, RobotValidityChecker
from cbagan_ompl.map_generators import MAP_GENERATORS
from cbagan_ompl.maps.grid_search import shortest_path
from cbagan_ompl.planning import compat
from cbagan_ompl.robots.shape_checker import ShapeChecker

LENGTH, WIDTH, RANGE, TOLERANCE = 12.0, 6.0, 30.0, 1.0
SPACES: dict[str, dict[str, Any]] = {
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


@dataclass
class PoseTask:
    """A map, and poses (x, y, yaw) to plan between.

    Attributes:
        length: of the shortest path of a disc between the positions, world units.
        detour: that length as a multiple of the distance.
    """

    name: str
    grid: GridMap
    start: tuple[float, float, float]
    goal: tuple[float, float, float]
    length: float
    detour: float


def make_setup(
    task: PoseTask,
    robot: Robot,
    planner: str,
    range: float | None = RANGE,
    tolerance: float = TOLERANCE,
) -> Any:
    """Return a SimpleSetup with exact checks; its planner has OMPL's own range for None."""
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
    setup.setStartAndGoalStates(start, goal, tolerance)
    instance = getattr(og, planner)(si)
    if range is not None:
        instance.setRange(range)
    setup.setPlanner(instance)
    return setup


def seeded_setup(task: PoseTask, space: str, planner: str, seed: int) -> tuple[Robot, Any]:
    """Return the rectangle of the studies in a space, and a setup for it, with OMPL seeded."""
    robot = Robot.rectangle(LENGTH, WIDTH, **SPACES[space])
    compat.seed_ompl(seed + 1)
    return robot, make_setup(task, robot, planner)


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
            task = pose_task(grid.name, grid, wide, start, goal)
            if task is not None and task.length >= SHORTEST and task.detour >= DETOUR:
                found += 1
                yield task
                break


def pose_task(
    name: str, grid: GridMap, wide: GridMap, start: Any, goal: Any, robot: Robot | None = None
) -> PoseTask | None:
    """Return a task with the yaws of the shortest path at its ends.

    Args:
        name: of the task.
        grid: the map.
        wide: the map of the positions of the disc whose path it is.
        start: (x, y), world.
        goal: (x, y), world.
        robot: which must be free at both ends; None for the rectangle of the studies.

    Returns:
        None if there is no path, or the robot collides.
    """
    ends = [tuple(map(int, grid.to_pixel(point))) for point in (start, goal)]
    fits = wide.is_free(np.array((start, goal))).all()
    path = shortest_path(wide.free, *ends) if fits else None
    if path is None:
        return None
    length = float(np.hypot(*np.diff(path, axis=0).T).sum())
    reach = min(12, len(path) - 1)
    checker = ShapeChecker.of(grid, robot or Robot.rectangle(LENGTH, WIDTH))
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
    straight = max(1.0, float(np.hypot(*np.subtract(goal, start))))
    return PoseTask(name, grid, *poses, length, length / straight)
