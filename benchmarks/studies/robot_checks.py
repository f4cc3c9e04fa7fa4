"""Checks of robots with shape and heading: how fast, and do they ever miss a collision?

    python benchmarks/studies/robot_checks.py --map bundled:rooms --map bundled:maze \
        --paths 2000 --json robot_checks.json

Speed: the mean CPU time of RobotMotionValidator in SE(2) for a 12 x 6 pixel rectangle, as a
multiple of GridMotionValidator's for a point on the same motions, interleaved. Tables: CPU time and
memory for all headings of a map of 1024 x 1024 pixels. Paths: planners solve random tasks on small
random maps, and every path is looked at each tenth of a pixel with shapely, polygon against pixels.
Poses: random ones on such maps; what the checker refuses of those that shapely allows.
"""

from __future__ import annotations

import argparse
import itertools
import sys
from itertools import pairwise
from math import pi
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np
from tqdm import tqdm

from cbagan_ompl import GridMap, GridMotionValidator, Robot, RobotMotionValidator
from cbagan_ompl import RobotValidityChecker as Validity
from cbagan_ompl.common.files import write_json
from cbagan_ompl.planning import compat
from cbagan_ompl.planning.compat import ob, og
from cbagan_ompl.robots.clearance_tables import ClearanceTables
from cbagan_ompl.robots.pixel_shape import pixel_shape
from cbagan_ompl.robots.shape_checker import ShapeChecker

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "tests"))
from helpers.dense import DenseCheck, steps_of

RECTANGLE = Robot.rectangle(12, 6)
LENGTHS = (10.0, 30.0)
RADIUS = 6.0
SPACES = {
    "SE2": ob.SE2StateSpace,
    "Dubins": lambda: ob.DubinsStateSpace(RADIUS),
    "Reeds-Shepp": lambda: ob.ReedsSheppStateSpace(RADIUS),
}
ROBOTS = {
    "rectangle": Robot.rectangle(10, 5),
    "car": Robot.rectangle(8, 4, offset=2.5),
    "arrow": Robot.polygon([(0, 0), (6, -3), (2, 0), (6, 3)]),
    "triangle": Robot.polygon([(-3, -2), (5, 0), (-3, 2.5)]),
    "disc": Robot.disc(3.0, turning_radius=RADIUS),
}
# With the iterations after which each ends.
PLANNERS = {"RRT": 400, "RRTConnect": 400, "RRTstar": 120, "KPIECE1": 400}


def new_space(make: Any, grid: GridMap) -> Any:
    space, bounds = make(), ob.RealVectorBounds(2)
    for axis in range(2):
        bounds.setLow(axis, float(grid.bounds[0][axis]))
        bounds.setHigh(axis, float(grid.bounds[1][axis]))
    space.setBounds(bounds)
    return space


def new_state(space: Any, pose: Any) -> tuple[Any, Any]:
    handle = compat.new_state(space)
    state = compat.typed_state(handle)
    state.setX(float(pose[0]))
    state.setY(float(pose[1]))
    state.setYaw(float(pose[2]))
    return handle, state


def random_pose(grid: GridMap, rng: np.random.Generator) -> np.ndarray:
    return rng.uniform((*grid.bounds[0], -pi), (*grid.bounds[1], pi))


def measure_speed(name: str, motions: int, rounds: int, rng: np.random.Generator) -> list[dict]:
    grid = GridMap.load(name)
    space = new_space(ob.SE2StateSpace, grid)
    si = ob.SpaceInformation(space)
    checker = ShapeChecker.of(grid, RECTANGLE)
    validators = GridMotionValidator(si, grid), RobotMotionValidator(si, grid, RECTANGLE)
    rows = []
    for length in LENGTHS:
        pairs = []
        while len(pairs) < motions:
            start, end = random_pose(grid, rng), random_pose(grid, rng)
            if checker.pose_is_free(*start.tolist()):
                angle = rng.uniform(-pi, pi)
                end[:2] = start[:2] + length * np.array((np.cos(angle), np.sin(angle)))
                pairs.append((new_state(space, start), new_state(space, end)))
        times = np.empty((rounds + 1, 2))
        for index in range(rounds + 1):
            for which, validator in enumerate(validators):
                check = validator.checkMotion
                begin = process_time()
                for (_, first), (_, second) in pairs:
                    check(first, second)
                times[index, which] = process_time() - begin
        # The first round makes the tables.
        point, robot = times[1:].min(axis=0) / motions * 1e6
        rows.append(
            {"map": name, "length": length, "point_us": point, "robot_us": robot}
            | {"ratio": robot / point}
        )
    return rows


def measure_tables(side: int) -> dict[str, float]:
    free = np.random.default_rng(0).random((side, side)) > 0.002
    grid = GridMap(free)
    begin = process_time()
    tables = ClearanceTables(grid.free, pixel_shape(RECTANGLE, grid))
    first = process_time() - begin
    for index in range(tables.count):
        tables.make(index)
    every = process_time() - begin
    megabytes = tables.stack.nbytes / 1e6
    return {"first_s": first, "all_s": every, "headings": tables.count, "megabytes": megabytes}


