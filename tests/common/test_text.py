from __future__ import annotations

import pytest

from cbagan_ompl.common.text import one_line


@pytest.mark.parametrize("text", ["", "maze 2", "ä地图", "a$b|c"])
def test_plain_texts_stay(text: str) -> None:
    assert one_line(text) == text


@pytest.mark.parametrize(
    ("text", "line"),
    [("a\nb\r", r"a\nb\r"), ("\0\x1b[0m", r"\x00\x1b[0m"), ("b\udcff", r"b\udcff"), (" ", r" ")],
)
def test_others_are_escaped(text: str, line: str) -> None:
    assert one_line(text) == line


def test_long_texts_that_differ_stay_apart() -> None:
    lines = {one_line("x" * 500 + end, 50) for end in "ab"}
    assert len(lines) == 2
    assert {len(line) for line in lines} == {50}
