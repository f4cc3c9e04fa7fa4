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
    "connectivity": "connected (8)",
    "connectivity_4": "connected (4)",
    "area": "area",
}


def markdown(evaluations: Sequence[Evaluation], frechet_name: str) -> str:
    """Return a table with a row for each prediction, 95 % intervals in brackets.

    Args:
        evaluations: in the order of the rows.
        frechet_name: heading of the column of the Frechet distance.
    """
    columns = ["", *_COLUMNS.values(), frechet_name, "parameters", "inference"]
    return table(columns, map(_row, evaluations)) + "\n"


def _row(evaluation: Evaluation) -> list[str]:
    scores, intervals, network = evaluation.scores, evaluation.intervals, ["", ""]
    if evaluation.model:
        network = [
            f"{evaluation.model['parameters']:,}",
            f"{evaluation.model['inference_ms']:.1f} ms",
        ]
    return [
        evaluation.name,
        *(
            f"{scores[key]:.3f} [{intervals[key][0]:.3f}, {intervals[key][1]:.3f}]"
            for key in _COLUMNS
        ),
        f"{evaluation.frechet:.3g}",
        *network,
    ]
