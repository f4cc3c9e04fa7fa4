"""A plain OMPL script, and the three lines that give its planner the learned sampler.

    python examples/plain_ompl_script.py

The validity checker, the space and the planner are the script's own. Only the lines under the
comment "The learned sampler" are new.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import cv2
from ompl import base as ob
from ompl import geometric as og

import cbagan_ompl

MAP = Path(__file__).parent / "data" / "office.pgm"
START, GOAL = (16.0, 16.0), (220.0, 140.0)

image = cv2.imread(str(MAP), cv2.IMREAD_GRAYSCALE)
height, width = image.shape


def is_valid(state: Any) -> bool:
    x, y = int(state[0]), int(state[1])
    return 0 <= x < width and 0 <= y < height and bool(image[y, x] > 127)


def make_state(space: Any, x: float, y: float) -> Any:
    # OMPL 1.7 makes states in Python with ob.State, OMPL 2.0 with allocState.
    state = ob.State(space) if hasattr(ob, "StateValidityCheckerFn") else space.allocState()
    state[0], state[1] = x, y
    return state


def main() -> None:
    space = ob.RealVectorStateSpace(2)
    bounds = ob.RealVectorBounds(2)
    bounds.setLow(0)
    bounds.setHigh(0, width)
    bounds.setHigh(1, height)
    space.setBounds(bounds)
    setup = og.SimpleSetup(space)
    # OMPL 1.7 wraps the function, OMPL 2.0 takes it as it is.
    wrap = getattr(ob, "StateValidityCheckerFn", lambda function: function)
    setup.setStateValidityChecker(wrap(is_valid))
    # OMPL's default step is 1 % of the diagonal: too long for thin walls. This one is a pixel.
    si = setup.getSpaceInformation()
    si.setStateValidityCheckingResolution(1 / si.getMaximumExtent())
    start, goal = make_state(space, *START), make_state(space, *GOAL)
    setup.setStartAndGoalStates(start, goal)
    setup.setPlanner(og.RRTstar(si))

    # The learned sampler:
    grid = cbagan_ompl.GridMap.load(MAP)
    heatmap = cbagan_ompl.load_model().predict(grid, START, GOAL)
    attachment = cbagan_ompl.attach(setup, heatmap)

    setup.solve(1.0)
    print("length:", round(setup.getSolutionPath().length(), 1))
    print("hook:", attachment.hook)
    print("samples:", attachment.sample_counts)
    attachment.detach()


if __name__ == "__main__":
    main()
