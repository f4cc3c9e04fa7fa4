"""Poses from which a robot with a turning radius can reach its goal in one curve."""

from __future__ import annotations

from math import pi
from typing import Any

from ..robots.arcs import follow_arc
from ..sampling.sampler import HeatmapSampler
from .compat import new_state, ob, typed_state
from .states import drives_backwards, pose_space, state_access

# Lengths of the shortest curves that turn a robot by pi in place, in turning radii.
_DUBINS_TURN, _REEDS_SHEPP_TURN = 7 * pi / 3, pi

# Curves of random length and curvature before the goal itself is taken.
_MOST_TRIES = 10


class GoalApproach:
    """Move goal poses back along curves that end in them.

    A tree of a planner that cannot turn on the spot enters a goal in a narrow place only from
    nodes whose heading fits. So some of its samples are poses before the goal: on an arc of
    circle, no narrower than the robot can turn, up to half such a circle long. Robots that drive
    backwards may come from ahead of the goal as well.

    Args:
        space: an OMPL state space of poses with a turning radius.
        sampler: of the planner. Poses whose position is blocked on its map are not proposed.
    """

    def __init__(self, space: Any, sampler: HeatmapSampler) -> None:
        self._states = state_access(space)
        self._reverses = drives_backwards(space)
        self._radius = turning_radius(space)
        self._grid, self._chance = sampler.heatmap.grid, sampler.chance
        self._fraction = sampler.spread.approach_fraction

    def is_due(self) -> bool:
        """Return whether the next sample is one before the goal, at random."""
        return self._chance() < self._fraction

    def move_back(self, state: Any) -> None:
        """Move a goal state back, at random; it stays where it is if the way there is blocked.

        Args:
            state: of the space, changed in place.
        """
        x, y, yaw = self._states.read_pose(state)
        for _ in range(_MOST_TRIES):
            turn = pi * self._radius * self._chance()
            if not (self._reverses and self._chance() < 0.5):
                turn = -turn
            moved = follow_arc(x, y, yaw, turn, (2 * self._chance() - 1) / self._radius)
            if self._grid.is_free(moved[:2]):
                self._states.write_pose(state, *moved)
                return


def turning_radius(space: Any) -> float:
    """Return the turning radius of Dubins and Reeds-Shepp curves, which OMPL does not tell.

    It follows from the distance of two states that differ by pi in their yaw alone.

    Args:
        space: a DubinsStateSpace or ReedsSheppStateSpace, or one that holds one as its first part.

    Example:
        >>> round(turning_radius(ob.DubinsStateSpace(5.0)), 6)
        5.0
    """
    poses = pose_space(space)
    handles = new_state(poses), new_state(poses)
    states = [typed_state(handle) for handle in handles]
    for state, yaw in zip(states, (-pi / 2, pi / 2), strict=True):
        state.setX(0.0)
        state.setY(0.0)
        state.setYaw(yaw)
    turn = _REEDS_SHEPP_TURN if drives_backwards(space) else _DUBINS_TURN
    return float(poses.distance(*states)) / turn


def goal_approach(space: Any, sampler: HeatmapSampler) -> GoalApproach | None:
    """Return the approach of goals; None where a robot can turn on the spot or it is switched off.

    Args:
        space: an OMPL state space.
        sampler: of the planner.
    """
    spread = sampler.spread
    has_radius = isinstance(pose_space(space), ob.DubinsStateSpace | ob.ReedsSheppStateSpace)
    is_on = spread.approach_fraction > 0 and spread.uniform_fraction < 1
    return GoalApproach(space, sampler) if has_radius and is_on else None
