from __future__ import annotations

import sqlite3
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest
from helpers.benchmarks import Finished

from cbagan_ompl.benchmarking.database import write_tables
from cbagan_ompl.planning.compat import BOOST_PYTHON

COLUMNS = {
    "experiments": {
        *("id", "name", "totaltime", "timelimit", "memorylimit", "runcount", "version", "hostname"),
        *("cpuinfo", "date", "seed", "setup", "map", "task", "best_known_cost"),
    },
    "plannerConfigs": {"id", "name", "settings"},
    "enums": {"name", "value", "description"},
    "runs": {
        *("id", "experimentid", "plannerid", "time", "solved", "status", "memory"),
        *("solution_length", "approximate_solution", "graph_states", "best_cost", "iterations"),
        *("inference_time", "learned_draws", "uniform_draws", "collision_checks"),
        *("checked_solution", "checked_solution_cost", "first_solution_time"),
        *("first_solution_cost", "time_to_10_percent", "time_to_5_percent", "time_to_2_percent"),
        *("cost_at_10_ms", "cost_at_25_ms", "cost_at_50_ms", "cost_at_100_ms"),
    },
    "progress": {"runid", "time", "best_cost", "iterations"},
}


def rows(database: Path, query: str) -> list[tuple[Any, ...]]:
    with closing(sqlite3.connect(database)) as connection:
        return connection.execute(query).fetchall()


def columns(database: Path, table: str) -> set[tuple[str, str]]:
    return {(row[1], row[2]) for row in rows(database, f"PRAGMA table_info({table})")}


def test_database_has_what_planner_arena_reads(finished: Finished) -> None:
    database = finished.folder / "benchmark.db"
    for table, wanted in COLUMNS.items():
        assert {name for name, _ in columns(database, table)} >= wanted
        assert rows(database, f"SELECT COUNT(*) FROM {table}")[0][0] > 0
    assert rows(database, "SELECT COUNT(*) FROM runs") == [(2 * 4 * 3,)]
    names = {name for (name,) in rows(database, "SELECT name FROM plannerConfigs")}
    assert names == {
        f"geometric_{planner}_{sampler}"
        for planner in ("RRT", "RRTstar")
        for sampler in ("uniform", "corridor")
    }
    views = rows(database, "SELECT name FROM sqlite_master WHERE type = 'view'")
    assert {name for (name,) in views} == {"bestPlannerConfigs", "bestPlannerConfigsPerExperiment"}


@pytest.mark.skipif(BOOST_PYTHON, reason="the wheel has no ompl_benchmark_statistics")
def test_own_tables_are_those_of_ompls_script(finished: Finished, tmp_path: Path) -> None:
    theirs, ours = finished.folder / "benchmark.db", tmp_path / "ours.db"
    write_tables(finished.logs, ours)
    views = ("bestPlannerConfigs", "bestPlannerConfigsPerExperiment")
    for table in (*COLUMNS, *views):
        assert columns(ours, table) == columns(theirs, table)
        names = ", ".join(sorted(name for name, _ in columns(ours, table)))
        query = f"SELECT {names} FROM {table}"
        assert rows(ours, query) == rows(theirs, query)
