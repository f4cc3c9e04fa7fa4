"""The check that an argument is a heat map."""

from __future__ import annotations

from ..errors import HeatmapError, show
from .heatmap import Heatmap


def check_heatmap(heatmap: object) -> None:
    """Raise if a value is no heat map.

    Raises:
        HeatmapError: it is none; the message says how to make one of an array.
    """
    if not isinstance(heatmap, Heatmap):
        raise HeatmapError(
            f"expected a Heatmap, got {show(heatmap)}; an array of values becomes one with "
            "Heatmap(values, grid)"
        )
