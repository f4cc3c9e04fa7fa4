"""Scores as a Markdown table."""

from __future__ import annotations

from collections.abc import Sequence

from ..common.markdown import table
from .evaluator import Evaluation

_COLUMNS = {
    "iou": "IoU",
    "dice": "Dice",
    "precision": "precision",
    "recall": "recall",
    "connectivity": "joined (8)",
    "connectivity_4": "joined (4)",
    "area": "area",
}


def markdown(evaluations: Sequence[Evaluation], frechet_name: str) -> str:
    """A table with a line for each prediction, 95 % intervals in brackets.

    Args:
        evaluations: in the order of the lines.
        frechet_name: what the column of the Frechet distance is called.
    """
    columns = ["", *_COLUMNS.values(), frechet_name, "parameters", "inference"]
    return table(columns, map(_line, evaluations)) + "\n"


def _line(one: Evaluation) -> list[str]:
    scores = [
        f"{one.scores[key]:.3f} [{one.intervals[key][0]:.3f}, {one.intervals[key][1]:.3f}]"
        for key in _COLUMNS
    ]
    network = ["", ""]
    if one.model:
        network = [f"{one.model['parameters']:,}", f"{one.model['inference_ms']:.1f} ms"]
    return [one.name, *scores, f"{one.frechet:.3g}", *network]
