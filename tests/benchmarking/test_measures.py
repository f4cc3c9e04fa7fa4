from __future__ import annotations

import numpy as np
import pytest
from helpers.benchmarks import Finished
from helpers.logs import NO_SAMPLES, make_log, solved, unsolved

from cbagan_ompl.benchmarking.measures import (
    improvements_of,
    logged_costs,
    thresholds,
)
from cbagan_ompl.planning.ompl_benchmark import RunRecord


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
    assert first["nodes at first solution INTEGER"] == "10"
    assert first["nodes to 10 percent INTEGER"] == "20"
    assert first["nodes to 5 percent INTEGER"] == "30"
    assert first["nodes added INTEGER"] == "80"
    assert second["checked solution BOOLEAN"] == "0"
    assert {second[name] for name in first if "cost" in name or "to " in name} == {""}
    assert second["nodes added INTEGER"] == "100"  # those at the end, since nobody tells
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
    record = RunRecord(0.0, NO_SAMPLES, 1, 7.5, [])
    history = [(0.2, 9.0, 60), (0.4, 8.0, 60), (0.5, 7.5, 60)]
    assert improvements_of(record, points, 0.5, 60) == history
    assert improvements_of(record, (), 0.5, 60) == [(0.5, 7.5, 60)]
    assert improvements_of(unsolved(), points, 0.5, 60) == []
    roadmap = [{**points[1], "milestone count INTEGER": "20"}]
    assert improvements_of(record, roadmap, 0.5, 60) == [(0.2, 9.0, 20), (0.5, 7.5, 60)]
    run = {
        "simplification time REAL": "0",
        "first solution time REAL": "0.15",
        "first solution cost REAL": "10",
        "checked solution cost REAL": "7.5",
        "time REAL": "0.5",
    }
    assert logged_costs(run, points) == [(0.15, 10.0), (0.2, 9.0), (0.4, 8.0), (0.5, 7.5)]


def test_measures_of_runs_agree(finished: Finished) -> None:
    for log in finished.logs:
        costs = [
            float(run["checked solution cost REAL"])
            for planner in log.planners
            for run in planner.runs
            if run["checked solution BOOLEAN"] == "1"
        ]
        assert len(costs) > 8
        given = 1.0 if log.name == "walls_1" else np.inf
        best = float(log.parameters["best_known_cost REAL"])
        assert best == pytest.approx(min(*costs, given))
        for planner in log.planners:
            for run in planner.runs:
                if run["checked solution BOOLEAN"] == "1":
                    cost = float(run["checked solution cost REAL"])
                    assert cost == pytest.approx(float(run["solution length REAL"]), rel=1e-4)
                    assert float(run["first solution cost REAL"]) >= cost * (1 - 1e-6)
                    assert 0 < float(run["first solution time REAL"]) <= float(run["time REAL"])
                    assert float(run["cost at 100 ms REAL"]) == pytest.approx(cost)
                assert int(run["collision checks INTEGER"]) > int(run["graph states INTEGER"]) / 2


def test_the_users_threshold_has_a_property_of_its_own() -> None:
    run = solved((0.1, 150.0), (0.3, 118.0), (0.7, 101.0))
    log = make_log("m", {"RRTstar_learned": [run]}, 100.0, thresholds(20))
    properties = log.planners[0].runs[0]
    assert properties["time to 20 percent REAL"] == "0.3"
    assert properties["time to 10 percent REAL"] == "0.7"
    assert properties["time to 2 percent REAL"] == "0.7"


def test_a_simplified_path_comes_after_the_first_one() -> None:
    record = RunRecord(0.0, NO_SAMPLES, 1, 130.0, [], simplify_s=0.2, simplified_cost=104.0)
    log = make_log("m", {"RRTConnect_uniform": [record]}, optimal_cost=100.0)
    (run,) = log.planners[0].runs
    assert run["first solution time REAL"] == "0.9"
    assert run["first solution cost REAL"] == "130"
    assert run["time to 5 percent REAL"] == "1.1"
    assert run["checked solution cost REAL"] == "104"
    assert run["simplification time REAL"] == "0.2"
    assert logged_costs(run, ()) == [(0.9, 130.0), (1.1, 104.0)]
