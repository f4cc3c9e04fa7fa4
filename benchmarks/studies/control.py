"""Planning with controls: a kinematic car and a second-order one, with learned samples and without.

    python benchmarks/studies/control.py --json benchmarks/results/control_ompl_2.0.1.json
    python benchmarks/studies/control.py --maps MAPS/png/*.png --tasks MAPS/tasks.csv --json FILE

Planners of ompl.control on generated maps, or on those given, the longest tasks for the car. Times
are CPU seconds of the thread until the first path, inference and attaching included. Each run is a
line of ``--rows`` as soon as it has ended; a run that is there already is not done again.
"""

from __future__ import annotations

import argparse
from collections import defaultdict
from collections.abc import Callable, Iterator
from math import cos, inf, pi, sin
from time import thread_time
from typing import Any

import numpy as np
from ompl import base as ob
from ompl import control as oc
from ompl import util as ou
from pose_runs import PoseTask, generated_tasks, pose_task
from run_rows import RunRows

from cbagan_ompl import (
    GridMap,
    HeadingSpread,
    Robot,
    RobotValidityChecker,
    attach,
    load_model,
    tasks_of,
)
from cbagan_ompl.common.files import write_json
from cbagan_ompl.maps.tasks import load_tasks
from cbagan_ompl.planning import compat

# Pixels and seconds: the car, its fastest speed and sharpest turn, and the step of its motion.
CAR = Robot.rectangle(6, 3)
SPEED, CURVATURE, STEP, MOST_STEPS, TOLERANCE = 4.0, 0.25, 0.5, 20, 8.0
# Of the second-order car: acceleration, and how fast the curvature changes.
ACCELERATION, STEERING = 2.0, 0.2
SAMPLERS: dict[str, HeadingSpread | None] = {
    "OMPL's own": None,
    "positions only": HeadingSpread(uniform_fraction=1),
    "learned": HeadingSpread(),
}


def file_tasks(args: argparse.Namespace) -> Iterator[PoseTask]:
    """Yield the few tasks on each map that are the longest for the car."""
    for word in args.maps:
        grid = GridMap.load(word)
        wide = grid.inflated(CAR.inscribed_radius)
        tasks = load_tasks(args.tasks, grid) if args.tasks else tasks_of(word, grid)
        poses = [
            pose_task(f"{grid.name}-{number}", grid, wide, task.start, task.goal, CAR)
            for number, task in enumerate(tasks)
        ]
        fitting = [task for task in poses if task is not None]
        yield from sorted(fitting, key=lambda task: -task.length)[: args.tasks_per_map]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--maps", nargs="+", metavar="MAP", help="files, or bundled:NAME")
    parser.add_argument("--tasks", metavar="FILE", help="tasks on the maps (CSV)")
    parser.add_argument("--tasks-per-map", type=int, default=1)
    parser.add_argument("--count", type=int, default=6, help="tasks on generated maps")
    parser.add_argument("--cars", default=",".join(CARS))
    parser.add_argument("--planners", default="RRT")
    parser.add_argument("--samplers", default="OMPL's own,learned", help="also: positions only")
    parser.add_argument("--controls", type=int, help="that are tried for each sample (OMPL 1.7)")
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--time", type=float, default=2.0, help="CPU seconds of a run")
    parser.add_argument("--rows", metavar="FILE", default="control.jsonl")
    parser.add_argument("--json", metavar="FILE")
    args = parser.parse_args()
    ou.setLogLevel(ou.LOG_NONE)
    tasks = list(file_tasks(args) if args.maps else generated_tasks(args.count))
    predictor = load_model()
    predictor.predict(tasks[0].grid, tasks[0].start[:2], tasks[0].goal[:2])  # the first is slower
    done = RunRows(args.rows)
    for seed in range(args.seeds):
        for task in tasks:
            for car in args.cars.split(","):
                for planner in args.planners.split(","):
                    for sampler in args.samplers.split(","):
                        key = (car, planner, sampler, task.name, seed)
                        if key not in done.keys:
                            done.add(key, measure(task, key, predictor, args))
    names = {task.name for task in tasks}
    summary = summarise([row for row in done.rows if row["key"][3] in names], args.time)
    for line in summary:
        print(line)
    if args.json is not None:
        settings = {"time": args.time, "seeds": args.seeds, "tasks": len(tasks)}
        write_json(args.json, {"ompl": compat.ompl_version(), **settings, "rows": summary})


def measure(
    task: PoseTask, key: tuple[Any, ...], predictor: Any, args: argparse.Namespace
) -> dict[str, Any]:
    """Return the time to the first path, None without one, and what was sampled."""
    car, planner, sampler, _, seed = key
    compat.seed_ompl(seed)
    setup = make_setup(task, CARS[car], planner, args.controls)
    spread = SAMPLERS[sampler]
    counts: dict[str, int] = {}
    began = thread_time()
    attachment = None
    if spread is not None:
        heatmap = predictor.predict(task.grid, task.start[:2], task.goal[:2], robot=CAR)
        attachment = attach(setup, heatmap, seed=seed, heading=spread)
    inference = thread_time() - began
    problem = setup.getProblemDefinition()
    # SST goes on after its first path, and does not tell of it before it ends.
    end = thread_time() + args.time
    status = setup.solve(compat.termination_condition(lambda: thread_time() >= end))
    seconds = thread_time() - began
    if attachment is not None:
        counts = attachment.sample_counts
        attachment.detach()
    is_solved = compat.is_exact(status) and problem.hasExactSolution()
    return {"s": seconds if is_solved else None, "inference": inference, "samples": counts}


