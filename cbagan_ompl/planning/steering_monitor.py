"""The monitor of a planner whose samples are steered by the bounds of its space."""

from __future__ import annotations

from ..errors import PlannerError
from .compat import planner_data
from .monitor import PlannerMonitor


class SteeringMonitor(PlannerMonitor):
    """The monitor of a planner whose samples are steered by the bounds of its space."""

    def set_injected_fraction(self, fraction: float) -> None:
        """Steer no more than a fraction of the samples."""
        self.injected_fraction = fraction

    def has_begun(self) -> bool:
        """Return whether the planner stands at the beginning of a first solve."""
        if self._planner is None:
            return False
        data = planner_data(self._planner)
        return bool(data.numStartVertices() > 0 and data.numGoalVertices() == 0)

    def check_wiring(self) -> None:
        """Raise if the setup has other checks than when the planner was attached.

        Raises:
            PlannerError: the validity checker or the motion validator has been replaced.
        """
        if self._setup is None:
            return
        si = self._setup.getSpaceInformation()
        checks = si.getStateValidityChecker(), si.getMotionValidator()
        if not all(getattr(check, "is_steered", False) for check in checks):
            raise PlannerError(
                "the validity checker or the motion validator was replaced while the planner "
                "samples a heat map: call detach(), set it, and attach again"
            )

    def range(self) -> float:
        """Return the longest edge of the planner's trees."""
        return float(self._planner.getRange())

    def set_range(self, range: float) -> None:
        """Set the longest edge of the planner's trees."""
        self._planner.setRange(range)
