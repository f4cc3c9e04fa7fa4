"""The tables of the documentation are those of the result files."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

from helpers.scripts import run_script

from cbagan_ompl.planning.heatmap_sources import MOST_CORRIDOR_PIXELS

ROOT = Path(__file__).resolve().parents[2]
SCRIPT = ROOT / "scripts" / "results_tables.py"
RESULTS = ROOT / "benchmarks" / "results"
GENERATED = ROOT / "docs" / "results" / "generated"


def test_committed_tables_are_up_to_date(tmp_path: Path) -> None:
    readme = Path(shutil.copy(ROOT / "README.md", tmp_path / "README.md"))
    output = tmp_path / "tables"
    run_script(SCRIPT, "--output", str(output), "--readme", str(readme))
    assert readme.read_text() == (ROOT / "README.md").read_text()
    fresh = {path.name: path.read_text() for path in output.iterdir()}
    committed = {path.name: path.read_text() for path in GENERATED.glob("*.md")}
    assert fresh == committed
    assert "real_maps.md" in fresh
    table = (GENERATED / "overview.md").read_text()
    assert f"<!-- results -->\n{table}<!-- end of results -->" in readme.read_text()


def test_every_table_is_shown() -> None:
    shown = "".join(path.read_text() for path in (ROOT / "docs").rglob("*.md"))
    for path in GENERATED.glob("*.md"):
        assert f"generated/{path.name}" in shown, path.name


def test_auto_takes_what_is_there_sooner() -> None:
    sizes = json.loads((RESULTS / "search_speed.json").read_text())["sizes"]
    limit = MOST_CORRIDOR_PIXELS**0.5
    for side, figures in sizes.items():
        # Near the limit the two draw level.
        if not limit / 1.4 < int(side) < 1.4 * limit:
            assert (figures["learned_to_corridor"] > 1) == (int(side) < limit), side


def test_every_row_of_a_table_has_all_columns() -> None:
    for path in GENERATED.glob("*.md"):
        lines = [line for line in path.read_text().splitlines() if line.startswith("|")]
        assert len({line.count("|") for line in lines}) <= 1, path.name


def test_summaries_of_other_benchmarks(tmp_path: Path) -> None:
    interval = {"median": 0.5, "low": 0.25, "high": None}
    names = ("nodes_to_first", "first_solution_s", "first_solution_total_s")
    names += ("nodes_to_5_percent", "within_5_percent_s", "within_5_percent_total_s")
    censored = {**dict.fromkeys(names, 0.1), "within_5_percent_s": 0.7}
    own = {"planner": "RRT", "sampler": "uniform", "success": 0.5, "ratios": {}}
    learned = {"planner": "RRT", "sampler": "learned", "success": 1.0, "censored": censored}
    own["censored"] = censored
    summary = {
        "settings": {"simplify": ["RRT"]},
        "overall": [own, {**learned, "ratios": dict.fromkeys(names, interval)}],
    }
    (tmp_path / "summary.json").write_text(json.dumps(summary))
    table = run_script(SCRIPT, "--summaries", str(tmp_path / "summary.json")).splitlines()
    assert "nodes to the first path" in table[0]
    assert table[2].startswith("| RRT + simplify | learned | 50% / 100% | 0.50 [0.25, ∞] |")
    assert table[2].split(" | ")[7] == "-"
    assert len(table) == 3
