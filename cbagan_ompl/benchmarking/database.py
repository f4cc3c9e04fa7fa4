"""The SQLite database that Planner Arena and OMPL's own scripts read."""

from __future__ import annotations

import os
import sqlite3
from collections.abc import Iterable, Mapping
from contextlib import closing
from pathlib import Path

from ..common.files import reason
from ..errors import ConfigError, show
from .log_lines import TYPES
from .logs import ExperimentLog, PlannerLog, number, properties_of

_TABLES = """
CREATE TABLE experiments
    (id INTEGER PRIMARY KEY AUTOINCREMENT, name VARCHAR(512), totaltime REAL, timelimit REAL,
    memorylimit REAL, runcount INTEGER, version VARCHAR(128), hostname VARCHAR(1024), cpuinfo TEXT,
    date DATETIME, seed VARCHAR(24), setup TEXT);
CREATE TABLE plannerConfigs
    (id INTEGER PRIMARY KEY AUTOINCREMENT, name VARCHAR(512) NOT NULL, settings TEXT);
CREATE TABLE enums
    (name VARCHAR(512), value INTEGER, description TEXT, PRIMARY KEY (name, value));
CREATE TABLE runs
    (id INTEGER PRIMARY KEY AUTOINCREMENT, experimentid INTEGER, plannerid INTEGER,
    FOREIGN KEY (experimentid) REFERENCES experiments(id) ON DELETE CASCADE,
    FOREIGN KEY (plannerid) REFERENCES plannerConfigs(id) ON DELETE CASCADE);
CREATE TABLE progress
    (runid INTEGER, time REAL, PRIMARY KEY (runid, time),
    FOREIGN KEY (runid) REFERENCES runs(id) ON DELETE CASCADE);
"""

# The best configuration of each planner: the one that solves most, then the fastest.
_VIEWS = """
CREATE VIEW bestPlannerConfigsPerExperiment AS
    SELECT plannerid, experimentid, MIN(avg_solved) AS avg_solved, avg_total_time
    FROM (SELECT plannerid, plannerConfigs.name AS plannerName, experimentid,
        AVG(solved) AS avg_solved, AVG(time + simplification_time) AS avg_total_time
        FROM runs INNER JOIN plannerConfigs ON plannerConfigs.id = runs.plannerid
        GROUP BY plannerid, experimentid)
    GROUP BY plannerName, experimentid ORDER BY avg_solved DESC, avg_total_time ASC;
CREATE VIEW bestPlannerConfigs AS
    SELECT plannerid, MIN(avg_solved) AS avg_solved, avg_total_time
    FROM (SELECT plannerid, plannerConfigs.name AS plannerName, AVG(solved) AS avg_solved,
        AVG(time + simplification_time) AS avg_total_time
        FROM runs INNER JOIN plannerConfigs ON plannerConfigs.id = runs.plannerid
        GROUP BY plannerid)
    GROUP BY plannerName ORDER BY avg_solved DESC, avg_total_time ASC;
"""


def write_database(logs: Iterable[ExperimentLog], path: Path) -> None:
    """Write the tables of OMPL's ``ompl_benchmark_statistics``, whole or not at all.

    OMPL's own script is left aside: OMPL 1.7 does not have it, and it makes SQL of whatever a log
    says. Names here come from :func:`.parse_log`, which has checked them, and are quoted.

    Args:
        logs: the content of the database.
        path: of the file; an existing one is replaced.

    Raises:
        ConfigError: the file cannot be written.
    """
    temporary = path.with_name(f"{path.name}.tmp")
    try:
        try:
            temporary.unlink(missing_ok=True)
            write_tables(logs, temporary)
            os.replace(temporary, path)
        except BaseException:
            temporary.unlink(missing_ok=True)
            raise
    except (OSError, sqlite3.Error) as error:
        raise ConfigError(f"cannot write {path}: {reason(error)}") from error


