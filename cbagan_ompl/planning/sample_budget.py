"""The budget of learned samples that fits a planner and its space."""

from __future__ import annotations

from typing import Any

from ..sampling.budget import (
    ADVANCE_WITH_TREE,
    EARNED_BY_UNIFORM_POSE,
    EARNED_BY_UNIFORM_UNSEEN,
    EARNED_BY_UNIFORM_WITH_TREE,
    LearnedBudget,
)
from .hooks import stops_at_first
from .planner_kinds import class_name, plans_controls
from .states import pose_space


def needs_many_poses(planner: Any) -> bool:
    """Return whether a planner steers to samples of poses, of which many have a heading in vain.

    Planners of controls only choose by a sample from where to go on.

    Args:
        planner: an OMPL planner.
    """
    space = planner.getSpaceInformation().getStateSpace()
    return pose_space(space) is not None and not plans_controls(planner)


def budget_of(planner: Any, sees_nodes: bool) -> LearnedBudget:
    """Return the budget of a planner's learned samples before its first path.

    Args:
        planner: an OMPL planner.
        sees_nodes: whether the hook that reaches it sees the nodes of its tree.
    """
    if needs_many_poses(planner):
        return LearnedBudget(EARNED_BY_UNIFORM_POSE, is_halved=False)
    if sees_nodes:
        return LearnedBudget(EARNED_BY_UNIFORM_WITH_TREE, advance=ADVANCE_WITH_TREE)
    if stops_at_first(class_name(planner)) or hasattr(planner, "bestCost"):
        return LearnedBudget()
    return LearnedBudget(EARNED_BY_UNIFORM_UNSEEN, is_halved=False)
