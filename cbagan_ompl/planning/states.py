"""Reading and writing the (x, y) of an OMPL state: the only code that knows the kinds of space."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ..errors import PlannerError, show
from ..sampling.headings import HeadingSampler
from .compat import ob
from .typed_states import TypedStates


class StateAccess(Protocol):
    """Access to the position in the states of one kind of space."""

    def read(self, state: Any) -> tuple[float, float]:
        """Return the (x, y) of a state."""

    def read_pose(self, state: Any) -> tuple[float, float, float]:
        """Return the (x, y, yaw) of a state; the yaw is 0 where states have none."""

    def write(self, state: Any, x: float, y: float) -> None:
        """Set the position of a state to a sample; anything else in the state becomes uniform.

        Args:
            state: a state of the space, changed in place.
            x: of the sample, world.
            y: of the sample, world.
        """

    def write_pose(self, state: Any, x: float, y: float, yaw: float) -> None:
        """Set the pose of a state, or the position where states have no yaw.

        Args:
            state: a state of the space, changed in place.
            x: of the position, world.
            y: of the position, world.
            yaw: radians.
        """

    def follows_heatmap(self, state: Any) -> bool:
        """Return whether a state goes about the way of the heat map, as far as that is known."""


class PlaneStateAccess:
    """Access to states of a RealVectorStateSpace of dimension 2.

    Args:
        space: the space.
    """

    def __init__(self, space: Any) -> None:
        self._typed = TypedStates(space)
        self._type = self._typed.type

    def read(self, state: Any) -> tuple[float, float]:
        """Return the (x, y) of a state."""
        if type(state) is not self._type:
            state = self._typed.readable(state)
        return state[0], state[1]

    def read_pose(self, state: Any) -> tuple[float, float, float]:
        """Return the (x, y) of a state and the yaw 0."""
        return *self.read(state), 0.0

    def write(self, state: Any, x: float, y: float) -> None:
        """Set (x, y); arguments as for :meth:`StateAccess.write`."""
        changed = self._typed.readable(state)
        changed[0] = x
        changed[1] = y
        self._typed.replace(state, changed)

    def write_pose(self, state: Any, x: float, y: float, yaw: float) -> None:
        """Set (x, y); arguments as for :meth:`StateAccess.write_pose`, without a yaw to be set."""
        self.write(state, x, y)

    def follows_heatmap(self, state: Any) -> bool:
        """Return True: positions have no heading."""
        return True


class PoseStateAccess:
    """Access to states of SE2StateSpace, DubinsStateSpace and ReedsSheppStateSpace.

    Args:
        space: the space.
        headings: samples the heading at a position; None for reading alone.
    """

    def __init__(self, space: Any, headings: HeadingSampler | None) -> None:
        self._typed = TypedStates(space)
        self._type = self._typed.type
        self._headings = headings

    def read(self, state: Any) -> tuple[float, float]:
        """Return the (x, y) of a state."""
        if type(state) is not self._type:
            state = self._typed.readable(state)
        return state.getX(), state.getY()

    def read_pose(self, state: Any) -> tuple[float, float, float]:
        """Return the (x, y, yaw) of a state."""
        if type(state) is not self._type:
            state = self._typed.readable(state)
        return state.getX(), state.getY(), state.getYaw()

    def write(self, state: Any, x: float, y: float) -> None:
        """Set (x, y) and sample a heading; arguments as for :meth:`StateAccess.write`."""
        assert self._headings is not None, "this access samples no headings"
        self.write_pose(state, x, y, self._headings.sample(x, y))

    def write_pose(self, state: Any, x: float, y: float, yaw: float) -> None:
        """Set the pose; arguments as for :meth:`StateAccess.write_pose`."""
        changed = self._typed.readable(state)
        changed.setX(x)
        changed.setY(y)
        changed.setYaw(yaw)
        self._typed.replace(state, changed)

    def follows_heatmap(self, state: Any) -> bool:
        """Return whether the heading of a state is about that of the heat map, or none is known."""
        return self._headings is None or self._headings.are_followed(*self.read_pose(state))


class CompoundStateAccess:
    """Access to states of a CompoundStateSpace whose first part has the positions.

    The other parts of a sample come from their own samplers, uniform.

    Args:
        space: the space.
        first: access to the states of its first part.
    """

    def __init__(self, space: Any, first: StateAccess) -> None:
        self._first = first
        self._typed = TypedStates(space)
        self._space = space  # keeps the parts alive, which their samplers refer to
        self._others = [
            (part, space.getSubspace(part).allocDefaultStateSampler())
            for part in range(1, space.getSubspaceCount())
        ]

    def read(self, state: Any) -> tuple[float, float]:
        """Return the (x, y) of a state."""
        return self._first.read(self._typed.readable(state)[0])

    def read_pose(self, state: Any) -> tuple[float, float, float]:
        """Return the (x, y, yaw) of a state."""
        return self._first.read_pose(self._typed.readable(state)[0])

    def write(self, state: Any, x: float, y: float) -> None:
        """Set (x, y), sample everything else; arguments as for :meth:`StateAccess.write`."""
        changed = self._typed.readable(state)
        self._first.write(changed[0], x, y)
        for part, sampler in self._others:
            sampler.sampleUniform(changed[part])
        self._typed.replace(state, changed)

    def write_pose(self, state: Any, x: float, y: float, yaw: float) -> None:
        """Set the first part alone; arguments as for :meth:`StateAccess.write_pose`."""
        changed = self._typed.readable(state)
        self._first.write_pose(changed[0], x, y, yaw)
        self._typed.replace(state, changed)

    def follows_heatmap(self, state: Any) -> bool:
        """Return whether the first part does."""
        return self._first.follows_heatmap(self._typed.readable(state)[0])


def state_access(space: Any, headings: HeadingSampler | None = None) -> StateAccess:
    """Return the access that fits a state space.

    Args:
        space: an OMPL state space.
        headings: samples the headings of poses; None for reading alone.

    Raises:
        PlannerError: no state space, or one whose states have no (x, y).
    """
    if not isinstance(space, ob.StateSpace):
        raise PlannerError(f"expected a state space of ompl.base, got {show(space)}")
    part = position_space(space)
    if part is None:
        raise PlannerError(
            "a 2-D map serves RealVectorStateSpace(2), SE2StateSpace, DubinsStateSpace, "
            "ReedsSheppStateSpace and compound spaces whose first part is one of them, not "
            f"{type(space).__name__} of dimension {space.getDimension()}"
        )
    has_heading = isinstance(part, ob.SE2StateSpace)
    access: StateAccess = PoseStateAccess(part, headings) if has_heading else PlaneStateAccess(part)
    return access if part is space else CompoundStateAccess(space, access)


def position_space(space: Any) -> Any:
    """Return the space of positions or poses that a space is or holds as its first part.

    Args:
        space: an OMPL state space.

    Returns:
        A RealVectorStateSpace(2) or an SE2StateSpace; None without one.
    """
    if isinstance(space, ob.SE2StateSpace):  # a compound space itself
        return space
    is_compound = isinstance(space, ob.CompoundStateSpace) and space.getSubspaceCount()
    part = space.getSubspace(0) if is_compound else space
    is_plane = isinstance(part, ob.RealVectorStateSpace) and part.getDimension() == 2
    return part if is_plane or isinstance(part, ob.SE2StateSpace) else None


def pose_space(space: Any) -> Any:
    """Return the SE2StateSpace that a space is or holds as its first part; None without one.

    Args:
        space: an OMPL state space.
    """
    part = position_space(space)
    return part if isinstance(part, ob.SE2StateSpace) else None


def is_distance_bound(space: Any) -> bool:
    """Return whether no distance in a space is below the Euclidean one of the positions.

    It is so in the plane and along Dubins and Reeds-Shepp curves. In other spaces of poses OMPL
    adds the distances of the parts of a state, each times a weight: positions weigh 1 unless the
    user has set another one.

    Args:
        space: one that :func:`state_access` serves.
    """
    part = position_space(space)
    weight = 1.0 if part is space else space.getSubspaceWeight(0)
    if isinstance(part, ob.SE2StateSpace) and not has_turning_radius(part):
        weight *= part.getSubspaceWeight(0)
    return bool(weight >= 1)


def has_turning_radius(space: Any) -> bool:
    """Return whether motions in a space are curves of a robot that cannot turn on the spot.

    Args:
        space: an OMPL state space.
    """
    return isinstance(pose_space(space), ob.DubinsStateSpace | ob.ReedsSheppStateSpace)


def drives_backwards(space: Any) -> bool:
    """Return whether motions in a space go backwards as well as forwards.

    Args:
        space: an OMPL state space.
    """
    return isinstance(pose_space(space), ob.ReedsSheppStateSpace)


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
    bounds = position_space(space).getBounds()
    return np.array(list(bounds.low)[:2]), np.array(list(bounds.high)[:2])
