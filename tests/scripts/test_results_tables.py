"""The tables of the documentation are those of the result files."""

from __future__ import annotations

import json
from pathlib import Path

from helpers.scripts import run_script

ROOT = Path(__file__).resolve().parents[2]
SCRIPT = ROOT / "scripts" / "results_tables.py"
GENERATED = ROOT / "docs" / "results" / "generated"


def test_committed_tables_are_up_to_date(tmp_path: Path) -> None:
    run_script(SCRIPT, "--output", str(tmp_path))
    fresh = {path.name: path.read_text() for path in tmp_path.iterdir()}
    committed = {path.name: path.read_text() for path in GENERATED.glob("*.md")}
    assert fresh == committed
    assert "real_maps.md" in fresh


def test_every_row_of_a_table_has_all_columns() -> None:
    for path in GENERATED.glob("*.md"):
        columns = {line.count("|") for line in path.read_text().splitlines()}
        assert len(columns) == 1, path.name


def test_summaries_of_other_benchmarks(tmp_path: Path) -> None:
    interval = {"median": 0.5, "low": 0.25, "high": None}
    names = ("nodes", "first_solution_s", "first_solution_total_s")
    names += ("within_5_percent_s", "within_5_percent_total_s")
    censored = {**dict.fromkeys(names, 0.1), "within_5_percent_s": 0.7}
    own = {"planner": "RRT", "sampler": "uniform", "success": 0.5, "ratios": {}}
    learned = {"planner": "RRT", "sampler": "learned", "success": 1.0, "censored": censored}
    own["censored"] = censored
    summary = {
        "ompl_version": "2.0.1",
        "overall": [own, {**learned, "ratios": dict.fromkeys(names, interval)}],
    }
    (tmp_path / "summary.json").write_text(json.dumps(summary))
    table = run_script(SCRIPT, "--summaries", str(tmp_path / "summary.json")).splitlines()
    assert "2.0.1: solved" in table[0]
    assert table[2].startswith("| RRT | learned | 50% / 100% | 0.50 [0.25, ∞] |")
    assert table[2].split(" | ")[6] == "-"
    assert len(table) == 3
