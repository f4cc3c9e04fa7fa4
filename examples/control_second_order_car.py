"""Plan with controls for a car that has to accelerate: its state has a speed and a curvature too.

    python examples/control_second_order_car.py

The state is a pose and (speed, curvature), a compound space that holds the pose first; the control
is how fast both change. Position and heading of a sample come from the heat map, speed and
curvature are uniform.
"""

from __future__ import annotations

from math import cos, pi, sin
from typing import Any

from ompl import base as ob
from ompl import control as oc

import cbagan_ompl

START, GOAL = (30.0, 30.0, 0.7), (120.0, 110.0, 0.7)  # pixels and radians
ROBOT = cbagan_ompl.Robot.rectangle(6, 3)
SPEED, CURVATURE = 4.0, 0.25  # at most


def drive(state: Any, control: Any, duration: float, result: Any) -> None:
    """Change speed and curvature, and move along an arc with the mean of both."""
    speed, curvature = state[1][0], state[1][1]
    faster = min(max(speed + control[0] * duration, 0.0), SPEED)
    sharper = min(max(curvature + control[1] * duration, -CURVATURE), CURVATURE)
    way, yaw = (speed + faster) / 2 * duration, state[0].getYaw()
    turn = (curvature + sharper) / 2 * way
    x = state[0].getX() + way * cos(yaw + turn / 2)
    y = state[0].getY() + way * sin(yaw + turn / 2)
    result[0].setX(x)
    result[0].setY(y)
    result[0].setYaw((yaw + turn + pi) % (2 * pi) - pi)
    result[1][0], result[1][1] = faster, sharper


def make_bounds(*limits: tuple[float, float]) -> Any:
    bounds = ob.RealVectorBounds(len(limits))
    for axis, (low, high) in enumerate(limits):
        bounds.setLow(axis, float(low))
        bounds.setHigh(axis, float(high))
    return bounds


def make_space(grid: cbagan_ompl.GridMap) -> Any:
    poses, motion = ob.SE2StateSpace(), ob.RealVectorStateSpace(2)
    poses.setBounds(make_bounds(*zip(*grid.bounds, strict=True)))
    motion.setBounds(make_bounds((0.0, SPEED), (-CURVATURE, CURVATURE)))
    space = ob.CompoundStateSpace()
    space.addSubspace(poses, 1.0)
    space.addSubspace(motion, 0.1)  # how much it counts in distances
    return space


def make_state(space: Any, x: float, y: float, yaw: float) -> Any:
    # OMPL 1.7 makes states in Python with ob.State, OMPL 2.0 with allocState.
    state = ob.State(space) if hasattr(ob, "StateValidityCheckerFn") else space.allocState()
    values = state() if callable(state) else state
    values[0].setX(x)
    values[0].setY(y)
    values[0].setYaw(yaw)
    values[1][0] = values[1][1] = 0.0  # at rest
    return state


def main() -> None:
    grid = cbagan_ompl.GridMap.load("bundled:clutter")
    space = make_space(grid)
    controls = oc.RealVectorControlSpace(space, 2)
    controls.setBounds(make_bounds((-2.0, 2.0), (-0.2, 0.2)))  # their change in a second

    setup = oc.SimpleSetup(controls)
    si = setup.getSpaceInformation()
    setup.setStateValidityChecker(cbagan_ompl.RobotValidityChecker(si, grid, ROBOT))
    # OMPL 1.7 wraps the function, OMPL 2.0 takes it as it is.
    setup.setStatePropagator(getattr(oc, "StatePropagatorFn", lambda same: same)(drive))
    si.setPropagationStepSize(0.5)
    si.setMinMaxControlDuration(1, 20)
    setup.setStartAndGoalStates(make_state(space, *START), make_state(space, *GOAL), 12.0)
    setup.setPlanner(oc.RRT(si))

    heatmap = cbagan_ompl.load_model().predict(grid, START, GOAL, robot=ROBOT)
    with cbagan_ompl.attach(setup, heatmap, seed=1) as attachment:
        setup.solve(20.0)
        print("hook:", attachment.hook, "samples:", attachment.sample_counts)
    path = setup.getSolutionPath()
    print("exact:", setup.haveExactSolutionPath())
    print(f"controls: {path.getControlCount()}, states: {path.getStateCount()}")


if __name__ == "__main__":
    main()
