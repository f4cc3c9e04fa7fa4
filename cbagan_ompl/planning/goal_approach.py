"""Poses from which a robot with a heading reaches its goal in one motion."""

from __future__ import annotations

from collections.abc import Callable
from math import cos, pi, sin
from typing import Any

from ..robots.arcs import Pose, follow_arc
from ..sampling.headings import FOLLOWING
from ..sampling.sampler import HeatmapSampler
from .compat import new_state, typed_state
from .problem import range_of
from .sample_budget import needs_many_poses
from .states import drives_backwards, has_turning_radius, pose_space, state_access

# Lengths of the shortest curves that turn a robot by pi in place, in turning radii.
_DUBINS_TURN, _REEDS_SHEPP_TURN = 7 * pi / 3, pi

# Motions of random length and direction that are tried before the goal itself is taken.
_MOST_TRIES = 10

# How near to the goal a tree is for its samples to be poses before it, in ranges.
_NEAR = 2.0

#: Moves a pose back along a motion that ends in it, at random.
StepBack = Callable[[Pose], Pose]


class GoalApproach:
    """Move goal poses back along motions that end in them.

    A tree enters a goal in a narrow place only from nodes whose heading fits. Where the node that
    is nearest to the goal has another one, the planner tries the same motion to the goal again and
    again. So once the tree is near, some of its samples are poses before the goal.

    Args:
        space: an OMPL state space of poses.
        sampler: of the planner. Poses whose position is blocked on its map are not proposed.
        step_back: proposes the poses.
        near: distance to the goal from which on a node is near it.
    """

    def __init__(
        self, space: Any, sampler: HeatmapSampler, step_back: StepBack, near: float
    ) -> None:
        self._space, self._step_back, self._near = space, step_back, near
        self._states = state_access(space)
        self._grid, self._chance = sampler.heatmap.grid, sampler.chance
        self._fraction = sampler.spread.approach_fraction
        self._is_near = False

    def on_new_node(self, distance: float, count: int) -> None:
        """Note that the planner's tree has a new node.

        Args:
            distance: of the node from the goal.
            count: how many nodes the tree has with it: 1 where it has begun anew.
        """
        self._is_near = distance <= self._near or (self._is_near and count != 1)

    def is_due(self) -> bool:
        """Return whether the next sample is one before the goal, at random."""
        return self._is_near and self._chance() < self._fraction

    def move_back(self, state: Any) -> None:
        """Move a goal state back, at random; it stays where it is if there is no room.

        Args:
            state: of the space, changed in place.
        """
        goal = self._states.read_pose(state)
        for _ in range(_MOST_TRIES):
            pose = self._step_back(goal)
            if self._grid.is_free(pose[:2]):
                self._states.write_pose(state, *pose)
                if self._space.satisfiesBounds(state):
                    return
        self._states.write_pose(state, *goal)


def turning_radius(space: Any) -> float:
    """Return the turning radius of Dubins and Reeds-Shepp curves, which OMPL does not tell.

    It follows from the distance of two states that differ by pi in their yaw alone.

    Args:
        space: a DubinsStateSpace or ReedsSheppStateSpace, or one that holds one as its first part.

    Example:
        >>> from ompl import base as ob
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


def goal_approach(planner: Any, sampler: HeatmapSampler) -> GoalApproach | None:
    """Return the approach of goals for a planner.

    Args:
        planner: an OMPL planner.
        sampler: of the planner.

    Returns:
        None where states are no poses, where the planner plans controls, and where the approach is
        switched off, by itself or with all headings.
    """
    spread = sampler.spread
    is_on = spread.approach_fraction > 0 and spread.uniform_fraction < 1
    if not is_on or not needs_many_poses(planner):
        return None
    space, longest = planner.getSpaceInformation().getStateSpace(), range_of(planner)
    if has_turning_radius(space):
        step_back = _arc_back(turning_radius(space), drives_backwards(space), sampler.chance)
    else:
        step_back = _line_back(longest, sampler.chance)
    return GoalApproach(space, sampler, step_back, _NEAR * longest)


def _arc_back(radius: float, reverses: bool, chance: Callable[[], float]) -> StepBack:
    """Return what moves a pose back along an arc of circle, up to half such a circle long.

    Robots that drive backwards may come from ahead of the pose as well.
    """

    def step_back(pose: Pose) -> Pose:
        length = pi * radius * chance()
        if not (reverses and chance() < 0.5):
            length = -length
        return follow_arc(*pose, length, (2 * chance() - 1) / radius)

    return step_back


def _line_back(longest: float, chance: Callable[[], float]) -> StepBack:
    """Return what moves a pose along a line in any direction, and turns it a little."""

    def step_back(pose: Pose) -> Pose:
        x, y, yaw = pose
        length, angle = longest * chance(), 2 * pi * chance()
        turned = yaw + FOLLOWING * (2 * chance() - 1)
        return x + length * cos(angle), y + length * sin(angle), (turned + pi) % (2 * pi) - pi

    return step_back
