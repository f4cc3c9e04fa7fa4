"""What is known of a better solution of a run; nothing here loads OMPL."""

from __future__ import annotations

from typing import NamedTuple


class Improvement(NamedTuple):
    """A better solution of a run.

    Attributes:
        seconds: since the run began.
        cost: of the solution.
        nodes: that the planner had added by then; None where it does not tell.
    """

    seconds: float
    cost: float
    nodes: int | None = None
