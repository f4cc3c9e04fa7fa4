"""What is known of the region of a predicted heat map, with a probability."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import Any

from ..common.validation import is_finite_number
from ..errors import ModelError, show

#: Key of a guarantee in the record of a model.
RECORD_KEY = "guarantee"


@dataclass(frozen=True)
class Guarantee:
    """That the pixels from a threshold on hold a nearly shortest path, with a probability.

    For tasks like those that the threshold was calibrated on, the free pixels with a value of at
    least ``threshold``, and those of start and goal, hold a path from start to goal that is at most
    the fraction ``within`` longer than the shortest one, in at least the fraction ``probability``
    of all tasks. That is a mean over tasks, not a statement on any one of them; and it says nothing
    of maps of other kinds.

    Attributes:
        threshold: 0 where only all of free space is enough.
        probability: of a task whose pixels hold such a path.
        within: relative excess of the path's length.
        maps: how many maps it was calibrated on, a task on each.
        families: the thresholds of the single kinds of maps, each calibrated on its own maps.

    Example:
        >>> Guarantee(threshold=0.4, probability=0.95, within=0.05, maps=1000).threshold
        0.4
    """

    threshold: float
    probability: float
    within: float
    maps: int
    families: dict[str, float] = field(default_factory=dict)

    def to_record(self) -> dict[str, Any]:
        """Return it as the record of a model has it."""
        return asdict(self)

    @classmethod
    def from_record(cls, record: dict[str, Any]) -> Guarantee | None:
        """Return the guarantee in the record of a model; None where it has none.

        Raises:
            ModelError: it has one that makes no sense.
        """
        values = record.get(RECORD_KEY)
        if values is None:
            return None
        try:
            result = cls(**values)
            fractions = [result.threshold, result.probability, *result.families.values()]
            is_valid = all(is_finite_number(x) and 0 <= x <= 1 for x in fractions)
            is_valid &= is_finite_number(result.within) and result.within >= 0
            is_valid &= type(result.maps) is int and result.maps > 0
        except (TypeError, AttributeError):
            is_valid = False
        if not is_valid:
            raise ModelError(f"the record has a guarantee that makes no sense: {show(values)}")
        return result
