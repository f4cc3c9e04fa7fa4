"""Plan with controls: a car with a speed and a curvature, planned by ompl.control's RRT.

    python examples/control_kinematic_car.py

The state is a pose (x, y, yaw), the control a speed and a curvature. How a control moves the car
is written here, in `drive`; the heat map only says where samples go.
"""

from __future__ import annotations

from math import cos, pi, sin
from typing import Any

from ompl import base as ob
from ompl import control as oc

import cbagan_ompl

START, GOAL = (20.0, 20.0, 0.0), (235.0, 235.0, 0.0)  # pixels and radians
ROBOT = cbagan_ompl.Robot.rectangle(6, 3)


def drive(state: Any, control: Any, duration: float, result: Any) -> None:
    """Move along an arc for a while: what OMPL calls a state propagator."""
    way, yaw = control[0] * duration, state.getYaw()
    turn = control[1] * way
    x, y = state.getX() + way * cos(yaw + turn / 2), state.getY() + way * sin(yaw + turn / 2)
    result.setX(x)
    result.setY(y)
    result.setYaw((yaw + turn + pi) % (2 * pi) - pi)


def make_bounds(*limits: tuple[float, float]) -> Any:
    bounds = ob.RealVectorBounds(len(limits))
    for axis, (low, high) in enumerate(limits):
        bounds.setLow(axis, float(low))
        bounds.setHigh(axis, float(high))
    return bounds


def make_state(space: Any, x: float, y: float, yaw: float) -> Any:
    # OMPL 1.7 makes states in Python with ob.State, OMPL 2.0 with allocState.
    state = ob.State(space) if hasattr(ob, "StateValidityCheckerFn") else space.allocState()
    pose = state() if callable(state) else state
    pose.setX(x)
    pose.setY(y)
    pose.setYaw(yaw)
    return state


def main() -> None:
    grid = cbagan_ompl.GridMap.load("bundled:rooms")
    space = ob.SE2StateSpace()
    space.setBounds(make_bounds(*zip(*grid.bounds, strict=True)))
    controls = oc.RealVectorControlSpace(space, 2)
    controls.setBounds(make_bounds((0.5, 4.0), (-0.25, 0.25)))  # speed, curvature

    setup = oc.SimpleSetup(controls)
    si = setup.getSpaceInformation()
    setup.setStateValidityChecker(cbagan_ompl.RobotValidityChecker(si, grid, ROBOT))
    # OMPL 1.7 wraps the function, OMPL 2.0 takes it as it is.
    setup.setStatePropagator(getattr(oc, "StatePropagatorFn", lambda same: same)(drive))
    si.setPropagationStepSize(0.5)  # states are checked this often
    si.setMinMaxControlDuration(1, 20)  # steps for which a control is held
    setup.setStartAndGoalStates(make_state(space, *START), make_state(space, *GOAL), 8.0)
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
