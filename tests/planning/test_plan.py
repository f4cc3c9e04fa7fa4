from __future__ import annotations

import csv
import gc
import json
import resource
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.tasks import GOAL, START

from cbagan_ompl import (
    CbaganOmplError,
    ConfigError,
    GridMap,
    Heatmap,
    HeatmapError,
    MapError,
    PlannerError,
    PlanResult,
    Replanner,
    TaskError,
    bundled_maps,
    plan,
    tasks_of,
)
from cbagan_ompl.inference import model_loading
from cbagan_ompl.planning import compat, heatmap_sources
from cbagan_ompl.planning.heatmap_sources import resolve_auto
from cbagan_ompl.planning.hooks import hangs_on_python_termination
from cbagan_ompl.planning.path_files import path_csv


def check(result: PlanResult, grid: GridMap) -> None:
    assert result.solved, result.status
    assert grid.path_is_free(result.path)
    np.testing.assert_array_equal(result.path[0], result.start)
    assert np.hypot(*(result.path[-1] - result.goal)) <= result.goal_tolerance + 1e-9
    assert np.isclose(result.cost, np.hypot(*np.diff(result.path, axis=0).T).sum())
    assert result.nodes >= len(result.path)
    if result.nodes_at_first_solution is not None:
        assert 2 <= result.nodes_at_first_solution <= result.nodes
    steps = np.hypot(*np.diff(result.trajectory, axis=0).T)
    assert steps.max() <= grid.resolution / 2 * (1 + 1e-9)
    assert np.isclose(steps.sum(), result.cost)
    assert grid.is_free(result.trajectory).all()
    assert {*map(tuple, result.path)} <= {*map(tuple, result.trajectory)}
    assert result.total_s == result.inference_s + result.planning_s + result.simplify_s


@pytest.mark.parametrize("planner", ["RRT", "RRTstar", "InformedRRTstar", "PRM"])
@pytest.mark.parametrize("sampler", ["uniform", "corridor", "straight-line"])
def test_samplers_and_planners(two_walls: GridMap, planner: str, sampler: str) -> None:
    result = plan(two_walls, START, GOAL, planner, sampler, time=0.5, range=None, seed=1)
    check(result, two_walls)
    assert result.sampler == sampler
    assert (result.hook is None) == (sampler == "uniform")
    assert (result.sample_counts["learned"] > 0) == (sampler != "uniform")
    assert (result.inference_s > 0) == (sampler != "uniform")
    assert result.first_solution_s is not None
    assert 0 < result.first_solution_s <= result.planning_s
    assert (len(result.progress) > 0) == ("RRTstar" in planner)
    assert result.nodes_at_first_solution is not None
    if "star" not in planner:
        assert result.nodes_at_first_solution == result.nodes
    if len(result.progress):
        assert result.progress[0, 0] == result.first_solution_s
        assert (np.diff(result.progress[:, 1]) < 0).all()
        assert np.isclose(result.progress[-1, 1], result.cost)


@pytest.mark.parametrize("name", bundled_maps())
def test_bundled_tasks_can_be_solved(name: str) -> None:
    grid = GridMap.load(f"bundled:{name}")
    for task in tasks_of(f"bundled:{name}", grid):
        result = plan(grid, task.start, task.goal, "RRT", "corridor", time=10, range=20, seed=0)
        check(result, grid)


def test_corridor_beats_uniform_where_it_is_hard() -> None:
    """The oracle needs fewer iterations to a first solution: the hook does its work."""
    grid = GridMap.load("bundled:maze")
    task = tasks_of("bundled:maze", grid)[0]
    medians = {
        sampler: np.median(
            [
                plan(
                    grid, task.start, task.goal, "RRT", sampler, time=10, range=20, seed=seed
                ).nodes
                for seed in range(15)
            ]
        )
        for sampler in ("uniform", "corridor")
    }
    assert medians["corridor"] < 0.7 * medians["uniform"], medians


@pytest.mark.parametrize("sampler", ["uniform", "corridor"])
@pytest.mark.parametrize("planner", ["RRT", "RRTstar", "InformedRRTstar"])
def test_same_seed_same_plan(two_walls: GridMap, planner: str, sampler: str) -> None:
    runs = [
        plan(two_walls, START, GOAL, planner, sampler, time=30, iterations=700, range=20, seed=seed)
        for seed in (5, 5, 6)
    ]
    np.testing.assert_array_equal(runs[0].path, runs[1].path)
    assert runs[0].nodes == runs[1].nodes
    assert not np.array_equal(runs[0].path, runs[2].path)


def test_seed_is_reported_and_repeats_the_run(two_walls: GridMap) -> None:
    first = plan(two_walls, START, GOAL, "RRT", "corridor", time=10, range=20)
    again = plan(two_walls, START, GOAL, "RRT", "corridor", time=10, range=20, seed=first.seed)
    np.testing.assert_array_equal(first.path, again.path)


