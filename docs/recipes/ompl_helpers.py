"""What the recipes need to run on OMPL 2.0 as well as on 1.7."""

from ompl import base as ob


def make_state(space, *values):
    """Return a state of a plane (x, y) or of SE(2) (x, y, yaw)."""
    # OMPL 1.7 makes states in Python with ob.State, OMPL 2.0 with allocState.
    state = ob.State(space) if hasattr(ob, "StateValidityCheckerFn") else space.allocState()
    if len(values) == 2:
        state[0], state[1] = map(float, values)
    else:
        pose = state() if callable(state) else state
        pose.setX(float(values[0]))
        pose.setY(float(values[1]))
        pose.setYaw(float(values[2]))
    return state


def set_bounds(space, grid):
    """Let the positions of a space range over a map."""
    bounds = ob.RealVectorBounds(2)
    for axis, (low, high) in enumerate(zip(*grid.bounds, strict=True)):
        bounds.setLow(axis, float(low))
        bounds.setHigh(axis, float(high))
    space.setBounds(bounds)


def validity_checker(function):
    """Return what setStateValidityChecker takes for a Python function."""
    # OMPL 1.7 wraps the function, OMPL 2.0 takes it as it is.
    return getattr(ob, "StateValidityCheckerFn", lambda same: same)(function)
