"""Plan for a pose (x, y, yaw): position and heading are sampled from the heat map.

    python examples/se2.py

The robot is a disc here, so that its heading does not matter to collisions. For a robot of another
shape write a validity checker of your own, as in docs/recipes/own-validity-checker.md.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ompl import base as ob
from ompl import geometric as og

import cbagan_ompl

MAP = Path(__file__).parent / "data" / "office.yaml"
START, GOAL = (-1.2, 6.2, 0.0), (9.0, 0.0, 1.57)


def make_state(space: Any, x: float, y: float, yaw: float) -> Any:
    # OMPL 1.7 makes states in Python with ob.State, OMPL 2.0 with allocState.
    state = ob.State(space) if hasattr(ob, "StateValidityCheckerFn") else space.allocState()
    pose = state() if callable(state) else state
    pose.setX(x)
    pose.setY(y)
    pose.setYaw(yaw)
    return state


def main() -> None:
    grid = cbagan_ompl.GridMap.load(MAP).inflated(0.2)

    space = ob.SE2StateSpace()
    bounds = ob.RealVectorBounds(2)
    for axis, (low, high) in enumerate(zip(*grid.bounds, strict=True)):
        bounds.setLow(axis, float(low))
        bounds.setHigh(axis, float(high))
    space.setBounds(bounds)

    setup = og.SimpleSetup(space)
    si = setup.getSpaceInformation()
    setup.setStateValidityChecker(cbagan_ompl.GridValidityChecker(si, grid))
    # Motions of SE2StateSpace are straight in (x, y); those of Dubins and Reeds-Shepp spaces are
    # curves and keep OMPL's own motion validator.
    si.setMotionValidator(cbagan_ompl.GridMotionValidator(si, grid))
    start, goal = make_state(space, *START), make_state(space, *GOAL)
    setup.setStartAndGoalStates(start, goal, 0.1)
    setup.setPlanner(og.RRTstar(si))

    heatmap = cbagan_ompl.load_model().predict(grid, START[:2], GOAL[:2])
    with cbagan_ompl.attach(setup, heatmap, seed=1) as attachment:
        setup.solve(1.0)
        print("samples:", attachment.sample_counts)
    path = setup.getSolutionPath()
    print(f"length: {path.length():.2f}, poses: {path.getStateCount()}")
    for number in range(path.getStateCount()):
        pose = path.getState(number)
        print(f"  {pose.getX():6.2f} {pose.getY():6.2f}  yaw {pose.getYaw():5.2f}")


if __name__ == "__main__":
    main()