def test_world_frame(two_walls: GridMap) -> None:
    """The same map in metres, y up and turned: same result, up to the frame."""
    grid = GridMap(two_walls.free, 0.05, (-2.0, 7.0, 0.5))
    start, goal = grid.to_world([START, GOAL])
    result = plan(
        grid, start, goal, "RRTstar", "corridor", time=60, iterations=3000, range=1.0, seed=3
    )
    check(result, grid)
    assert 590 < result.cost / 0.05 < 640


def test_radius_keeps_clear_of_obstacles(two_walls: GridMap) -> None:
    result = plan(
        two_walls,
        START,
        GOAL,
        "RRTstar",
        "corridor",
        time=60,
        iterations=2000,
        radius=6,
        range=20,
        seed=0,
    )
    check(result, two_walls.inflated(6))
    blocked = np.argwhere(~two_walls.free)[:, ::-1]
    for start, end in zip(result.path[:-1], result.path[1:], strict=True):
        for point in np.linspace(start, end, 40):
            gap = np.maximum(np.maximum(blocked - point, point - blocked - 1), 0)
            assert np.hypot(*gap.T).min() >= 6


def test_simplify_shortens(two_walls: GridMap) -> None:
    plain = plan(two_walls, START, GOAL, "RRT", "corridor", time=5, range=20, seed=2)
    shorter = plan(
        two_walls, START, GOAL, "RRT", "corridor", time=5, range=20, seed=2, simplify=True
    )
    check(shorter, two_walls)
    assert shorter.cost < 0.97 * plain.cost
    assert shorter.simplify_s > 0


@pytest.mark.parametrize("sampler", ["uniform", "corridor"])
@pytest.mark.parametrize("planner", ["RRT", "RRTstar", "InformedRRTstar"])
def test_path_to_the_goal_itself(two_walls: GridMap, planner: str, sampler: str) -> None:
    result = plan(
        two_walls,
        START,
        GOAL,
        planner,
        sampler,
        time=5,
        iterations=1500,
        range=20,
        seed=0,
        goal_tolerance=0,
    )
    check(result, two_walls)
    np.testing.assert_array_equal(result.path[-1], GOAL)


def test_nodes_at_the_first_solution_are_those_of_a_run_that_ends_there(
    two_walls: GridMap,
) -> None:
    limits = {"time": 60, "range": 20, "seed": 4}
    whole = plan(two_walls, START, GOAL, "RRTstar", "corridor", iterations=3000, **limits)
    first = whole.nodes_at_first_solution
    assert first is not None
    assert first < whole.nodes
    # An iteration adds a node or none: the shortest run that has a solution has as many.
    low, high = 1, 3000
    while low < high:
        middle = (low + high) // 2
        run = plan(two_walls, START, GOAL, "RRTstar", "corridor", iterations=middle, **limits)
        low, high = (low, middle) if run.solved else (middle + 1, high)
    run = plan(two_walls, START, GOAL, "RRTstar", "corridor", iterations=low, **limits)
    assert run.nodes == run.nodes_at_first_solution == first


def test_own_heatmap(two_walls: GridMap, corridor: Heatmap) -> None:
    result = plan(two_walls, START, GOAL, "RRT", time=5, range=20, heatmap=corridor, seed=0)
    check(result, two_walls)
    assert result.sampler == "heatmap"
    assert result.sample_counts["learned"] > result.sample_counts["uniform"]


def test_snap_moves_endpoints_out_of_the_margin(two_walls: GridMap) -> None:
    start, options = (100.0, 58.0), {"time": 5, "radius": 6, "range": 20, "seed": 0}
    with pytest.raises(TaskError, match="too close to an obstacle of two_walls for the robot's"):
        plan(two_walls, start, GOAL, "RRT", "corridor", **options)
    result = plan(two_walls, start, GOAL, "RRT", "corridor", snap=9, **options)
    check(result, two_walls.inflated(6))
    move = result.snapped["start"]
    assert move["given"] == [100, 58]
    assert move["distance"] == np.hypot(*(result.start - start)) < 9
    assert result.snapped.keys() == {"start"}
    assert json.loads(json.dumps(result.to_dict()))["snapped"]["start"] == move
    with pytest.raises(TaskError, match=r"nothing within 1 of it is free"):
        plan(two_walls, start, GOAL, "RRT", "corridor", snap=1, **options)
    free = plan(two_walls, START, GOAL, "RRT", "corridor", snap=9, **options)
    assert free.snapped == {}
    np.testing.assert_array_equal(free.start, START)


