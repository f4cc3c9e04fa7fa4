"""Misuse of the public API: every wrong argument ends in an error of this package, or works."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.misuse import GOAL, GRID, HEATMAP, POOL, START

import cbagan_ompl
from cbagan_ompl import (
    Adaptation,
    CbaganOmplError,
    GridMap,
    GridMotionValidator,
    GridValidityChecker,
    HeadingSpread,
    Heatmap,
    HeatmapStateSampler,
    HeatmapValidStateSampler,
    Predictor,
    Replanner,
    Robot,
    RobotMotionValidator,
    RobotValidityChecker,
    SamplerOptions,
    attach,
    load_model,
    load_tasks,
    plan,
    save_figure,
    state_sampler_allocator,
    tasks_of,
    valid_state_sampler_allocator,
)
from cbagan_ompl.planning import compat
from cbagan_ompl.planning.compat import og, ou
from cbagan_ompl.planning.problem import make_setup
from cbagan_ompl.planning.workspace import Workspace
from cbagan_ompl.sampling.sampler import HeatmapSampler


@cache
def model() -> Predictor:
    return load_model()


def fresh_setup() -> Any:
    setup = make_setup(Workspace(GRID), GRID.check_task(START, GOAL), 1.0)
    setup.setPlanner(og.RRT(setup.getSpaceInformation()))
    return setup


def run_plan(**changes: Any) -> object:
    arguments = {"grid": GRID, "start": START, "goal": GOAL, "planner": "RRT", "time": 0.05}
    arguments |= {"sampler": "uniform", "seed": 1}
    return plan(**(arguments | changes))


def run_attach(setup: Any = None, heatmap: Any = HEATMAP, **changes: Any) -> None:
    attach(fresh_setup() if setup is None else setup, heatmap, **changes).detach()


def without_planner() -> Any:
    return make_setup(Workspace(GRID), GRID.check_task(START, GOAL), 1.0)


def space_information() -> Any:
    return fresh_setup().getSpaceInformation()


def run_figure(**changes: Any) -> None:
    save_figure(**({"result": run_plan(), "grid": GRID, "path": "/dev/null/x.png"} | changes))


#: The sampler's options, and the arguments of plan but for its time.
OPTIONS = ("uniform_fraction", "sharpness", "adaptation", "seed")
PLAN_ARGUMENTS = (
    "snap",
    "grid",
    "start",
    "goal",
    "planner",
    "sampler",
    "iterations",
    "range",
    "radius",
    "model",
    "heatmap",
    "overlap",
    "simplify",
    "goal_tolerance",
    "keep_tree",
    "options",
    "unknown_keyword",
    *OPTIONS,
)

#: Callables of the public API, by name, each with one argument that gets every value of the pool.
CALLS: dict[str, Callable[[Any], object]] = {
    # Numbers, points, maps.
    "GridMap(free)": GridMap,
    "GridMap(resolution)": lambda value: GridMap([[1]], value),
    "GridMap(origin)": lambda value: GridMap([[1]], 1.0, value),
    "GridMap(origin-x)": lambda value: GridMap([[1]], 1.0, (value, 0.0, 0.0)),
    "GridMap(name)": lambda value: GridMap([[1]], name=value),
    "GridMap(unknown)": lambda value: GridMap(np.ones((24, 24)), unknown=value),
    "GridMap.load": GridMap.load,
    "GridMap.inflated": GRID.inflated,
    "GridMap.is_free": GRID.is_free,
    "GridMap.to_pixel": GRID.to_pixel,
    "GridMap.to_world": GRID.to_world,
    "GridMap.path_is_free": GRID.path_is_free,
    "GridMap.check_task": lambda value: GRID.check_task(value, GOAL),
    "GridMap.check_task(x)": lambda value: GRID.check_task((value, 3.0), GOAL),
    # Heat maps and options.
    "Heatmap(values)": lambda value: Heatmap(value, GRID),
    "Heatmap(grid)": lambda value: Heatmap(np.ones((24, 24)), value),
    "Heatmap.load(path)": lambda value: Heatmap.load(value, GRID),
    "Heatmap.load(grid)": lambda value: Heatmap.load("x.npy", value),
    "Heatmap.uniform": Heatmap.uniform,
    "Heatmap.corridor(grid)": lambda value: Heatmap.corridor(value, START, GOAL),
    "Heatmap.corridor(start)": lambda value: Heatmap.corridor(GRID, value, GOAL),
    "Heatmap.straight_line(grid)": lambda value: Heatmap.straight_line(value, START, GOAL),
    "Heatmap.straight_line(goal)": lambda value: Heatmap.straight_line(GRID, START, value),
    "Heatmap.connects": lambda value: HEATMAP.connects(value, GOAL),
    "Heatmap.connected": lambda value: HEATMAP.connected(START, value),
    "Heatmap.sample(n)": HEATMAP.sample,
    "Heatmap.sample(rng)": lambda value: HEATMAP.sample(1, value),
    "Adaptation": Adaptation,
    "Adaptation.of": Adaptation.of,
    "Adaptation.of(name)": lambda value: Adaptation.of([value]),
    "SamplerOptions(uniform_fraction)": lambda value: SamplerOptions(uniform_fraction=value),
    "SamplerOptions(sharpness)": lambda value: SamplerOptions(sharpness=value),
    "SamplerOptions(adaptation)": lambda value: SamplerOptions(adaptation=value),
    "SamplerOptions(seed)": lambda value: SamplerOptions(seed=value),
    "HeatmapSampler(heatmap)": HeatmapSampler,
    "HeatmapSampler(options)": lambda value: HeatmapSampler(HEATMAP, value),
    # Planning.
    **{
        f"plan({name})": lambda value, name=name: run_plan(**{name: value})
        for name in PLAN_ARGUMENTS
    },
    "plan(time)": lambda value: run_plan(time=value, iterations=500),
    "plan(own heatmap)": lambda value: run_plan(heatmap=value, sampler="learned", iterations=200),
    "plan(own model)": lambda value: run_plan(model=value, sampler="learned"),
    "attach(setup)": lambda value: run_attach(value),
    "attach(heatmap)": lambda value: run_attach(heatmap=value),
    "attach(options)": lambda value: run_attach(options=value),
    "attach(seed)": lambda value: run_attach(seed=value),
    "attach(unknown_keyword)": lambda value: run_attach(unknown_keyword=value),
    "HeatmapStateSampler(space)": lambda value: HeatmapStateSampler(value, HEATMAP),
    "HeatmapStateSampler(heatmap)": lambda value: HeatmapStateSampler(
        fresh_setup().getStateSpace(), value
    ),
    "HeatmapValidStateSampler(si)": lambda value: HeatmapValidStateSampler(value, HEATMAP),
    "HeatmapValidStateSampler(heatmap)": lambda value: HeatmapValidStateSampler(
        space_information(), value
    ),
    "state_sampler_allocator": state_sampler_allocator,
    "valid_state_sampler_allocator": valid_state_sampler_allocator,
    "GridValidityChecker(si)": lambda value: GridValidityChecker(value, GRID),
    "GridValidityChecker(grid)": lambda value: GridValidityChecker(space_information(), value),
    "GridMotionValidator(si)": lambda value: GridMotionValidator(value, GRID),
    "GridMotionValidator(grid)": lambda value: GridMotionValidator(space_information(), value),
    # Robots.
    "Robot.disc": Robot.disc,
    "Robot.rectangle(length)": lambda value: Robot.rectangle(value, 1.0),
    "Robot.rectangle(width)": lambda value: Robot.rectangle(1.0, value),
    "Robot.rectangle(turning_radius)": lambda value: Robot.rectangle(1.0, 1.0, value),
    "Robot.rectangle(reverse)": lambda value: Robot.rectangle(1.0, 1.0, reverse=value),
    "Robot.polygon(vertices)": Robot.polygon,
    "RobotValidityChecker(si)": lambda value: RobotValidityChecker(value, GRID, Robot.point()),
    "RobotValidityChecker(robot)": lambda value: RobotValidityChecker(
        space_information(), GRID, value
    ),
    "RobotMotionValidator(grid)": lambda value: RobotMotionValidator(
        space_information(), value, Robot.point()
    ),
    "RobotMotionValidator(robot)": lambda value: RobotMotionValidator(
        space_information(), GRID, value
    ),
    "plan(robot)": lambda value: run_plan(robot=value),
    "plan(several goals)": lambda value: run_plan(goal=[GOAL, value]),
    "HeadingSpread(spread)": HeadingSpread,
    "HeadingSpread(uniform_fraction)": lambda value: HeadingSpread(uniform_fraction=value),
    "Replanner(grid)": lambda value: Replanner(value, GOAL, sampler="uniform"),
    "Replanner(sampler)": lambda value: Replanner(GRID, GOAL, sampler=value),
    "Replanner(model)": lambda value: Replanner(GRID, GOAL, model=value),
    "Replanner(seed)": lambda value: Replanner(GRID, GOAL, sampler="uniform", seed=value),
    # Files.
    "load_tasks(path)": lambda value: load_tasks(value, GRID),
    "load_tasks(grid)": lambda value: load_tasks("/nonexistent/x.csv", value),
    "tasks_of(path)": lambda value: tasks_of(value, GRID),
    "save_figure(result)": lambda value: run_figure(result=value),
    "save_figure(grid)": lambda value: run_figure(grid=value),
    "save_figure(path)": lambda value: run_figure(path=value),
    "load_model": load_model,
    "Predictor.predict(grid)": lambda value: model().predict(value, START, GOAL),
    "Predictor.predict_many(starts)": lambda value: model().predict_many(GRID, value, [GOAL]),
    "Predictor.predict(start)": lambda value: model().predict(GRID, value, GOAL),
}


@pytest.fixture(autouse=True)
def quiet(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    ou.setLogLevel(ou.LOG_NONE)
    monkeypatch.chdir(tmp_path)


def outcome(call: Callable[[], object]) -> str:
    """Return "worked" or the class of the error; any other exception fails the test."""
    try:
        call()
    except CbaganOmplError as error:
        said = error
    else:
        return "worked"
    assert 0 < len(str(said)) < 1000
    return type(said).__name__


@pytest.mark.parametrize("name", CALLS)
def test_every_wrong_argument_is_named_or_works(name: str) -> None:
    counts = Counter()
    for label, value in POOL.items():
        try:
            counts[outcome(lambda value=value: CALLS[name](value))] += 1
        except Exception as error:
            raise AssertionError(f"{name} with {label}: {error!r}") from error
    assert sum(counts.values()) == len(POOL)


def test_the_table_covers_the_public_names() -> None:
    assert len(CALLS) * len(POOL) >= 2500
    callables = {name.partition("(")[0].partition(".")[0] for name in CALLS}
    made_by_us = {"Attachment", "Guarantee", "PlanResult", "Task"}
    no_arguments = {"bundled_maps", "reached_control_planners", "reached_planners"}
    errors = {name for name in cbagan_ompl.__all__ if name.endswith(("Error", "Warning"))}
    assert set(cbagan_ompl.__all__) <= callables | made_by_us | no_arguments | errors


def test_what_is_no_setup_is_said() -> None:
    kinds = (None, 5, og.RRT(space_information()), space_information(), HEATMAP)
    assert {outcome(lambda kind=kind: attach(kind, HEATMAP)) for kind in kinds} == {"PlannerError"}
    assert outcome(lambda: attach(without_planner(), HEATMAP)) == "PlannerError"


def run_state_sampler(**junk: Any) -> None:
    space = fresh_setup().getStateSpace()
    state = compat.new_state(space)
    sampler = HeatmapStateSampler(**({"space": space, "heatmap": HEATMAP} | junk))
    sampler.sampleUniform(compat.typed_state(state))


def run_valid_state_sampler(**junk: Any) -> None:
    HeatmapValidStateSampler(**({"si": space_information(), "heatmap": HEATMAP} | junk))


#: Calls of the planning side, by name, with the arguments that get junk.
FUZZED: dict[str, tuple[Callable[..., object], tuple[str, ...]]] = {
    "options": (SamplerOptions, OPTIONS),
    "attach": (run_attach, ("setup", "heatmap", "options", *OPTIONS)),
    "plan": (run_plan, (*PLAN_ARGUMENTS, "sampler", "planner")),
    "state sampler": (run_state_sampler, ("space", "heatmap", "options", *OPTIONS)),
    "valid state sampler": (run_valid_state_sampler, ("si", "heatmap", "options", *OPTIONS)),
}


def fuzz(seed: int, count: int) -> Counter[tuple[str, str]]:
    """Call each of :data:`FUZZED` with several wrong arguments at once; count the outcomes."""
    rng = np.random.default_rng(seed)
    values = list(POOL.values())
    counts: Counter[tuple[str, str]] = Counter()
    for i in range(count):
        name = list(FUZZED)[i % len(FUZZED)]
        call, names = FUZZED[name]
        chosen = rng.permutation(len(names))[: int(rng.integers(1, 4))]
        junk = {names[j]: values[int(rng.integers(len(values)))] for j in chosen}
        try:
            counts[name, outcome(lambda call=call, junk=junk: call(**junk))] += 1
        except Exception as error:
            raise AssertionError(f"{name} with {sorted(junk)}, call {i}: {error!r}") from error
    return counts


@pytest.mark.parametrize(
    ("seed", "count"), [(0, 250), pytest.param(1, 2000, marks=pytest.mark.slow)]
)
def test_several_wrong_arguments_at_once(seed: int, count: int) -> None:
    counts = fuzz(seed, count)
    assert sum(counts.values()) == count
    assert {name for name, _ in counts} == set(FUZZED)
    refused = sum(n for (_, kind), n in counts.items() if kind != "worked")
    assert count / 2 < refused < count
