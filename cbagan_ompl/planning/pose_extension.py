"""Poses that a planner's tree reaches in one step, for robots with a heading."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ..sampling.sampler import HeatmapSampler
from .compat import new_state, ob, typed_state
from .goal_approach import turning_radius
from .planner_kinds import plans_controls
from .problem import range_of
from .states import drives_backwards, has_turning_radius, state_access

if TYPE_CHECKING:
    from ..sampling.tree_extension import TreeExtension

# Motions that are looked at for one pose: that costs less than to extend the tree in vain.
_MOST_LOOKS = 6


class PoseExtension:
    """Set states to poses of a heat map that a planner's tree reaches without a collision.

    Args:
        si: the space information.
        sampler: of the planner.
        extension: proposes the poses.
    """

    def __init__(self, si: Any, sampler: HeatmapSampler, extension: TreeExtension) -> None:
        self._si = si
        self._states = state_access(si.getStateSpace())
        self._sampler, self._extension = sampler, extension
        self._handle = new_state(si.getStateSpace())
        self._node = typed_state(self._handle)

    def add(self, state: Any, count: int) -> None:
        """Note a new node of the tree.

        Args:
            state: of the node.
            count: how many nodes the tree has with it.
        """
        self._extension.add(*self._states.read_pose(state), count)

    def move(self, state: Any) -> bool:
        """Set a state to such a pose, as a learned sample; return whether there is one.

        Args:
            state: of the space, changed in place.
        """
        covered = self._sampler.covered
        if covered is None:
            return False
        for _ in range(_MOST_LOOKS):
            found = self._extension.propose(covered)
            if found is None:
                return False
            node, pose = found
            self._states.write_pose(self._node, *node)
            self._states.write_pose(state, *pose)
            if self._si.satisfiesBounds(state) and self._si.checkMotion(self._node, state):
                return True
        return False


def pose_extension(planner: Any, sampler: HeatmapSampler) -> PoseExtension | None:
    """Return the extension of a planner's tree.

    Args:
        planner: an OMPL planner.
        sampler: of the planner.

    Returns:
        None where states are no poses, or have other parts as well, where motions go backwards,
        where the planner plans controls, and where all headings are uniform or the tree is not
        watched.
    """
    si, spread = planner.getSpaceInformation(), sampler.spread
    space = si.getStateSpace()
    if not isinstance(space, ob.SE2StateSpace) or drives_backwards(space):
        return None
    if plans_controls(planner) or sampler.covered is None or spread.uniform_fraction == 1:
        return None
    extension = _make_extension(space, sampler, range_of(planner))
    return None if extension is None else PoseExtension(si, sampler, extension)


def _make_extension(space: Any, sampler: HeatmapSampler, longest: float) -> TreeExtension | None:
    """Return what proposes the poses of a space; None where positions have no weight in it."""
    if has_turning_radius(space):
        from ..sampling.arc_extension import ArcExtension  # compiled, as the other one

        return ArcExtension(sampler.heatmap, turning_radius(space), longest, sampler.rng)
    from ..sampling.line_extension import LineExtension

    weights = space.getSubspaceWeight(0), space.getSubspaceWeight(1)
    if weights[0] <= 0:
        return None
    return LineExtension(sampler.heatmap, weights, sampler.spread.spread, longest, sampler.rng)
