from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest
from helpers.benchmarks import Finished
from helpers.fuzzing import mutations, read_all
from helpers.logs import make_log, solved, unsolved
from hypothesis import given
from hypothesis import strategies as st

from cbagan_ompl import ConfigError
from cbagan_ompl.benchmarking.logs import (
    ExperimentLog,
    PlannerLog,
    concatenate_logs,
    format_log,
    parse_log,
    read_log,
)

# Names and values as OMPL writes them: visible characters and blanks, without separators.
characters = st.characters(
    codec="utf-8", exclude_categories=("C", "Z"), exclude_characters=";,|<>="
)
words = st.text(characters, min_size=1, max_size=12)
lines = st.lists(words, min_size=1, max_size=3).map(" ".join)
blocks = st.lists(lines, max_size=3).map("\n".join)
# The log has six digits of its numbers.
numbers = st.floats(1e-3, 1e6).map(lambda value: float(f"{value:g}"))
counts = st.integers(1, 3)


# Names of properties become those of columns.
property_names = st.from_regex(r"[A-Za-z][A-Za-z0-9 %.-]{0,12}[a-z0-9]", fullmatch=True).map(
    lambda name: f"x {name}"
)
values = st.one_of(st.floats().map(lambda value: f"{value:g}"), st.integers().map(str), st.just(""))


def column(name: str) -> str:
    return re.sub("[ _.%-]", "", name.rsplit(" ", 1)[0]).lower()


def names_of(kind: str) -> st.SearchStrategy[list[str]]:
    typed = property_names.map(lambda name: f"{name} {kind}")
    return st.lists(typed, min_size=1, max_size=3, unique_by=column)


def rows_of(names: list[str]) -> st.SearchStrategy[dict[str, str]]:
    """Rows with a number, perhaps none, for each property."""
    return st.fixed_dictionaries({name: values for name in names})


@st.composite
def planner_logs(draw: st.DrawFn, count: int) -> PlannerLog:
    runs = draw(st.lists(rows_of(draw(names_of("REAL"))), min_size=count, max_size=count))
    points = st.lists(rows_of(draw(names_of("INTEGER"))), min_size=1, max_size=3).map(tuple)
    series = st.lists(points, min_size=count, max_size=count).map(tuple)
    progress = draw(st.one_of(st.just(()), series))
    settings = tuple(draw(st.lists(lines, max_size=3)))
    return PlannerLog(f"geometric_{draw(words)}", settings, tuple(runs), progress)


@st.composite
def experiment_logs(draw: st.DrawFn) -> ExperimentLog:
    runs = draw(counts)
    return ExperimentLog(
        version=draw(words.map(lambda word: f"OMPL version {word}")),
        name=draw(words),
        parameters={name: draw(lines) for name in draw(names_of("VARCHAR"))},
        host=draw(words),
        date=draw(lines),
        setup=draw(blocks),
        cpu=draw(st.one_of(st.just(""), blocks)),
        seed=draw(st.integers(0, 2**32).map(str)),
        time_limit=draw(numbers),
        memory_limit=draw(numbers),
        runs=runs,
        total_time=draw(numbers),
        enums=draw(
            st.lists(st.lists(lines, min_size=1, max_size=3).map(tuple), max_size=3).map(tuple)
        ),
        planners=draw(st.lists(planner_logs(runs), max_size=3).map(tuple)),
    )


logs = experiment_logs()


@given(logs)
def test_a_log_that_was_written_is_read_back(log: ExperimentLog) -> None:
    text = format_log(log)
    assert parse_log(text) == log
    assert format_log(parse_log(text)) == text


@given(logs, st.integers(1, 3))
def test_concatenation_keeps_every_run_in_order(log: ExperimentLog, copies: int) -> None:
    whole = concatenate_logs([log] * copies)
    assert whole.runs == copies * log.runs
    for planner, part in zip(whole.planners, log.planners, strict=True):
        assert planner.runs == part.runs * copies
        assert planner.progress == part.progress * copies


def test_logs_of_ompl_are_read_back(finished: Finished) -> None:
    for log in finished.logs:
        assert parse_log(format_log(log)) == log


def test_concatenated_logs_are_read_back() -> None:
    one = make_log("m", {"RRT_uniform": [solved((0.1, 2.0))], "RRT_learned": [unsolved()]})
    two = make_log("m", {"RRT_uniform": [unsolved()], "RRT_learned": [solved((0.2, 3.0))]})
    both = concatenate_logs([one, two])
    assert both.runs == 2
    assert both.total_time == 10
    assert [run["checked solution BOOLEAN"] for run in both.planners[0].runs] == ["1", "0"]
    assert parse_log(format_log(both)) == both