def random_map(rng: np.random.Generator) -> GridMap:
    free = rng.random((60, 80)) >= 0.0008
    for _ in range(int(rng.integers(2, 7))):
        row, column, height, width = rng.integers((0, 0, 2, 2), (60, 80, 16, 16))
        free[row : row + height, column : column + width] = False
    return GridMap(free)


def solve(
    space: Any, grid: GridMap, robot: Robot, planner: str, endpoints: Any
) -> list[np.ndarray] | None:
    """Return the poses that OMPL interpolates along a path, one array a motion; None unsolved."""
    setup = og.SimpleSetup(space)
    si = setup.getSpaceInformation()
    setup.setStateValidityChecker(Validity(si, grid, robot))
    si.setMotionValidator(RobotMotionValidator(si, grid, robot))
    handles = [new_state(space, pose)[0] for pose in endpoints]
    setup.setStartAndGoalStates(*handles, 1.0)
    setup.setPlanner(getattr(og, planner)(si))
    setup.getPlanner().setRange(20.0)
    left = iter(range(PLANNERS[planner]))
    stop = compat.termination_condition(lambda: next(left, None) is None)
    if not compat.is_exact(setup.solve(stop)):
        return None
    handle, state = new_state(space, endpoints[0])
    motions = []
    for first, second in pairwise(setup.getSolutionPath().getStates()):
        length = space.distance(first, second)
        # In SE(2) the heading turns by less than pi, on curves by less than this.
        steps = steps_of(grid, robot, length, max(pi, length / RADIUS))
        poses = np.empty((steps + 1, 3))
        for index in range(steps + 1):
            space.interpolate(first, second, index / steps, state)
            poses[index] = state.getX(), state.getY(), state.getYaw()
        motions.append(poses)
    del handle
    return motions


def check_poses(count: int, rng: np.random.Generator) -> dict[str, int]:
    """Return how many poses the dense test allows, and how many of them the checker refuses."""
    result = {"allowed": 0, "refused": 0, "wrongly_allowed": 0}
    for robot in itertools.islice(itertools.cycle(ROBOTS.values()), count // 100):
        grid = random_map(rng)
        checker = ShapeChecker.of(grid, robot)
        poses = np.array([random_pose(grid, rng) for _ in range(100)])
        is_free = np.array([checker.pose_is_free(*pose) for pose in poses.tolist()])
        collides = DenseCheck(grid, robot).collides(poses)
        result["allowed"] += int((~collides).sum())
        result["refused"] += int((~collides & ~is_free).sum())
        result["wrongly_allowed"] += int((collides & is_free).sum())
    return result


def check_paths(paths: int, rng: np.random.Generator) -> dict[str, int]:
    result = {"solved": 0, "colliding": 0, "unsolved": 0, "poses": 0}
    kinds = itertools.cycle(itertools.product(SPACES, ROBOTS, PLANNERS))
    with tqdm(total=paths, desc="paths") as bar:
        while result["solved"] < paths:
            space_name, robot_name, planner = next(kinds)
            grid, robot = random_map(rng), ROBOTS[robot_name]
            dense = DenseCheck(grid, robot)
            endpoints = [random_pose(grid, rng) for _ in range(2)]
            if dense.collides(np.array(endpoints)).any():
                continue
            space = new_space(SPACES[space_name], grid)
            motions = solve(space, grid, robot, planner, endpoints)
            if motions is None:
                result["unsolved"] += 1
                continue
            result["solved"] += 1
            result["poses"] += sum(map(len, motions))
            result["colliding"] += any(dense.collides(poses).any() for poses in motions)
            bar.update()
    return result


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--map", action="append", default=[], help="map for speed; repeat it")
    parser.add_argument("--motions", type=int, default=3000, help="motions a length and map")
    parser.add_argument("--rounds", type=int, default=7, help="of which the best counts")
    parser.add_argument("--paths", type=int, default=0, help="solved paths to look at")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--json", help="file for the results")
    args = parser.parse_args()
    rng = np.random.default_rng(args.seed)
    compat.seed_ompl(args.seed)
    compat.ou.setLogLevel(compat.ou.LOG_NONE)
    result: dict[str, Any] = {"ompl": compat.ompl_version(), "speed": []}
    for name in args.map:
        result["speed"] += measure_speed(name, args.motions, args.rounds, rng)
    for row in result["speed"]:
        print(
            f"{row['map']}, {row['length']:g} px: point {row['point_us']:.2f} us, robot "
            f"{row['robot_us']:.2f} us, ratio {row['ratio']:.2f}"
        )
    result["tables"] = measure_tables(1024)
    print("tables:", {key: round(value, 3) for key, value in result["tables"].items()})
    if args.paths:
        result["poses"] = check_poses(10 * args.paths, rng)
        print("poses:", result["poses"])
        result["paths"] = check_paths(args.paths, rng)
        print("paths:", result["paths"])
    if args.json:
        write_json(args.json, result)


if __name__ == "__main__":
    main()
