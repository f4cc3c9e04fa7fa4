from __future__ import annotations

import sqlite3
import warnings
from contextlib import closing, redirect_stdout
from dataclasses import replace
from io import StringIO
from pathlib import Path
from typing import Any

import pytest
from helpers.benchmarks import Finished

from cbagan_ompl import ConfigError
from cbagan_ompl.benchmarking.database import write_database, write_tables
from cbagan_ompl.benchmarking.logs import ExperimentLog
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
    from ompl import tools

    ours, theirs = finished.folder / "benchmark.db", tmp_path / "theirs.db"
    logs = [str(log) for log in sorted((finished.folder / "logs").glob("*.log"))]
    # It prints what it reads, and leaves closing the database to the garbage collector.
    with redirect_stdout(StringIO()), warnings.catch_warnings():
        warnings.simplefilter("ignore", ResourceWarning)
        tools.readBenchmarkLog(str(theirs), logs, False)
        tools.computeViews(str(theirs), False)
    views = ("bestPlannerConfigs", "bestPlannerConfigsPerExperiment")
    for table in (*COLUMNS, *views):
        assert columns(ours, table) == columns(theirs, table)
        names = ", ".join(sorted(name for name, _ in columns(ours, table)))
        query = f"SELECT {names} FROM {table}"
        assert rows(ours, query) == rows(theirs, query)


def with_property(log: ExperimentLog, name: str) -> ExperimentLog:
    planner = log.planners[0]
    runs = tuple({**run, name: "1"} for run in planner.runs)
    return replace(log, planners=(replace(planner, runs=runs), *log.planners[1:]))


def test_names_are_quoted(finished: Finished, tmp_path: Path) -> None:
    log = with_property(finished.logs[0], 'a"b);DROP--TABLE"runs; REAL')
    write_tables([log], tmp_path / "x.db")
    assert rows(tmp_path / "x.db", "SELECT COUNT(*) FROM runs") == [(4 * 3,)]
    assert ('a"b);DROP--TABLE"runs;', "REAL") in columns(tmp_path / "x.db", "runs")
    with pytest.raises(ConfigError, match="no property with its type"):
        write_database([with_property(log, "x REAL); DROP TABLE runs; --")], tmp_path / "y.db")
    assert [path.name for path in tmp_path.iterdir()] == ["x.db"]


def test_columns_that_differ_in_case_are_one(finished: Finished, tmp_path: Path) -> None:
    first, second = (
        with_property(log, name)
        for log, name in zip(finished.logs, ("new REAL", "NEW REAL"), strict=True)
    )
    write_database([first, second], tmp_path / "x.db")
    assert rows(tmp_path / "x.db", "SELECT COUNT(new) FROM runs") == [(2 * 3,)]


def test_a_database_that_cannot_be_written_is_left_as_it_was(
    finished: Finished, tmp_path: Path
) -> None:
    path = tmp_path / "benchmark.db"
    path.write_text("before")
    broken = replace(finished.logs[1], name=[1])  # type: ignore[arg-type]
    with pytest.raises(ConfigError, match=r"cannot write .*benchmark\.db"):
        write_database([finished.logs[0], broken], path)
    assert path.read_text() == "before"
    assert [file.name for file in tmp_path.iterdir()] == ["benchmark.db"]