def test_paths_are_written_as_tables(two_walls: GridMap, tmp_path: Path) -> None:
    result = plan(two_walls, START, GOAL, "RRT", "corridor", time=5, range=20, seed=0)
    result.save_csv(tmp_path / "path.csv")
    with open(tmp_path / "path.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert list(rows[0]) == ["x", "y", "index"]
    assert [int(row["index"]) for row in rows] == list(range(len(result.path)))
    table = np.array([(row["x"], row["y"]) for row in rows], float)
    np.testing.assert_array_equal(table, result.path)
    with pytest.raises(ConfigError, match="cannot write"):
        result.save_csv(tmp_path / "missing" / "path.csv")
    assert path_csv(np.array([[1, 2, 0.5]])) == "x,y,yaw,index\n1.0,2.0,0.5,0\n"
    assert path_csv(np.empty((0, 2))) == "x,y,index\n"


def test_unsolved_is_said(two_walls: GridMap) -> None:
    result = plan(
        two_walls, START, GOAL, "RRTstar", "uniform", time=5, iterations=20, range=5, seed=0
    )
    assert not result.solved
    assert result.path.shape == result.trajectory.shape == (0, 2)
    assert result.nodes_at_first_solution is None
    assert result.first_solution_s is None
    values = json.loads(json.dumps(result.to_dict(), allow_nan=False))
    assert values["cost"] is None
    assert values["path"] == []
    assert values["status"] != "Exact solution"


def test_json_fields(two_walls: GridMap) -> None:
    result = plan(
        two_walls, START, GOAL, "RRT", "corridor", time=5, range=20, seed=0, keep_tree=True
    )
    values = json.loads(json.dumps(result.to_dict(), allow_nan=False))
    assert set(values) >= {
        "solved", "planner", "sampler", "hook", "ompl_version", "seed", "path", "cost",
        "inference_s", "planning_s", "total_s", "nodes", "sample_counts", "first_solution_s",
        "trajectory", "nodes_at_first_solution",
    }  # fmt: skip
    assert not {"tree", "heatmap"} & set(values)
    assert set(values["sample_counts"]) == {"learned", "uniform"}
    assert values["ompl_version"] == compat.ompl_version()
    assert result.tree is not None
    assert result.tree.shape == (result.nodes - 1, 2, 2)


BAD = [
    ({"start": (300, 10)}, TaskError, "start .300, 10. is outside two_walls"),
    ({"goal": (100, 65)}, TaskError, "goal .100, 65. is in an obstacle"),
    ({"goal": START}, TaskError, "same point"),
    ({"start": (1, 2, 3)}, TaskError, "start has a yaw, but the robot, a point, has no heading"),
    ({"start": (1, 2, 3, 4)}, TaskError, "two finite numbers"),
    ({"start": (np.nan, 2)}, TaskError, "two finite numbers"),
    ({"start": "here"}, TaskError, "two finite numbers"),
    ({"planner": "RRTstarr"}, PlannerError, "no planner 'RRTstarr'.*RRTstar"),
    ({"planner": "SimpleSetup"}, PlannerError, "no planner 'SimpleSetup'"),
    ({"sampler": "magic"}, ConfigError, "no sampler 'magic'.*corridor"),
    ({"planner": "AORRTC"}, PlannerError, "no planner 'AORRTC' to use"),
    ({"time": 0}, ConfigError, "time"),
    ({"time": np.nan}, ConfigError, "time"),
    ({"iterations": 0}, ConfigError, "iterations"),
    ({"range": -1}, ConfigError, "range"),
    ({"planner": "PRM", "range": 2}, ConfigError, "PRM has no range"),
    ({"radius": -1}, MapError, "radius"),
    ({"radius": 500}, MapError, "fits nowhere"),
    ({"seed": -1}, ConfigError, "seed"),
    ({"uniform_fraction": 0, "sampler": "corridor"}, ConfigError, "uniform_fraction"),
    ({"snap": -1}, ConfigError, "snap"),
    ({"snap": "far"}, ConfigError, "snap"),
    ({"snap": None}, ConfigError, "snap"),
    ({"goal_tolerance": -1}, ConfigError, "goal_tolerance"),
    ({"seed": 1.5}, ConfigError, "seed is a whole number"),
    ({"time": "1"}, ConfigError, "time"),
    ({"time": None}, ConfigError, "time"),
    ({"iterations": 10.5}, ConfigError, "iterations"),
    ({"radius": None}, MapError, "radius"),
    ({"uniform_fraction": 0}, ConfigError, "uniform_fraction"),
    ({"uniform_fraction": "x"}, ConfigError, "uniform_fraction"),
    ({"sharpness": 0}, ConfigError, "sharpness"),
    ({"sharpness": "x"}, ConfigError, "sharpness"),
    ({"sampler": "learned", "heatmap": np.ones((3, 3))}, HeatmapError, "shape"),
    ({"sampler": "uniform", "model": "file"}, ConfigError, "uses no model"),
    ({"grid": "missing.png"}, MapError, "missing.png"),
]


@pytest.mark.parametrize(("changes", "kind", "message"), BAD)
def test_bad_input(
    two_walls: GridMap, changes: dict[str, Any], kind: type[CbaganOmplError], message: str
) -> None:
    arguments: dict[str, Any] = {
        "grid": two_walls, "start": START, "goal": GOAL, "sampler": "uniform", "time": 0.1
    }  # fmt: skip
    with pytest.raises(kind, match=message):
        plan(**(arguments | changes))


def test_separate_parts_are_told_at_once() -> None:
    free = np.ones((50, 50), bool)
    free[:, 25] = False
    with pytest.raises(TaskError, match=r"no path connects start \(10, 10\) and goal \(40, 10\)"):
        plan(GridMap(free), (10, 10), (40, 10), sampler="uniform", time=60)


def test_heatmap_of_another_map(two_walls: GridMap) -> None:
    other = Heatmap.uniform(GridMap(np.ones((5, 5))))
    with pytest.raises(HeatmapError, match=r"\(256, 256\).*\(5, 5\)"):
        plan(two_walls, START, GOAL, heatmap=other)


def test_numpy_scalars_are_numbers(two_walls: GridMap) -> None:
    result = plan(
        two_walls, START, GOAL, "RRT", "corridor", time=np.float32(5), iterations=np.int64(5000),
        range=np.float32(20), seed=np.int64(3), goal_tolerance=np.float32(1),
    )  # fmt: skip
    check(result, two_walls)
    json.dumps(result.to_dict(), allow_nan=False)


@pytest.mark.parametrize("planner", sorted(compat.planner_names() - {"BITstar"}))
def test_every_planner_comes_back(two_walls: GridMap, planner: str) -> None:
    result = plan(two_walls, START, GOAL, planner, "uniform", time=0.3, seed=1)
    assert result.planning_s < 2
    if result.solved:
        check(result, two_walls)


def test_prm_and_iterations(two_walls: GridMap) -> None:
    if hangs_on_python_termination("PRM"):
        with pytest.raises(ConfigError, match=r"PRM .*cannot be limited by iterations"):
            plan(two_walls, START, GOAL, "PRM", "uniform", iterations=10)


@pytest.mark.slow
@pytest.mark.parametrize("planner", ["RRT", "InformedRRTstar", "PRM"])
def test_memory_does_not_grow(planner: str) -> None:
    """1,000 plans in one process: less than 5 % of growth."""
    free = np.ones((32, 32), bool)
    free[10, :28] = False
    grid = GridMap(free)

    def run(times: int) -> int:
        for seed in range(times):
            limit = {"time": 0.005} if planner == "PRM" else {"iterations": 40}
            plan(grid, (3, 3), (3, 28), planner, "corridor", range=None, seed=seed, **limit)
        gc.collect()
        return resident()

    before = run(150)
    assert run(1000) < 1.05 * before


def resident() -> int:
    """Resident memory in pages."""
    with open("/proc/self/statm") as statm:
        return int(statm.read().split()[1]) * resource.getpagesize()


# --- the sampler "auto" -------------------------------------------------------------------------


def test_auto_takes_the_corridor_on_small_maps() -> None:
    grid = GridMap(np.ones((100, 100), bool))
    result = plan(grid, (5, 5), (90, 90), "RRT", "auto", seed=1)
    assert result.sampler == "corridor"
    assert result.sample_counts["learned"] > 0


def test_auto_takes_the_network_on_large_maps(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("torch")
    monkeypatch.setattr(heatmap_sources, "MOST_CORRIDOR_PIXELS", 150 * 150)
    grid = GridMap(np.ones((200, 200), bool))
    assert plan(grid, (5, 5), (190, 190), "RRT", "auto", seed=1).sampler == "learned"


def test_auto_without_torch_takes_the_corridor(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(heatmap_sources, "MOST_CORRIDOR_PIXELS", 150 * 150)
    monkeypatch.setattr(model_loading, "find_spec", lambda name: None)
    grid = GridMap(np.ones((200, 200), bool))
    assert resolve_auto("auto", "model.pt", grid) == ("corridor", None)
    assert resolve_auto("learned", "model.pt", grid) == ("learned", "model.pt")


def test_auto_of_a_replanner(two_walls: GridMap) -> None:
    replanner = Replanner(two_walls, GOAL, sampler="auto", seed=1)
    first, second = replanner.plan(START), replanner.plan(START)
    assert first.sampler == second.sampler
    assert second.sampler != "auto"


def test_auto_takes_no_heat_map(two_walls: GridMap) -> None:
    with pytest.raises(ConfigError, match="auto sampler uses no model and no heat map"):
        plan(two_walls, START, GOAL, "RRT", "auto", heatmap=np.ones(two_walls.shape))
