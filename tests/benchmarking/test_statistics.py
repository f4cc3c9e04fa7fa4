from __future__ import annotations

from math import inf

import numpy as np
import pytest
from scipy.stats import bootstrap

from cbagan_ompl import ConfigError
from cbagan_ompl.benchmarking.logs import (
    ExperimentLog,
    PlannerLog,
    format_log,
    join_logs,
    parse_log,
)
from cbagan_ompl.benchmarking.measures import add_measures, cost_history, logged_costs
from cbagan_ompl.benchmarking.statistics import (
    Summary,
    median_interval,
    ratio,
    ratio_interval,
    summarise,
)
from cbagan_ompl.planning.ompl_benchmark import RunRecord

NO_DRAWS = {"learned": 0, "uniform": 0}


def make_log(
    name: str, records: dict[str, list[RunRecord]], optimal_cost: float | None = None
) -> ExperimentLog:
    """A log of runs of 1 s, each with 100 nodes, that all ended after 0.9 s."""
    planners = tuple(
        PlannerLog(
            f"geometric_{planner}",
            ("range = 1",),
            tuple({"time REAL": "0.9", "graph states INTEGER": "100"} for _ in runs),
        )
        for planner, runs in records.items()
    )
    log = ExperimentLog(
        "OMPL version 2.0.1", name, {"map VARCHAR": name}, "host", "2000-01-01 00:00:00",
        "Properties\nof the space", "", "7", 1.0, 100.0, len(next(iter(records.values()))), 5.0,
        (("status", "Unknown status", "Exact solution"),), planners,
    )  # fmt: skip
    return add_measures(log, records, optimal_cost)


def solved(*costs: tuple[float, float], inference: float = 0.0, checks: int = 10) -> RunRecord:
    return RunRecord(inference, NO_DRAWS, checks, costs[-1][1], list(costs))


def unsolved(inference: float = 0.0) -> RunRecord:
    return RunRecord(inference, NO_DRAWS, 50, inf, [])


def by_sampler(logs: list[ExperimentLog]) -> dict[str, Summary]:
    return {summary.sampler: summary for summary in summarise(logs)}


def test_measures_of_a_run() -> None:
    run = solved((0.04, 150.0), (0.3, 109.0), (0.7, 101.0), inference=0.01)
    log = make_log("m", {"RRTstar_learned": [run, unsolved()]}, optimal_cost=100.0)
    first, second = log.planners[0].runs
    assert first["first solution time REAL"] == "0.04"
    assert first["first solution cost REAL"] == "150"
    assert first["time to 10 percent REAL"] == "0.3"
    assert first["time to 5 percent REAL"] == first["time to 2 percent REAL"] == "0.7"
    assert first["cost at 100 ms REAL"] == first["cost at 250 ms REAL"] == "150"
    assert first["cost at 500 ms REAL"] == "109"
    assert first["cost at 1000 ms REAL"] == "101"
    assert second["checked solution BOOLEAN"] == "0"
    assert {second[name] for name in first if "cost" in name or "to " in name} == {""}
    assert log.parameters["best_known_cost REAL"] == "100"
    best_of_runs = make_log("m", {"RRTstar_learned": [run, unsolved()]})
    assert best_of_runs.parameters["best_known_cost REAL"] == "101"


def test_costs_come_from_the_log_where_the_planner_tells_none() -> None:
    points = [
        {"time REAL": "0.1", "best cost REAL": "inf"},
        {"time REAL": "0.2", "best cost REAL": "9"},
        {"time REAL": "0.3", "best cost REAL": "9"},
        {"time REAL": "0.4", "best cost REAL": "8"},
    ]
    record = RunRecord(0.0, NO_DRAWS, 1, 7.5, [])
    assert cost_history(record, points, 0.5) == [(0.2, 9.0), (0.4, 8.0), (0.5, 7.5)]
    assert cost_history(record, (), 0.5) == [(0.5, 7.5)]
    assert cost_history(unsolved(), points, 0.5) == []
    run = {
        "first solution time REAL": "0.15",
        "first solution cost REAL": "10",
        "checked solution cost REAL": "7.5",
        "time REAL": "0.5",
    }
    assert logged_costs(run, points) == [(0.15, 10.0), (0.2, 9.0), (0.4, 8.0), (0.5, 7.5)]


