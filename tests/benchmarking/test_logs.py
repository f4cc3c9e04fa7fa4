from __future__ import annotations

import pytest
from helpers.benchmarks import Finished
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


def rows_of(names: list[str]) -> st.SearchStrategy[dict[str, str]]:
    """Rows with a text, perhaps empty, for each property."""
    return st.fixed_dictionaries({name: st.one_of(words, st.just("")) for name in names})


@st.composite
def planner_logs(draw: st.DrawFn) -> PlannerLog:
    names = st.lists(words.map(lambda word: f"{word} REAL"), min_size=1, max_size=3, unique=True)
    runs = draw(st.lists(rows_of(draw(names)), min_size=1, max_size=3))
    points = st.lists(rows_of(draw(names)), min_size=1, max_size=3).map(tuple)
    progress = draw(st.one_of(st.just(()), st.lists(points, min_size=1, max_size=3).map(tuple)))
    settings = tuple(draw(st.lists(lines, max_size=3)))
    return PlannerLog(f"geometric_{draw(words)}", settings, tuple(runs), progress)


logs = st.builds(
    ExperimentLog,
    version=words.map(lambda word: f"OMPL version {word}"),
    name=words,
    parameters=st.dictionaries(words.map(lambda word: f"{word} VARCHAR"), lines, max_size=3),
    host=words,
    date=lines,
    setup=blocks,
    cpu=st.one_of(st.just(""), blocks),
    seed=st.integers(0, 2**32).map(str),
    time_limit=numbers,
    memory_limit=numbers,
    runs=counts,
    total_time=numbers,
    enums=st.lists(st.lists(lines, min_size=1, max_size=3).map(tuple), max_size=3).map(tuple),
    planners=st.lists(planner_logs(), max_size=3).map(tuple),
)


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
