"""Exact checks of a shape on a map: poses, motions and clearance."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from math import cos, hypot, pi, sin
from typing import Any

import numpy as np

from ..maps.grid_map import GridMap
from .clearance import ShapeClearance
from .clearance_tables import BLOCKED, CLEAR, STEP, UNKNOWN, ClearanceTables
from .pieces import CONSERVATISM, WORTH_A_TEST, pieces_are_free
from .pixel_shape import PixelShape, pixel_shape
from .robot import Robot
from .row_runs import Region, region_is_free, row_runs

#: A pose (u, v, heading) in the frame of the pixels.
Pose = tuple[float, float, float]
#: The pose of a motion at a parameter from 0 to 1.
PoseAt = Callable[[float], Pose]

_TURN = 2 * pi

# A table is worth its time after more uses where exact tests are compiled.
_COMPILED_USES = 500.0

# What only touches the edge of a pixel touches the pixel, and the rounding of a coordinate must
# not hide it: a margin of the shape, in pixels. Points have none, see `region_is_free`.
_ROUNDING = 1e-9

# Where a motion is looked at first, as fractions of it: at its end, where motions often fail.
_FIRST_LOOKS = (0.5, 1.0)

# Least movement between two looks at a motion where the tables do not know, in pixels.
_LOOK = 1.0


class ShapeChecker:
    """Checks of one robot on one map, without OMPL.

    A pose is free when no point of the shape is in a blocked pixel or outside of the map; contact
    counts. A motion is free when all of its poses are. Most are decided by tables
    (:class:`.clearance_tables.ClearanceTables`): a look-up for a pose, a few for a motion, each
    of which says how far the shape may move until the next one. What they leave open is decided
    by the shape itself: the convex hull of each of its parts at both ends of a piece of the motion
    is tested against the runs of free pixels in each row, and the piece is halved until the hull
    is as good as exact.

    Args:
        grid: the map.
        robot: what moves.

    Raises:
        RobotError: the robot is larger than the map.

    Example:
        >>> checker = ShapeChecker(GridMap([[1] * 30] * 20), Robot.rectangle(8, 4))
        >>> checker.pose_is_free(5, 5, 0.0), checker.pose_is_free(3, 5, 0.0)
        (True, False)
    """

    def __init__(self, grid: GridMap, robot: Robot) -> None:
        self.grid, self.robot = grid, robot
        self.shape: PixelShape = pixel_shape(robot, grid)
        self.tables = ClearanceTables(grid.free, self.shape)
        self._runs = row_runs(grid.free)
        self._affine = tuple(grid.pixel_from_world)
        self._parts = [part.tolist() for part in self.shape.parts]
        self._rounding = 0.0 if len(self._parts[0]) == 1 else _ROUNDING
        self._per_radian = self.tables.count / _TURN
        self._compiled: Any = None
        self._find_curve: Callable[..., bool] | None = None
        self._buffers: tuple[Any, ...] = ()
        self._clearance = ShapeClearance(grid.free, self.shape)

    @classmethod
    def of(cls, grid: GridMap, robot: Robot) -> ShapeChecker:
        """Return the checks of a robot on a map; those made last are kept, with their tables.

        Raises:
            RobotError: the robot is larger than the map.
        """
        for kept in _KEPT:
            if kept.grid is grid and kept.robot == robot:
                return kept
        checker = cls(grid, robot)
        _KEPT.append(checker)
        return checker

    def compile(self, curves: bool = False) -> None:
        """Compile the checks. Answers do not change.

        The first time takes seconds; the result is kept on disk, and later processes load it.

        Args:
            curves: whether Dubins and Reeds-Shepp curves are to be checked as well.
        """
        if self._compiled is None:
            from . import compiled

            self._buffers, self._compiled = self._make_buffers(), compiled
        if curves:
            from .compiled_curves import find_curve

            self._find_curve = find_curve

    def pose_is_free(self, x: float, y: float, yaw: float) -> bool:
        """Return whether the robot at a pose touches nothing; world coordinates."""
        a, b, c, d, e, f = self._affine
        u, v = a * x + b * y + c, d * x + e * y + f
        heading = (self.shape.sign * yaw + self.shape.phase) % _TURN
        value = self._value_at((u, v, heading))
        if value == UNKNOWN:
            return self._swept_is_free((u, v, heading), None, self._rounding)
        return value != BLOCKED

    def straight_is_free(
        self, x0: float, y0: float, yaw0: float, x1: float, y1: float, yaw1: float
    ) -> bool:
        """Return whether the robot touches nothing on a straight motion; world coordinates.

        The position moves on a line and the heading turns the short way, both evenly, as in
        OMPL's SE2StateSpace.
        """
        if self._compiled is not None:
            motion = x0, y0, yaw0, x1, y1, yaw1
            return self._answer(self._compiled.straight_is_free(*motion, *self._buffers))
        a, b, c, d, e, f = self._affine
        u, v = a * x0 + b * y0 + c, d * x0 + e * y0 + f
        du, dv = a * (x1 - x0) + b * (y1 - y0), d * (x1 - x0) + e * (y1 - y0)
        sign = self.shape.sign
        heading = (sign * yaw0 + self.shape.phase) % _TURN + _TURN
        turn = 0.0
        if self.shape.turns:
            turn = yaw1 - yaw0
            if not -pi <= turn <= pi:
                turn = (turn + pi) % _TURN - pi
            turn *= sign

        if not self.shape.turns:
            heading = 0.0

        def pose_at(t: float) -> Pose:
            return u + t * du, v + t * dv, heading + t * turn

        gaps = self._march(pose_at, hypot(du, dv) + self.shape.radius * abs(turn))
        if gaps is None:
            return False
        return all(self._straight_gap_is_free(pose_at, abs(turn), *gap) for gap in gaps)

    def curve_is_free(
        self,
        world_pose_at: Callable[[float], Pose],
        length: float,
        turn: float,
        reverses: bool | None = None,
    ) -> bool:
        """Return whether the robot touches nothing on a curve.

        Args:
            world_pose_at: the pose (x, y, yaw), world, at a parameter from 0 to 1. It must not
                move faster than evenly along ``length``, nor turn faster than evenly by ``turn``.
            length: of the way of the reference point, world units.
            turn: by which the heading changes at most, in all, radians.
            reverses: whether it is a Reeds-Shepp curve, not a Dubins curve; None if neither.
        """
        a, b, c, d, e, f = self._affine
        sign, phase = self.shape.sign, self.shape.phase

        def pose_at(t: float) -> Pose:
            x, y, yaw = world_pose_at(t)
            heading = (sign * yaw + phase) % _TURN
            return a * x + b * y + c, d * x + e * y + f, heading

        pixels = length / self.grid.resolution
        movement = pixels + self.shape.radius * (turn if self.shape.turns else 0.0)
        if self._find_curve is not None and reverses is not None and turn > 0:
            ends = pose_at(0.0), pose_at(0.5), pose_at(1.0)
            poses = (*ends[0], *ends[1], *ends[2])
            arcs = self._buffers[-1][9]
            if self._find_curve(*poses, pixels, pixels / turn, reverses, arcs):
                motion = *ends[0], movement
                return self._answer(self._compiled.curve_is_free(*motion, *self._buffers))
        gaps = self._march(pose_at, movement)
        if gaps is None:
            return False
        return all(self._curve_gap_is_free(pose_at, movement, *gap) for gap in gaps)

    def clearance(self, x: float, y: float, yaw: float) -> float:
        """Return the distance from the robot to the nearest blocked pixel, world units.

        It is 0 where the robot touches one or is not all inside of the map. The border of the map
        is no obstacle otherwise; without any obstacle the clearance is infinite.
        """
        if not self.pose_is_free(x, y, yaw):
            return 0.0
        a, b, c, d, e, f = self._affine
        u, v = a * x + b * y + c, d * x + e * y + f
        heading = self.shape.sign * yaw + self.shape.phase
        return self._clearance(u, v, heading) * self.grid.resolution

    def _answer(self, answer: int) -> bool:
        """Return the answer of a compiled check, and make the table that it asks for."""
        if answer > 1:
            self.tables.make(answer // 2 - 1)
        return answer & 1 == 1

    def _make_buffers(self) -> tuple[Any, ...]:
        """Return all arguments of the compiled check but the motion."""
        shape, tables = self.shape, self.tables
        height, width = self.grid.shape
        # A copy, since compiled functions take no read-only arrays.
        runs = np.frombuffer(self._runs.lengths, np.uint16).reshape(height, width).copy()
        counts = [len(part) for part in shape.parts]
        constants = (
            *(shape.radius, shape.diameter, self._per_radian, _LOOK, WORTH_A_TEST, CONSERVATISM),
            *(self._rounding, _COMPILED_USES, float(shape.turns), shape.sign, shape.phase),
            *self._affine,
        )
        scratch = np.zeros((10, max(32, height + 2, 2 * max(counts))))
        scratch[8, : len(constants)] = constants
        starts = np.cumsum([0, *counts])
        return tables.stack, tables.counts, runs, np.concatenate(shape.parts), starts, scratch

    def _march(self, pose_at: PoseAt, movement: float) -> list[tuple[float, float]] | None:
        """Return the parts of a motion that tables do not decide; None where it collides.

        Each look at a pose clears the motion before and after as far as the shape may move there
        without touching anything, as sphere tracing does: J. C. Hart, "Sphere tracing", The
        Visual Computer 12 (1996), https://doi.org/10.1007/s003710050084.

        Args:
            pose_at: the motion, over 0 to 1.
            movement: how far any point of the shape moves over all of it, at most; pixels.
        """
        # As a fraction of the motion: how much a unit of the tables clears, and the least step.
        per_value, look = (STEP / movement, _LOOK / movement) if movement else (2.0, 2.0)
        # Most motions that collide do so at one of these places, the last of which is the end.
        value = UNKNOWN
        for t in _FIRST_LOOKS:
            value = self._value_at(pose_at(t))
            if value == BLOCKED:
                return None
        gaps: list[tuple[float, float]] = []
        # Over its reach the shape keeps a unit of the tables away from obstacles. The motion is
        # known to be free up to `done` and from `end` on.
        end = 1.0 - max(0, value - CLEAR) * per_value
        done = t = 0.0
        while True:
            value = self._value_at(pose_at(t))
            if value == BLOCKED:
                return None
            if value > CLEAR:
                reach = (value - CLEAR) * per_value
                if t - reach > done:
                    gaps.append((done, t - reach))
                done = t = t + reach
            else:
                t += look
            if t >= end:
                if done < end:
                    gaps.append((done, end))
                return gaps

    def _value_at(self, pose: Pose) -> int:
        """Return what the tables know of a pose; outside of the map it is blocked."""
        u, v, heading = pose
        _, width, height = self._runs
        if not (0 <= u < width and 0 <= v < height and heading >= 0):
            return BLOCKED
        index = int(heading * self._per_radian)
        cell = int(v) * width + int(u)
        value = self.tables.by_heading[index][cell]
        if value == UNKNOWN and self.tables.refine(index):
            value = self.tables.by_heading[index][cell]
        return value

    def _straight_gap_is_free(self, pose_at: PoseAt, turn: float, low: float, high: float) -> bool:
        """Return whether a part of a straight motion is free; the whole turns by ``turn``."""
        radius, diameter = self.shape.radius, self.shape.diameter

        def margin_of(width: float) -> float:
            # A point of the shape leaves the line between its places at both ends by an eighth at
            # most. With a sixth, what is added to both halves lies in what is added to the whole.
            return radius * (turn * width) ** 2 / 6

        def excess_of(width: float) -> float:
            # The hull of both ends lets each point of the shape turn as any other does.
            return diameter * turn * width / 4 + 3 * margin_of(width)

        def is_free(start: float, end: float) -> bool:
            margin = margin_of(end - start) + self._rounding
            return self._swept_is_free(pose_at(start), pose_at(end), margin)

        return pieces_are_free(low, high, excess_of, is_free)

    def _curve_gap_is_free(self, pose_at: PoseAt, movement: float, low: float, high: float) -> bool:
        """Return whether a part of a curve is free."""

        def excess_of(width: float) -> float:
            # Of the margin below, which is taken along both axes and so is greater diagonally.
            return movement * width / 2**0.5

        def is_free(start: float, end: float) -> bool:
            # No point of the shape is farther than the margin from where it is in the middle.
            margin = movement * (end - start) / 2 + self._rounding
            return self._swept_is_free(pose_at((start + end) / 2), None, margin)

        return pieces_are_free(low, high, excess_of, is_free)

    def _swept_is_free(self, start: Pose, end: Pose | None, margin: float) -> bool:
        """Return whether the hulls of the parts at one or two poses touch nothing.

        Args:
            start: a pose.
            end: another, or None.
            margin: added around, pixels.
        """
        if end is None and self._compiled is not None:
            return bool(self._compiled.pose_is_free(*start, margin, *self._buffers[2:]))
        poses = (start,) if end is None else (start, end)
        turned = [(u, v, cos(heading), sin(heading)) for u, v, heading in poses]
        if not self.shape.turns:
            turned = [(u, v, 1.0, 0.0) for u, v, _, _ in turned]
        for part in self._parts:
            region: Region = [
                (u + c * x - s * y, v + s * x + c * y) for u, v, c, s in turned for x, y in part
            ]
            if not region_is_free(region, margin, self._runs):
                return False
        return True


# A validity checker and a motion validator share one. More would hold memory for nothing.
_KEPT: deque[ShapeChecker] = deque(maxlen=2)
