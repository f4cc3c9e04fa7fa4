from __future__ import annotations

import pytest

from cbagan_ompl.common.markdown import table


def test_table() -> None:
    assert table(["a", "b"], []) == "| a | b |\n| --- | --- |"
    assert table(["a"], [["1"], ["*2*"]]).splitlines() == ["| a |", "| --- |", "| 1 |", "| *2* |"]


def test_rows_may_be_an_iterator() -> None:
    assert table(["n"], ([str(n)] for n in range(2))).count("\n") == 3


@pytest.mark.parametrize(
    ("cell", "line"),
    [
        ("a|b", r"| a\|b |"),
        ("|", r"| \| |"),
        ("", "|  |"),
        ("größe", "| größe |"),
    ],
)
def test_no_cell_breaks_the_table(cell: str, line: str) -> None:
    lines = table(["a"], [[cell]]).split("\n")
    assert len(lines) == 3
    assert lines[2] == line
