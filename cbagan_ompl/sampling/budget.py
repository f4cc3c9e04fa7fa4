"""A bound on what a wrong heat map can cost, whatever a planner tells of itself."""

from __future__ import annotations

#: Learned samples that are given in advance where no nodes are seen, which would earn more.
ADVANCE = 128
#: The same where nodes are seen.
ADVANCE_WITH_TREE = 32
#: Learned samples that a uniform sample earns, where the planner stops at its first path or tells
#: what its path costs.
EARNED_BY_UNIFORM = 0.25
#: The same where nodes are seen.
EARNED_BY_UNIFORM_WITH_TREE = 0.5
#: The same for planners of which it is not known when they have a path: half of their samples
#: stay learned, since a good heat map also shortens a path.
EARNED_BY_UNIFORM_UNSEEN = 1.0
#: The same for planners of poses, which need many samples in a part of the region before one of
#: them has a heading with which the robot gets through.
EARNED_BY_UNIFORM_POSE = 4.0
#: Learned samples that a node in a new part of the region earns.
EARNED_BY_NODE = 4


class LearnedBudget:
    """How many learned samples a planner may have before its first path.

    Each learned sample costs one. Uniform samples, and nodes in new parts of the region, earn some
    back, up to the advance. So after ``U`` uniform samples and ``N`` such nodes there were at most
    ``advance + earned_by_uniform * U + EARNED_BY_NODE * N`` learned ones, whatever the heat map.

    Args:
        earned_by_uniform: learned samples that a uniform sample earns.
        is_halved: whether that halves when learned samples have done what they can.
        advance: learned samples that are given in advance, and the most that can be saved up.

    Example:
        >>> budget = LearnedBudget()
        >>> sum(budget.spend() for _ in range(1000))
        128
        >>> for _ in range(8):
        ...     budget.earn_by_uniform()
        >>> budget.spend(), budget.spend(), budget.spend()
        (True, True, False)
    """

    def __init__(
        self,
        earned_by_uniform: float = EARNED_BY_UNIFORM,
        is_halved: bool = True,
        advance: int = ADVANCE,
    ) -> None:
        self._earned_at_first = self._earned_by_uniform = earned_by_uniform
        self._is_halved = is_halved
        self._advance = advance
        self._left: float = advance

    def spend(self) -> bool:
        """Return whether a learned sample may be had, which then is paid."""
        if self._left < 1:
            return False
        self._left -= 1
        return True

    def earn_by_uniform(self) -> None:
        """Note a uniform sample."""
        self._left = min(self._left + self._earned_by_uniform, self._advance)

    def earn_by_node(self) -> None:
        """Note a node in a new part of the region."""
        self._left = min(self._left + EARNED_BY_NODE, self._advance)

    def use_up(self) -> None:
        """Note that learned samples have done what they can: more are to be earned."""
        self._left = 0
        if self._is_halved:
            self._earned_by_uniform /= 2

    def restart(self) -> None:
        """Note that the planner begins anew."""
        self._left = self._advance
        self._earned_by_uniform = self._earned_at_first
