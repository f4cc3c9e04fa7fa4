"""Reading and writing the (x, y) of an OMPL state: the only code that knows the kinds of space."""

from __future__ import annotations

from math import pi
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ..errors import PlannerError, show
from .compat import ob


class StateAccess(Protocol):
    """Access to the position in the states of one kind of space."""

    def read(self, state: Any) -> tuple[float, float]:
        """Return the (x, y) of a state."""

    def write(self, state: Any, x: float, y: float) -> None:
        """Set the position of a state to a sample; anything else in the state becomes uniform.

        Args:
            state: a state of the space, changed in place.
            x: of the sample, world.
            y: of the sample, world.
        """


class PlaneStateAccess:
    """Access to states of a RealVectorStateSpace of dimension 2."""

    @staticmethod
    def read(state: Any) -> tuple[float, float]:
        """Return the (x, y) of a state."""
        return state[0], state[1]

    @staticmethod
    def write(state: Any, x: float, y: float) -> None:
        """Set (x, y); arguments as for :meth:`StateAccess.write`."""
        state[0] = x
        state[1] = y


class PoseStateAccess:
    """Access to states of SE2StateSpace, DubinsStateSpace and ReedsSheppStateSpace.

    Args:
        seed: seed or generator of the headings, which are uniform.
    """

    def __init__(self, seed: int | np.random.Generator | None = None) -> None:
        self._rng = np.random.default_rng(seed)

    @staticmethod
    def read(state: Any) -> tuple[float, float]:
        """Return the (x, y) of a state."""
        return state.getX(), state.getY()

    def write(self, state: Any, x: float, y: float) -> None:
        """Set (x, y) and sample a heading; arguments as for :meth:`StateAccess.write`."""
        state.setX(x)
        state.setY(y)
        state.setYaw(float(self._rng.uniform(-pi, pi)))


def state_access(space: Any, seed: int | np.random.Generator | None = None) -> StateAccess:
    """Return the access that fits a state space.

    Args:
        space: an OMPL state space.
        seed: seed or generator for the parts of a state that the heat map says nothing about.

    Raises:
        PlannerError: no state space, or one whose states have no (x, y).
    """
    if not isinstance(space, ob.StateSpace):
        raise PlannerError(f"expected a state space of ompl.base, got {show(space)}")
    if isinstance(space, ob.SE2StateSpace):
        return PoseStateAccess(seed)
    if isinstance(space, ob.RealVectorStateSpace) and space.getDimension() == 2:
        return PlaneStateAccess()
    raise PlannerError(
        "a 2-D heat map serves RealVectorStateSpace(2), SE2StateSpace, DubinsStateSpace and "
        f"ReedsSheppStateSpace, not {type(space).__name__} of dimension {space.getDimension()}"
    )


def read_pose(state: Any) -> tuple[float, float, float]:
    """Return the (x, y, yaw) of a state of an SE2StateSpace."""
    return state.getX(), state.getY(), state.getYaw()


def space_of(si: Any) -> Any:
    """Return the state space of a space information.

    Raises:
        PlannerError: it is none.
    """
    if not isinstance(si, ob.SpaceInformation):
        raise PlannerError(f"expected a SpaceInformation of ompl.base, got {show(si)}")
    return si.getStateSpace()


def position_bounds(space: Any) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the lower and upper bounds of positions in a space, (2,) each, world.

    Args:
        space: one that :func:`state_access` serves.
    """
    bounds = space.getBounds()
    return np.array(list(bounds.low)[:2]), np.array(list(bounds.high)[:2])