@pytest.mark.parametrize("text", ["", "OMPL version 2.0.1\n", "something else\n\n"])
def test_other_texts_are_no_logs(text: str) -> None:
    with pytest.raises(ConfigError, match="no benchmark log"):
        parse_log(text)
    whole = format_log(make_log("m", {"RRT_uniform": [unsolved()]}))
    with pytest.raises(ConfigError, match="cut off"):
        parse_log(whole[: len(whole) // 2])


def replaced(finished: Finished, old: str, new: str) -> str:
    text = format_log(finished.logs[0])
    assert old in text
    return text.replace(old, new)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("\nmemory REAL\n", "\nmemory REAL); DROP TABLE runs; --\n"),
        ("\nmemory REAL\n", '\nmemory" REAL\n'),
        ("\nmemory REAL\n", "\nmemory REAL DEFAULT 1\n"),
        ("\nmemory REAL\n", "\nmemory BLOB\n"),
        ("\nmemory REAL\n", "\n(SELECT 1) REAL\n"),
        ("\nmemory REAL\n", "\nid INTEGER\n"),
        ("\nmemory REAL\n", "\nMemory REAL\ntime REAL\n"),
        ("\nmemory REAL\n", "\ngraph_States REAL\n"),
        ("\nmemory REAL\n", f"\n{'memory' * 50} REAL\n"),
        ("\nmap VARCHAR = ", "\nm, ap VARCHAR = "),
        ("\ntask INTEGER = 0", "\ntask INTEGER = (SELECT 1)"),
        ("\n3 runs per planner", "\n4 runs per planner"),
        ("\n3 runs\n", "\n3000000 runs\n"),
        ("\n3 runs\n", f"\n{'9' * 5000} runs\n"),
        ("\n4 planners", "\n3 planners"),
        ("0; 1; ", "0; x; "),
        ("0; 1; ", "0; 1_0; "),
        ("0; 1; ", "0; 1; 1; "),
        ("seconds per run", "e999 seconds per run"),
        ("\n.\n", "\n.\n\x00\n"),
    ],
)
def test_what_could_become_sql_or_is_no_number_is_refused(
    finished: Finished, old: str, new: str
) -> None:
    with pytest.raises(ConfigError, match=r"no benchmark log .*line \d+"):
        parse_log(replaced(finished, old, new))


def test_truncated_logs_are_refused_wherever_they_end(finished: Finished) -> None:
    text = format_log(finished.logs[0])
    for end in range(0, len(text) - 1, 7):
        with pytest.raises(ConfigError, match="cut off"):
            parse_log(text[:end])


@pytest.mark.parametrize(
    ("count", "seed"), [(400, 0), pytest.param(3000, 1, marks=pytest.mark.slow)]
)
def test_damaged_logs_are_read_or_refused(
    finished: Finished, tmp_path: Path, count: int, seed: int
) -> None:
    path = tmp_path / "x.log"
    valid = [format_log(log).encode() for log in finished.logs]

    def read(data: bytes) -> None:
        path.write_bytes(data)
        read_log(path)

    counts = read_all(read, mutations(valid, count, seed))
    assert counts["refused"] > count / 4
    assert counts["read"] > count / 100


# Texts of nearly the largest size that are as costly to read as possible.
_COSTLY = r"""
import json, resource, sys, time
from cbagan_ompl import ConfigError
from cbagan_ompl.benchmarking.log_lines import MAX_LOG_BYTES
from cbagan_ompl.benchmarking.logs import parse_log
small = sys.stdin.read()
head = small[: small.index("4 planners")].replace("\n3 runs per planner", "\n1 runs per planner")
one = "1 planners\nx\n0 common properties\n1 properties for each run\na REAL\n1 runs\n1; \n"
progress = "1 progress properties for each run\nb REAL\n1 runs\n"
room = MAX_LOG_BYTES - 20_000
points = "12,;" * (room // 4)
wide = [f"{n} REAL" for n in (f"b{i}" for i in range(30))]
many = f"30 progress properties for each run\n" + "\n".join(wide) + "\n1 runs\n"
many += ("12," * 30 + ";") * (2_900_000 // 30)
cases = [
    head + one + progress + points + "\n.\n", head + one + many + "\n.\n", "\n" * room,
    "\r" * room, "OMPL version 1\nExperiment " + "x" * room, head[:-9] + "<<<|\n" * 80_000,
    "x" * (2 * room),
]
for text in cases:
    with open("/proc/self/clear_refs", "w") as file:
        file.write("5")
    def memory(kind):
        with open("/proc/self/status") as file:
            return int(next(line for line in file if line.startswith(kind)).split()[1]) / 1000
    before, start = memory("VmRSS"), time.monotonic()
    try:
        parse_log(text)
        read = True
    except ConfigError as error:
        read = False
    print(json.dumps([read, time.monotonic() - start, memory("VmHWM") - before]))
"""


@pytest.mark.slow
def test_costly_logs_are_refused_early(finished: Finished) -> None:
    done = subprocess.run(
        [sys.executable, "-c", _COSTLY],
        input=format_log(finished.logs[0]),
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    outcomes = [json.loads(line) for line in done.stdout.splitlines()]
    assert [read for read, _, _ in outcomes] == [False, True] + [False] * 5
    for _, seconds, megabytes in outcomes:
        assert seconds < 10
        assert megabytes < 400
