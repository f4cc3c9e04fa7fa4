from __future__ import annotations

import json

import pytest
from helpers.benchmarks import Finished
from helpers.logs import make_log, solved, unsolved

from cbagan_ompl.benchmarking.measures import thresholds
from cbagan_ompl.benchmarking.report import Conditions, markdown, summary_json
from cbagan_ompl.benchmarking.settings import Settings
from cbagan_ompl.benchmarking.statistics import results_of


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


@pytest.mark.parametrize("within", [5, 20])
def test_the_threshold_is_the_users(within: int) -> None:
    good = solved((0.1, 150.0), (0.2, 115.0), (0.3, 104.0), (0.4, 100.0))
    slow = solved((0.2, 150.0), (0.4, 115.0), (0.6, 104.0), (0.8, 100.0))
    records = {"RRTstar_uniform": [slow], "RRTstar_learned": [good]}
    logs = [make_log("m", records, percents=thresholds(within))]
    results = results_of(logs, thresholds(within))
    conditions = Conditions("2.0.1", 1, Settings(within=within), {}, "command")
    summary = summary_json(results, conditions)
    assert summary["settings"]["within"] == within
    own, learned = summary["overall"]
    time = 0.3 if within == 5 else 0.2
    assert learned["measures"][f"within_{within}_percent_s"]["median"] == pytest.approx(time)
    assert own["measures"][f"within_{within}_percent_s"]["median"] == pytest.approx(2 * time)
    assert {name for name in learned["measures"] if name.startswith("within")} == {
        f"within_{percent}_percent_{kind}"
        for percent in {10, 5, 2, within}
        for kind in ("s", "total_s")
    }
    text = markdown(results, conditions)
    assert text.count(f"to {within} % of best") == 3
    nodes = learned["measures"]
    assert nodes["nodes_to_first"]["median"] == 10
    assert nodes[f"nodes_to_{within}_percent"]["median"] == (30 if within == 5 else 20)
    assert "% of best" not in text.replace(f"to {within} % of best", "")


def test_failures_are_named_with_the_end_of_their_output() -> None:
    results = results_of([make_log("m", {"RRT_uniform": [unsolved()]})])
    failures = {"maze_1": "Traceback\nValueError: no"}
    conditions = Conditions("2.0.1", 1, Settings(), failures, "command")
    report = markdown(results, conditions)
    assert report.endswith("## Tasks that failed\n\n- maze_1: ValueError: no\n")
    assert summary_json(results, conditions)["overall"][0]["measures"]["final_cost"] == {
        "median": None,
        "low": None,
        "high": None,
    }


def test_tasks_left_out_and_sources_are_named() -> None:
    results = results_of([make_log("m", {"RRT_uniform": [unsolved()]})])
    left_out = {f"city_{i}": "start and goal are the same" for i in range(12)}
    conditions = Conditions(
        "2.0.1",
        1,
        Settings(),
        {},
        "command",
        left_out=left_out,
        auto={"corridor": 2, "learned": 1},
    )
    report = markdown(results, conditions)
    assert "Auto: corridor (2), learned (1)." in report
    assert "12 tasks that cannot be planned for were left out." in report
    assert "- city_9: start" in report
    assert "city_10" not in report
    assert "- and 2 more" in report
    summary = summary_json(results, conditions)
    assert summary["left_out"] == left_out
    assert summary["auto"] == {"corridor": 2, "learned": 1}