def make_setup(
    task: PoseTask, car: Callable[[Any], tuple[Any, Any, Any]], planner: str, controls: int | None
) -> Any:
    poses = ob.SE2StateSpace()
    bounds = ob.RealVectorBounds(2)
    for axis, (low, high) in enumerate(zip(*task.grid.bounds, strict=True)):
        bounds.setLow(axis, float(low))
        bounds.setHigh(axis, float(high))
    poses.setBounds(bounds)
    space, control_space, propagate = car(poses)
    setup = oc.SimpleSetup(control_space)
    si = setup.getSpaceInformation()
    setup.setStateValidityChecker(RobotValidityChecker(si, task.grid, CAR))
    setup.setStatePropagator(getattr(oc, "StatePropagatorFn", lambda same: same)(propagate))
    si.setPropagationStepSize(STEP)
    si.setMinMaxControlDuration(1, MOST_STEPS)
    if controls is not None:
        si.setDirectedControlSamplerAllocator(
            oc.DirectedControlSamplerAllocator(
                lambda si: oc.SimpleDirectedControlSampler(si, controls)
            )
        )
    start, goal = make_state(space, task.start), make_state(space, task.goal)
    setup.setStartAndGoalStates(start, goal, TOLERANCE)
    setup.setPlanner(getattr(oc, planner)(si))
    return setup


def kinematic_car(poses: Any) -> tuple[Any, Any, Any]:
    """Return state space, control space (speed, curvature) and propagator of a car."""
    controls = oc.RealVectorControlSpace(poses, 2)
    controls.setBounds(real_bounds((0.5, SPEED), (-CURVATURE, CURVATURE)))

    def propagate(state: Any, control: Any, duration: float, result: Any) -> None:
        way = control[0] * duration
        drive(state, way, control[1] * way, result)

    return poses, controls, propagate


def second_order_car(poses: Any) -> tuple[Any, Any, Any]:
    """Return the same of a car whose state has the speed and the curvature as well."""
    motion = ob.RealVectorStateSpace(2)
    motion.setBounds(real_bounds((0.0, SPEED), (-CURVATURE, CURVATURE)))
    space = ob.CompoundStateSpace()
    space.addSubspace(poses, 1.0)
    space.addSubspace(motion, 0.1)
    controls = oc.RealVectorControlSpace(space, 2)
    controls.setBounds(real_bounds((-ACCELERATION, ACCELERATION), (-STEERING, STEERING)))

    def propagate(state: Any, control: Any, duration: float, result: Any) -> None:
        speed, curvature = state[1][0], state[1][1]
        faster = min(max(speed + control[0] * duration, 0.0), SPEED)
        sharper = min(max(curvature + control[1] * duration, -CURVATURE), CURVATURE)
        way = (speed + faster) / 2 * duration
        drive(state[0], way, (curvature + sharper) / 2 * way, result[0])
        result[1][0], result[1][1] = faster, sharper

    return space, controls, propagate


CARS = {"kinematic car": kinematic_car, "second-order car": second_order_car}


def drive(pose: Any, way: float, turn: float, result: Any) -> None:
    """Drive a way along an arc, by its chord."""
    yaw = pose.getYaw()
    middle = yaw + turn / 2
    x, y = pose.getX() + way * cos(middle), pose.getY() + way * sin(middle)
    result.setX(x)
    result.setY(y)
    result.setYaw((yaw + turn + pi) % (2 * pi) - pi)


def real_bounds(*limits: tuple[float, float]) -> Any:
    bounds = ob.RealVectorBounds(len(limits))
    for axis, (low, high) in enumerate(limits):
        bounds.setLow(axis, low)
        bounds.setHigh(axis, high)
    return bounds


def make_state(space: Any, pose: tuple[float, float, float]) -> Any:
    state = compat.new_state(space)
    typed = compat.typed_state(state)
    is_plain = isinstance(space, ob.SE2StateSpace)
    part = typed if is_plain else typed[0]
    part.setX(pose[0])
    part.setY(pose[1])
    part.setYaw(pose[2])
    if not is_plain:
        typed[1][0] = typed[1][1] = 0.0
    return state


def summarise(done: list[dict[str, Any]], limit: float) -> list[dict[str, Any]]:
    """Return success, quartiles in ms and ratios to OMPL's own, by car, planner and sampler."""
    groups: dict[tuple[str, ...], dict[str, list[float]]] = defaultdict(lambda: defaultdict(list))
    for row in done:
        car, planner, sampler, task, _ = row["key"]
        groups[car, planner, sampler][task].append(inf if row["s"] is None else row["s"])
    summary = []
    for (car, planner, sampler), tasks in groups.items():
        own = groups[car, planner, "OMPL's own"]
        times = np.array([time for runs in tasks.values() for time in runs])
        # A run without a path counts with the limit.
        capped = {t: np.median(np.minimum(runs, limit)) for t, runs in tasks.items()}
        ratios = [v / np.median(np.minimum(own[t], limit)) for t, v in capped.items()]
        values = np.percentile(times, (25, 50, 75), method="nearest").tolist()
        summary.append(
            {
                "car": car,
                "planner": planner,
                "sampler": sampler,
                "runs": len(times),
                "solved": round(float(np.isfinite(times).mean()), 3),
                "first_ms": [round(1e3 * v, 1) if np.isfinite(v) else None for v in values],
                "ratio": round(float(np.median(ratios)), 3),
            }
        )
    return summary


if __name__ == "__main__":
    main()
