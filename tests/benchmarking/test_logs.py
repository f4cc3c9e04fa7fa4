from __future__ import annotations

import pytest
from helpers.logs import make_log, solved, unsolved

from cbagan_ompl import ConfigError
from cbagan_ompl.benchmarking.logs import concatenate_logs, format_log, parse_log


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
