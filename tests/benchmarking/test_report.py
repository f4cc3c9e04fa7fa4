from __future__ import annotations

import json

import cv2
from helpers.benchmarks import Finished


def test_report(finished: Finished) -> None:
    summary = json.loads((finished.folder / "summary.json").read_text())
    assert summary["tasks"] == 2
    assert summary["failures"] == {}
    rows_of = {(row["planner"], row["sampler"]): row for row in summary["overall"]}
    assert len(rows_of) == 4
    assert rows_of["RRT", "uniform"]["ratios"] == {}
    assert rows_of["RRT", "corridor"]["ratios"]["first_solution_s"]["median"] > 0
    assert rows_of["RRT", "corridor"]["runs"] == 6
    assert list(summary["families"]) == ["walls"]
    text = (finished.folder / "summary.md").read_text()
    assert text == finished.printed.removesuffix("\n")
    assert "| RRTstar | corridor | " in text
    assert "cbagan-ompl benchmark" in text
    for name in ("success", "cost", "first_solution", "nodes", "ratio_first_solution"):
        image = cv2.imread(str(finished.folder / f"{name}.png"))
        assert image.std() > 10
        assert (finished.folder / f"{name}.pdf").stat().st_size > 5000