def test_summary_against_hand_computed_values() -> None:
    """Three tasks of three runs; on the last one uniform solves one run of three."""
    logs = [
        make_log(
            f"m{i}",
            {
                "RRT_uniform": uniform,
                "RRT_learned": [
                    solved((t, 10.0), inference=0.1, checks=5) for t in (0.1, 0.2, 0.3)
                ],
            },
            optimal_cost=10.0,
        )
        for i, uniform in enumerate(
            (
                [solved((t, 12.0)) for t in (0.4, 0.2, 0.6)],
                [solved((t, 11.0)) for t in (0.1, 0.1, 0.1)],
                [solved((0.1, 11.0)), unsolved(), unsolved()],
            )
        )
    ]
    both = by_sampler(logs)
    uniform, learned = both["uniform"], both["learned"]
    assert (uniform.tasks, uniform.runs, uniform.success) == (3, 9, pytest.approx(7 / 9))
    assert learned.success == 1
    # Medians by task: 0.4, 0.1 and, of one run and two censored ones, the limit of 1 s.
    assert uniform.measures["first_solution_s"].median == pytest.approx(0.4)
    assert uniform.censored["first_solution_s"] == pytest.approx(2 / 9)
    assert learned.measures["first_solution_s"].median == pytest.approx(0.2)
    assert learned.measures["first_solution_total_s"].median == pytest.approx(0.3)
    assert learned.measures["inference_s"].median == pytest.approx(0.1)
    # Costs by task: 1.2, 1.1 and an infinite one.
    assert uniform.measures["final_cost"].median == pytest.approx(1.2)
    assert uniform.measures["final_cost"].high == inf
    assert uniform.censored["nodes"] == pytest.approx(2 / 9)
    # Ratios by task: 0.2 / 0.4, 0.2 / 0.1, 0.2 / 1.
    assert learned.ratios["first_solution_s"].median == pytest.approx(0.5)
    assert learned.ratios["first_solution_total_s"].median == pytest.approx(0.75)
    assert learned.ratios["final_cost"].median == pytest.approx(1 / 1.2)
    assert learned.ratios["final_cost"].low == 0
    assert learned.ratios["collision_checks"].median == pytest.approx(0.5)
    assert "inference_s" not in learned.ratios
    assert uniform.ratios == {}


def test_runs_that_do_not_get_there_are_a_tie() -> None:
    late = solved((0.99, 10.0), inference=0.5)
    logs = [make_log("m", {"RRT_uniform": [unsolved()], "RRT_learned": [late]})]
    learned = by_sampler(logs)["learned"]
    assert learned.measures["first_solution_total_s"].median == 1
    assert learned.censored["first_solution_total_s"] == 1
    assert learned.censored["first_solution_s"] == 0
    assert learned.ratios["first_solution_total_s"].median == 1
    none = [make_log("m", {"RRT_uniform": [unsolved()], "RRT_learned": [unsolved(0.5)]})]
    learned = by_sampler(none)["learned"]
    assert learned.ratios["final_cost"].median == learned.ratios["final_cost"].high == 1
    assert learned.success == 0


def test_ratio_of_infinite_values() -> None:
    values = ratio(np.array([2.0, inf, inf, 2.0, 0.0]), np.array([4.0, inf, 1.0, inf, 0.0]))
    np.testing.assert_array_equal(values, [0.5, 1, inf, 0, 1])


def test_interval_over_tasks_is_the_usual_bootstrap() -> None:
    tasks = np.random.default_rng(1).lognormal(size=40)
    ours = median_interval([np.array([value]) for value in tasks])
    usual = bootstrap((tasks,), np.median, method="percentile", rng=1, n_resamples=2000)
    assert ours.median == np.median(tasks)
    assert ours.low == pytest.approx(usual.confidence_interval.low, rel=0.1)
    assert ours.high == pytest.approx(usual.confidence_interval.high, rel=0.1)


def test_interval_of_one_task_shows_the_luck_of_its_runs() -> None:
    runs = np.random.default_rng(1).lognormal(size=30)
    assert median_interval([np.full(30, 3.0)]).low == 3.0
    interval = median_interval([runs])
    assert interval.low < interval.median < interval.high
    same = ratio_interval([runs], [runs])
    assert same.low < same.median == 1 < same.high


def test_joined_logs_are_read_back() -> None:
    one = make_log("m", {"RRT_uniform": [solved((0.1, 2.0))], "RRT_learned": [unsolved()]})
    two = make_log("m", {"RRT_uniform": [unsolved()], "RRT_learned": [solved((0.2, 3.0))]})
    both = join_logs([one, two])
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
