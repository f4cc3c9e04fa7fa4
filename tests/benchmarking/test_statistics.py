from __future__ import annotations

from math import inf

import numpy as np
import pytest
from helpers.logs import make_log, solved, unsolved
from scipy.stats import bootstrap

from cbagan_ompl.benchmarking.intervals import median_interval, ratio, ratio_interval
from cbagan_ompl.benchmarking.logs import ExperimentLog
from cbagan_ompl.benchmarking.statistics import Summary, summarize


def by_sampler(logs: list[ExperimentLog]) -> dict[str, Summary]:
    return {summary.sampler: summary for summary in summarize(logs)}


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
    # None of the paths of uniform is within 5 %: its nodes are those that it has added in all.
    assert uniform.measures["nodes_to_5_percent"].median == 80
    assert uniform.censored["nodes_to_5_percent"] == 1
    assert learned.measures["nodes_to_5_percent"].median == 10
    assert learned.ratios["nodes_to_first"].median == 1
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
