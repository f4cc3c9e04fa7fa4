"""Exact collision checks of a grid map, for OMPL."""

from __future__ import annotations

from collections.abc import Callable
from math import floor
from typing import Any

from ..errors import PlannerError
from ..maps.checks import check_grid
from ..maps.collision import segment_is_free
from ..maps.grid_map import GridMap
from ..robots.robot import Robot
from ..robots.shape_checker import ShapeChecker
from .compat import ob
from .states import StateAccess, has_turning_radius, space_of, state_access

_LAST_VALID_PRECISION = 1e-3


class GridValidityChecker(ob.StateValidityChecker):  # type: ignore[misc]
    """A state is valid when the pixel that its (x, y) lies in is free.

    Args:
        si: the space information.
        grid: the map; inflate it first for a robot with a radius.

    Raises:
        MapError: not a :class:`GridMap`.
        PlannerError: no space information, or the states of its space have no (x, y).

    Example:
        >>> from ompl import base as ob
        >>> from cbagan_ompl import GridMap
        >>> space = ob.RealVectorStateSpace(2)
        >>> space.setBounds(0, 256)
        >>> si = ob.SpaceInformation(space)
        >>> si.setStateValidityChecker(GridValidityChecker(si, GridMap.load("bundled:rooms")))
    """

    def __init__(self, si: Any, grid: GridMap) -> None:
        check_grid(grid)
        self._read = state_access(space_of(si)).read
        super().__init__(si)
        self._cells, self._width, self._height = grid.cells, grid.width, grid.height
        self._affine = tuple(grid.pixel_from_world)
        self._grid = grid
        # Made when first asked for the clearance.
        self._checker: ShapeChecker | None = None

    def isValid(self, state: Any) -> bool:  # noqa: N802
        """Return whether a state is valid: a real ``bool``, as OMPL 2.0 demands."""
        x, y = self._read(state)
        a, b, c, d, e, f = self._affine
        u = a * x + b * y + c
        v = d * x + e * y + f
        if not (0 <= u < self._width and 0 <= v < self._height):
            return False
        return self._cells[floor(v) * self._width + floor(u)] == 1

    def clearance(self, state: Any) -> float:
        """Return the distance from a state to the nearest blocked pixel, world units.

        It is 0 in an invalid state, and infinite on a map without obstacles, whose border is none.
        """
        if self._checker is None:
            self._checker = ShapeChecker.of(self._grid, Robot.point())
        return self._checker.clearance(*self._read(state), 0.0)


class GridMotionValidator(ob.MotionValidator):  # type: ignore[misc]
    """A motion is valid when every pixel that its segment passes through is free.

    One call walks the pixels exactly, corners included
    (:func:`cbagan_ompl.maps.collision.segment_is_free`): no step width, so no wall is too thin.
    It is for spaces whose motions are straight in (x, y), RealVectorStateSpace and SE2StateSpace;
    not for Dubins and Reeds-Shepp curves, where OMPL's own validator with a
    :class:`GridValidityChecker` is the one to use.

    Args:
        si: the space information.
        grid: the map; inflate it first for a robot with a radius.

    Raises:
        MapError: not a :class:`GridMap`.
        PlannerError: no space information, the states of its space have no (x, y), or motions are
            not straight.

    Example:
        >>> from ompl import base as ob
        >>> from cbagan_ompl import GridMap
        >>> space = ob.RealVectorStateSpace(2)
        >>> space.setBounds(0, 256)
        >>> si = ob.SpaceInformation(space)
        >>> si.setMotionValidator(GridMotionValidator(si, GridMap.load("bundled:rooms")))
    """

    def __init__(self, si: Any, grid: GridMap) -> None:
        check_grid(grid)
        self._space = space_of(si)
        self._read = _straight_state_access(self._space).read
        super().__init__(si)
        self._cells, self._width, self._height = grid.cells, grid.width, grid.height
        self._affine = tuple(grid.pixel_from_world)

    def checkMotion(self, s1: Any, s2: Any, *last_valid: Any) -> bool:  # noqa: N802
        """Return whether a motion is valid, as a real ``bool``.

        Args:
            s1: where the motion begins, a valid state.
            s2: where it ends.
            last_valid: on OMPL 1.x, some planners pass a pair of a state and a number, to be set
                to the last valid state (to within a thousandth of the motion) and how far along
                the motion it is.
        """
        x0, y0 = self._read(s1)
        x1, y1 = self._read(s2)
        a, b, c, d, e, f = self._affine
        segment = a * x0 + b * y0 + c, d * x0 + e * y0 + f, a * x1 + b * y1 + c, d * x1 + e * y1 + f
        free = segment_is_free(self._cells, self._width, self._height, *segment)
        if last_valid and not free:
            self._set_last_valid(last_valid[0], s1, s2, segment)
        return free

    def _set_last_valid(
        self, last_valid: Any, s1: Any, s2: Any, segment: tuple[float, float, float, float]
    ) -> None:
        u0, v0, u1, v1 = segment

        def is_free(part: float) -> bool:
            u, v = u0 + part * (u1 - u0), v0 + part * (v1 - v0)
            return segment_is_free(self._cells, self._width, self._height, u0, v0, u, v)

        set_last_valid(last_valid, self._space, s1, s2, is_free)


def set_last_valid(
    last_valid: Any, space: Any, s1: Any, s2: Any, is_free: Callable[[float], bool]
) -> None:
    """Set what a planner of OMPL 1.x wants to know of a motion that is not valid.

    Args:
        last_valid: pair of a state, or None, and a number: the last valid state, to within a
            thousandth of the motion, and how far along the motion it is.
        space: of the states.
        s1: where the motion begins, a valid state.
        s2: where it ends.
        is_free: whether the motion up to a fraction of it is valid.
    """
    low, high = 0.0, 1.0
    while high - low > _LAST_VALID_PRECISION:
        middle = (low + high) / 2
        if is_free(middle):
            low = middle
        else:
            high = middle
    last_valid.second = low
    if last_valid.first is not None:
        space.interpolate(s1, s2, low, last_valid.first)


def _straight_state_access(space: Any) -> StateAccess:
    if has_turning_radius(space):
        raise PlannerError(
            f"GridMotionValidator checks straight motions, those of {type(space).__name__} are "
            "curves: keep OMPL's own motion validator, with a GridValidityChecker and "
            "si.setStateValidityCheckingResolution(pixel length / si.getMaximumExtent())"
        )
    return state_access(space)
