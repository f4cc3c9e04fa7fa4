"""Tasks without end: distances, labels, worlds, and training on them."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import fields, replace
from math import hypot, pi
from multiprocessing import active_children
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("numba")

from cbagan_ompl import ConfigError, DatasetError, MissingDependencyError
from cbagan_ompl.datasets.dataset import Tasks
from cbagan_ompl.datasets.geodesic import distances
from cbagan_ompl.datasets.synthetic import (
    EPSILON,
    HARD_DETOUR,
    SLACK,
    TASKS_PER_MAP,
    SyntheticSettings,
    concatenate_tasks,
    detour_heat,
    generate_map_tasks,
)
from cbagan_ompl.evaluation.metrics import connects
from cbagan_ompl.maps.grid_map import GridMap
from cbagan_ompl.sampling.heatmap import REGION_THRESHOLD
from cbagan_ompl.training.task_sources import SyntheticSchedule, SyntheticSource, synthetic_source

SMALL = SyntheticSettings(size=64, seed=3)
FEW = SyntheticSchedule(maps=2, held_back=1)


def equal(one: Tasks, other: Tasks) -> bool:
    return all(
        np.array_equal(getattr(one, field.name), getattr(other, field.name))
        for field in fields(Tasks)
    )


# --- distances ------------------------------------------------------------------------------------


@pytest.mark.parametrize("source", [(50, 40), (20, 20), (80, 60)])
def test_distances_in_the_open_are_straight(source: tuple[int, int]) -> None:
    measured = distances(np.ones((80, 100), np.bool_), source)
    rows, columns = np.ogrid[:80, :100]
    exact = np.hypot(rows - source[1], columns - source[0])
    assert measured[source[1], source[0]] == 0
    far = exact > 0
    assert (abs(measured - exact)[far] / exact[far]).max() < 0.015


@pytest.mark.parametrize("source", [(0, 0), (99, 3), (50, 0)])
def test_distances_from_a_border_are_straight_on_average(source: tuple[int, int]) -> None:
    # Where no disc without obstacles is around the source, the scheme errs most beside it.
    measured = distances(np.ones((80, 100), np.bool_), source)
    rows, columns = np.ogrid[:80, :100]
    exact = np.hypot(rows - source[1], columns - source[0])
    far = exact > 0
    assert abs(measured - exact).max() < 1.6
    assert (abs(measured - exact)[far] / exact[far]).mean() < 0.02


def test_distances_lead_around_a_wall() -> None:
    free = np.ones((256, 256), np.bool_)
    free[:160, 126:130] = False
    # Down to the pixel before the wall's one corner, along its end, and up from the other.
    expected = hypot(125 - 50, 160 - 60) + 5 + hypot(200 - 130, 160 - 60)
    assert distances(free, (50, 60))[60, 200] == pytest.approx(expected, rel=0.015)
    assert distances(free, (200, 60))[60, 50] == pytest.approx(expected, rel=0.015)


def test_distances_follow_a_narrow_ring() -> None:
    rows, columns = np.mgrid[:101, :101] - 50
    radius = np.hypot(rows, columns)
    half = distances((radius > 40) & (radius < 45), (9, 50))[50, 91]
    # No shorter than its inner edge, nor longer than by steps between neighbouring pixels.
    assert 41 * pi < half < 41 * pi * 8 / pi * (2**0.5 - 1)


def test_nothing_leads_through_a_closed_wall() -> None:
    free = np.ones((30, 30), np.bool_)
    free[10:20, 10] = free[10:20, 19] = free[10, 10:20] = free[19, 10:20] = False
    measured = distances(free, (14, 14))
    assert np.isfinite(measured[11:19, 11:19]).all()
    outside = np.ones_like(free)
    outside[11:19, 11:19] = False
    assert np.isinf(measured[outside]).all()
    # Nor between two obstacles that meet at their corners.
    free = np.array([[True, False], [False, True]])
    assert np.isinf(distances(free, (0, 0))[1, 1])


# --- labels ---------------------------------------------------------------------------------------


def heat_of(
    free: np.ndarray[Any, Any], start: tuple[int, int], goal: tuple[int, int]
) -> np.ndarray[Any, Any]:
    return detour_heat(distances(free, start), distances(free, goal), goal)


def test_heat_is_one_on_the_shortest_path_and_a_half_at_the_border() -> None:
    detour = EPSILON * 100 + SLACK
    # The start, a place on the way, the goal, one behind it, one on the border, and an obstacle.
    from_start = np.array([[0, 40, 100, 103, 50, np.inf]], np.float32)
    from_goal = np.array([[100, 60, 0, 3, 50 + detour, np.inf]], np.float32)
    heat = detour_heat(from_start, from_goal, (2, 0))[0]
    assert heat.tolist() == pytest.approx([1, 1, 1, 2 ** (-6 / detour), 0.5, 0])


def test_heat_joins_the_ends_through_free_space() -> None:
    free = np.ones((80, 100), np.bool_)
    free[:60, 50:53] = False
    heat = heat_of(free, (20, 20), (80, 20))
    assert heat.max() <= 1
    assert heat[20, 20] == pytest.approx(1, abs=0.02)
    assert (heat[~free] == 0).all()
    assert connects(heat >= REGION_THRESHOLD, (20, 20), (80, 20))
    assert heat[70, 99] < 0.01


def test_heat_keeps_both_of_two_ways_that_are_equally_long() -> None:
    free = np.ones((61, 100), np.bool_)
    free[20:41, 30:70] = False
    region = heat_of(free, (10, 30), (90, 30)) >= REGION_THRESHOLD
    for half in (slice(0, 31), slice(31, 61)):
        one = region.copy()
        one[half, 30:70] = False
        assert connects(one, (10, 30), (90, 30))


# --- worlds ---------------------------------------------------------------------------------------


def test_a_world_depends_on_seed_part_and_number_alone() -> None:
    world = generate_map_tasks(SMALL, 0, 5)
    assert equal(world, generate_map_tasks(SMALL, 0, 5))
    others = [(SMALL, 1, 5), (SMALL, 0, 6), (replace(SMALL, seed=4), 0, 5)]
    for settings, part, number in others:
        assert not np.array_equal(world.maps, generate_map_tasks(settings, part, number).maps)


@pytest.mark.parametrize("number", range(6))
def test_worlds_have_tasks_that_can_be_solved(number: int) -> None:
    world = generate_map_tasks(SMALL, 0, number)
    assert len(world) == TASKS_PER_MAP
    assert world.maps.shape == (1, 64, 64)
    assert world.region.shape == (TASKS_PER_MAP, 64, 64)
    assert world.region.dtype == np.float16
    free = world.maps[0].astype(bool)
    grid = GridMap(free)
    for start, goal, heat in zip(world.start, world.goal, world.region, strict=True):
        ends = [tuple(end.astype(int).tolist()) for end in (start, goal)]
        assert all(free[v, u] for u, v in ends)
        grid.check_task(start, goal)
        assert np.hypot(*(start - goal)) >= 0.2 * 64
        assert connects(heat >= REGION_THRESHOLD, *ends)
        assert (heat[~free] == 0).all()


def test_worlds_of_the_smallest_size() -> None:
    for number in range(8):
        assert generate_map_tasks(SyntheticSettings(size=48), 0, number).side == 48


def hard_share(settings: SyntheticSettings, maps: int) -> float:
    shares = []
    for number in range(maps):
        world = generate_map_tasks(settings, 0, number)
        for start, goal in zip(world.start.astype(int), world.goal.astype(int), strict=True):
            field = distances(world.maps[0].astype(bool), (start[0], start[1]))
            straight = np.hypot(*(start - goal))
            shares.append(field[goal[1], goal[0]] >= HARD_DETOUR * straight)
    return float(np.mean(shares))


def test_as_many_tasks_are_hard_as_were_asked_for() -> None:
    mazes = SyntheticSettings(size=64, families=("cell_maze",))
    shares = [hard_share(replace(mazes, hard_share=share), 40) for share in (0.2, 0.65, 1.0)]
    assert shares[1] == pytest.approx(0.65, abs=0.1)
    # Some of the mazes have too few tasks of a kind.
    assert shares[0] < 0.45
    assert shares[2] > 0.75


@pytest.mark.parametrize(
    ("option", "value", "message"),
    [
        ("size", 40, "size must be at least 48, got 40"),
        ("families", ("blocks", "castles"), "'castles'; there are blocked_cells, blocks"),
        ("families", (), "there are"),
        ("hard_share", 1.5, "hard_share is a fraction from 0 to 1, got 1.5"),
        ("seed", -1, "seed must be at least 0"),
    ],
)
def test_worlds_that_make_no_sense(option: str, value: Any, message: str) -> None:
    with pytest.raises(ConfigError, match=message):
        replace(SMALL, **{option: value})


@pytest.mark.parametrize("option", ["maps", "held_back", "jobs"])
def test_schedules_that_make_no_sense(option: str) -> None:
    with pytest.raises(ConfigError, match=f"{option} must be at least 1"):
        SyntheticSchedule(**{option: 0})


# --- the source -----------------------------------------------------------------------------------


@contextmanager
def threaded(settings: SyntheticSettings = SMALL) -> Iterator[SyntheticSource]:
    """A source whose worlds are drawn by a thread, which starts faster than a process."""
    with ThreadPoolExecutor(1) as pool:
        yield SyntheticSource(settings, FEW, pool)  # type: ignore[arg-type]


def test_processes_draw_what_the_seed_says() -> None:
    with synthetic_source(SMALL, FEW) as source:
        drawn = source.epoch(0), source.validation, source.test
        assert source.side == 64
        assert source.description()["train_tasks"] == len(drawn[0]) == 2 * TASKS_PER_MAP
    expected = concatenate_tasks([generate_map_tasks(SMALL, 0, n) for n in (0, 1)])
    assert equal(drawn[0], expected)
    assert equal(drawn[1], generate_map_tasks(SMALL, 1, 0))
    assert equal(drawn[2], generate_map_tasks(SMALL, 2, 0))


def test_every_epoch_has_new_tasks_and_the_same_ones_again() -> None:
    with threaded() as source, threaded() as again:
        epochs = [source.epoch(n) for n in range(3)]
        # As a resumed run does.
        assert equal(again.epoch(2), epochs[2])
        assert equal(again.validation, source.validation)
    with threaded(replace(SMALL, seed=4)) as other:
        assert not equal(other.epoch(0), epochs[0])
    maps = [*epochs, source.validation, source.test]
    assert len(np.unique(np.concatenate([tasks.maps for tasks in maps]), axis=0)) == 8
    for tasks in epochs:
        assert tasks.map_of.tolist() == [0] * TASKS_PER_MAP + [1] * TASKS_PER_MAP


def test_what_a_source_says_of_itself_can_be_written() -> None:
    with threaded() as source:
        description = source.description()
    assert json.loads(json.dumps(description)) == description
    assert (description["name"], description["maps"], description["side"]) == ("worlds", 2, 64)
    assert description["test_tasks"] == TASKS_PER_MAP
    assert description["worlds"]["seed"] == 3


def test_worlds_need_numba(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "numba", None)
    with (
        pytest.raises(MissingDependencyError, match=r"numba.*pip install 'cbagan-ompl\[train\]'"),
        synthetic_source(SMALL, FEW),
    ):
        pass


# --- training on worlds ---------------------------------------------------------------------------


def tiny() -> Any:
    from cbagan_ompl.training.config import TrainingConfig

    return TrainingConfig(
        epochs=2,
        batch_size=8,
        widths=(4, 4, 6, 8),
        stem=4,
        patch=2,
        metrics=1,
        white_obstacles=True,
        positive_weight=2.0,
        discriminator_width=4,
        adversarial_every=2,
    )


def test_a_resumed_run_on_worlds_equals_an_uninterrupted_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    torch = pytest.importorskip("torch")
    from cbagan_ompl.training import loop as training
    from cbagan_ompl.training.checkpoints import load_checkpoint

    def train(folder: str, resume: bool = False) -> dict[str, Any]:
        with threaded() as source:
            return training.train(
                source, tiny(), tmp_path / folder, resume=resume, device="cpu", progress=False
            )

    whole, step = train("whole"), training._train_epoch

    def interrupted(*args: Any) -> dict[str, float]:
        if args[4] == 1:
            raise KeyboardInterrupt
        return step(*args)

    with monkeypatch.context() as patch:
        patch.setattr(training, "_train_epoch", interrupted)
        with pytest.raises(KeyboardInterrupt):
            train("parts")
    parts = train("parts", resume=True)
    assert parts["test"] == whole["test"]
    one, other = (load_checkpoint(tmp_path / name / "last.pt") for name in ("whole", "parts"))
    assert one["dataset"] == other["dataset"]
    for name in ("generator", "map_discriminator", "average"):
        for key, value in one["networks"][name].items():
            assert torch.equal(value, other["networks"][name][key]), (name, key)

    other_tasks = pytest.raises(ConfigError, match="belongs to another data set")
    with threaded(replace(SMALL, seed=4)) as source, other_tasks:
        training.train(source, tiny(), tmp_path / "parts", resume=True, progress=False)


def run(*words: str) -> int:
    from cbagan_ompl.cli.train import add_train_parser

    parser = argparse.ArgumentParser()
    add_train_parser(parser.add_subparsers())
    args = parser.parse_args(["train", *words])
    return int(args.run(args))


def test_train_and_export_on_worlds(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("torch")
    from cbagan_ompl.inference.predictor import load_model
    from cbagan_ompl.training.export import export

    recipe = tmp_path / "recipe.json"
    recipe.write_text(json.dumps(tiny().updated({"epochs": 1}).to_dict()))
    words = ["--size", "64", "--maps", "2", "--held-back", "1", "--families", "blocks,caves"]
    words += ["--hard-share", "0.5", "--world-seed", "7", "--config", str(recipe)]
    words += ["--device", "cpu", "--output", str(tmp_path / "run")]
    assert run("--worlds", *words) == 0
    assert "16 training tasks an epoch, 8 for testing" in capsys.readouterr().out
    record = export(tmp_path / "run" / "best.pt", tmp_path / "worlds.pt")
    assert record["working_size"] == 64
    assert record["dataset"]["worlds"]["families"] == ["blocks", "caves"]
    assert record["dataset"]["worlds"]["hard_share"] == 0.5
    assert "2 new maps of 64 x 64" in (tmp_path / "worlds.md").read_text()
    grid = GridMap(np.ones((100, 70)))
    assert load_model(tmp_path / "worlds.pt").predict(grid, (5, 5), (60, 90)).region.any()


@pytest.mark.parametrize(
    ("words", "error", "message"),
    [
        (["set", "--worlds"], ConfigError, "give one of both"),
        ([], ConfigError, "give one of both"),
        (["--worlds", "--size", "72"], DatasetError, "a multiple of 16 pixels; these have 72"),
        (
            ["--worlds", "--size", "96", "--set", "patch=4"],
            DatasetError,
            "a multiple of 64 pixels; these have 96",
        ),
        (["--worlds", "--families", "castles"], ConfigError, "'castles'; there are blocked_cells"),
        (["--worlds", "--maps", "0"], ConfigError, "maps must be at least 1"),
        (["--worlds", "--hard-share", "2"], ConfigError, "hard_share"),
    ],
)
def test_bad_options_are_told_before_anything_is_drawn(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    words: list[str],
    error: type[Exception],
    message: str,
) -> None:
    pytest.importorskip("torch")
    # Whatever draws fails.
    monkeypatch.setattr("cbagan_ompl.training.task_sources.ProcessPoolExecutor", None)
    with pytest.raises(error, match=message):
        run(*words, "--output", str(tmp_path / "run"))
    assert not (tmp_path / "run").exists()


def test_a_drawing_process_that_dies_gives_a_clear_error() -> None:
    settings = SyntheticSettings(size=64, families=("blocks",))
    with synthetic_source(settings, SyntheticSchedule(maps=2, held_back=1)) as source:
        for child in active_children():
            child.kill()
        with pytest.raises(DatasetError, match="drew worlds has died"):
            source.epoch(0)