def write_tables(logs: Iterable[ExperimentLog], path: Path) -> None:
    """Write the tables into a file that does not exist yet.

    Args:
        logs: the content of the database.
        path: of the file.

    Raises:
        sqlite3.Error: the file cannot be written; half of it may be there.
    """
    with closing(sqlite3.connect(path)) as database:
        # Half a file is thrown away, so nothing has to be kept for a return to its beginning.
        database.execute("PRAGMA journal_mode = OFF")
        database.executescript(_TABLES)
        for log in logs:
            _add_experiment(database, log)
        database.executescript(_VIEWS)
        database.commit()


def _add_experiment(database: sqlite3.Connection, log: ExperimentLog) -> None:
    for name, *values in log.enums:
        database.executemany(
            "INSERT OR IGNORE INTO enums VALUES (?, ?, ?)",
            [(name, i, value) for i, value in enumerate(values)],
        )
    row = {
        "name": log.name,
        "totaltime": log.total_time,
        "timelimit": log.time_limit,
        "memorylimit": log.memory_limit,
        "runcount": log.runs,
        "version": f"{log.version.split()[0]} {log.version.split()[-1]}",
        "hostname": log.host,
        "cpuinfo": log.cpu + "\n" if log.cpu else None,
        "date": log.date,
        "seed": log.seed,
        "setup": log.setup + "\n",
    }
    parameters = {name.replace("-", "_"): value for name, value in log.parameters.items()}
    columns = _add_columns(database, "experiments", parameters, separator="")
    row |= {columns[name]: value for name, value in parameters.items()}
    experiment = _insert(database, "experiments", row)
    for planner in log.planners:
        _add_planner(database, experiment, planner)


def _add_planner(database: sqlite3.Connection, experiment: int, planner: PlannerLog) -> None:
    settings = "".join(f"{setting}\n;" for setting in planner.settings)
    key = (planner.name, settings)
    found = database.execute(
        "SELECT id FROM plannerConfigs WHERE name = ? AND settings = ?", key
    ).fetchone()
    config = (
        found[0]
        if found
        else _insert(database, "plannerConfigs", dict(zip(("name", "settings"), key, strict=True)))
    )
    columns = _add_columns(database, "runs", properties_of(planner.runs))
    runs = [
        _insert(
            database,
            "runs",
            {"experimentid": experiment, "plannerid": config, **_values(run, columns)},
        )
        for run in planner.runs
    ]
    points = [point for points in planner.progress for point in points]
    columns = _add_columns(database, "progress", properties_of(points))
    for run, points_of_run in zip(runs, planner.progress, strict=False):
        for point in points_of_run:
            # Of two points with the same time OMPL's script keeps the first one too.
            _insert(database, "progress", {"runid": run, **_values(point, columns)}, "OR IGNORE")


def _add_columns(
    database: sqlite3.Connection, table: str, properties: Iterable[str], separator: str = "_"
) -> dict[str, str]:
    """Add columns for properties, "graph states INTEGER"; return their names by property."""
    present = {row[1].lower() for row in database.execute(f"PRAGMA table_info({_quote(table)})")}
    columns = {}
    for name in properties:
        *words, kind = name.split()
        column = columns[name] = separator.join(words)
        if kind not in TYPES:
            raise ConfigError(f"{show(name)} is no property with its type")
        if column.lower() not in present:
            database.execute(f"ALTER TABLE {_quote(table)} ADD {_quote(column)} {kind}")
            present.add(column.lower())
    return columns


def _values(row: Mapping[str, str], columns: Mapping[str, str]) -> dict[str, str | None]:
    return {
        column: row[name] if number(row.get(name)) is not None else None
        for name, column in columns.items()
    }


def _insert(
    database: sqlite3.Connection, table: str, row: Mapping[str, object], conflict: str = ""
) -> int:
    """Insert a row and return its id."""
    columns, marks = ", ".join(map(_quote, row)), ", ".join("?" * len(row))
    cursor = database.execute(
        f"INSERT {conflict} INTO {_quote(table)} ({columns}) VALUES ({marks})", list(row.values())
    )
    assert cursor.lastrowid is not None, "an INSERT has a last row"
    return cursor.lastrowid


def _quote(name: str) -> str:
    """Return a name as SQL writes one, whatever its characters."""
    doubled = name.replace('"', '""')
    return f'"{doubled}"'
