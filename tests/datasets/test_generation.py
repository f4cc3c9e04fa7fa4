from __future__ import annotations

import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from helpers.fuzzing import mutations, read_all
from helpers.training_set import SMALL, assert_same_files

from cbagan_ompl import ConfigError, DatasetError
from cbagan_ompl.datasets.dataset import Dataset, load_dataset, read_image
from cbagan_ompl.datasets.generation import (
    RECORD,
    GenerationSettings,
    _generate_task,
    generate,
    generate_map,
)
from cbagan_ompl.datasets.geodesic import distance_field
from cbagan_ompl.datasets.importing import describe, write_dataset
from cbagan_ompl.map_generators import MAP_GENERATORS, MIN_SIZE
from cbagan_ompl.maps.connectivity import connects
from cbagan_ompl.maps.grid_map import GridMap


def test_one_process_writes_the_same_files_as_two(small_folder: Path, tmp_path: Path) -> None:
    generate(tmp_path / "again", SMALL, jobs=1, resume=False, progress=False)
    assert_same_files(small_folder, tmp_path / "again")


def test_an_interrupted_run_is_continued_to_the_same_files(
    small_folder: Path, tmp_path: Path
) -> None:
    path = tmp_path / "parts"
    generate(path, SMALL, jobs=1, resume=False, progress=False)
    # As if interrupted after the fourth map, while the fifth was written.
    for name in ("tasks/map_4.csv", "tasks/map_5.csv", "tasks/map_5/task_0.png", "train.csv"):
        (path / name).unlink()
    (path / "tasks/map_4/task_1_roi.png").write_bytes(b"half a file")
    generate(path, SMALL, jobs=1, resume=True, progress=False)
    assert_same_files(small_folder, path)


@pytest.mark.parametrize("size", [MIN_SIZE, 64])
def test_sets_of_all_generators(tmp_path: Path, size: int) -> None:
    settings = GenerationSettings(maps=len(MAP_GENERATORS), tasks=1, size=size, runs=1)
    assert settings.generators == tuple(MAP_GENERATORS)
    generate(tmp_path / "set", settings, jobs=1, resume=False, progress=False)
    generated = load_dataset(tmp_path / "set")
    assert len(generated.train) + len(generated.test) == len(MAP_GENERATORS)
    assert len(np.unique(generated.train.maps, axis=0)) == len(MAP_GENERATORS)


def test_another_seed_gives_other_maps_tasks_and_labels(
    small_dataset: Dataset, tmp_path: Path
) -> None:
    generate(tmp_path / "set", replace(SMALL, seed=1), jobs=1, resume=False, progress=False)
    other = load_dataset(tmp_path / "set")
    assert (other.train.maps != small_dataset.train.maps).any()
    assert (other.train.start != small_dataset.train.start).any()


def test_labels_hold_the_endpoints_and_lie_in_free_space(small_dataset: Dataset) -> None:
    for tasks in (small_dataset.train, small_dataset.test):
        for i in range(len(tasks)):
            region = tasks.region[i].astype(bool)
            start, goal = (
                tuple(points[i].astype(int).tolist()) for points in (tasks.start, tasks.goal)
            )
            assert not (region & ~tasks.free[i]).any()
            assert region[start[1], start[0]]
            assert connects(region, start, goal, connectivity=8)
            assert np.hypot(*(tasks.start[i] - tasks.goal[i])) >= 0.25 * 64


def test_copies_stay_with_their_original(small_dataset: Dataset) -> None:
    originals = [
        np.unique(np.array(part.map_of) // 2) for part in (small_dataset.train, small_dataset.test)
    ]
    assert not np.intersect1d(*originals).size
    assert describe(small_dataset)["shared_maps"] == 0


def test_copies_differ_from_their_original() -> None:
    settings = replace(SMALL, copies=3)
    original, *copies = (generate_map(settings, k) for k in range(3))
    assert all((copy != original).any() for copy in copies)
    assert np.array_equal(original, generate_map(replace(settings, copies=1), 0))


def test_a_folder_with_a_set_is_not_overwritten(small_folder: Path, tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="holds a set already"):
        generate(small_folder, SMALL, jobs=1, resume=False)
    with pytest.raises(ConfigError, match="other options"):
        generate(small_folder, replace(SMALL, runs=4), jobs=1, resume=True)
    (tmp_path / RECORD).write_text("{")
    with pytest.raises(DatasetError, match="cannot read how the set was made"):
        generate(tmp_path, SMALL, jobs=1, resume=True)


@pytest.mark.parametrize("name", ["maps", "tasks", "train.csv", "test.csv"])
def test_files_of_others_are_not_replaced(
    small_dataset: Dataset, tmp_path: Path, name: str
) -> None:
    (tmp_path / name).write_text("not ours")
    for write in (
        lambda: generate(tmp_path, SMALL, jobs=1, resume=False),
        lambda: generate(tmp_path, SMALL, jobs=1, resume=True),
        lambda: write_dataset(tmp_path, small_dataset),
    ):
        with pytest.raises(ConfigError, match=rf"other files that a set would replace \({name}\)"):
            write()
    assert [path.name for path in tmp_path.iterdir()] == [name]
    assert (tmp_path / name).read_text() == "not ours"


@pytest.mark.parametrize(
    "text",
    [
        "{",
        "[" * 100_000,
        "1" * 10_000,
        "\ud800",
        '{"settings": {}, "ompl": ' + "9" * 4000 + "}",
        " " * 2**21,
    ],
)
def test_damaged_records(tmp_path: Path, text: str) -> None:
    (tmp_path / RECORD).write_text(text, errors="surrogatepass")
    with pytest.raises((DatasetError, ConfigError), match=RECORD):
        generate(tmp_path, SMALL, jobs=1, resume=True)


def test_fuzzed_records(tmp_path: Path) -> None:
    generate(tmp_path, replace(SMALL, maps=2, tasks=1, split="task"), 1, False, progress=False)
    path = tmp_path / RECORD

    def resume(data: bytes) -> None:
        path.write_bytes(data)
        generate(tmp_path, SMALL, jobs=1, resume=True, progress=False)

    counts = read_all(resume, mutations([path.read_bytes()], 300, seed=0))
    assert counts == {"refused": 300}


def test_a_full_disk_leaves_no_half_files(tmp_path: Path) -> None:
    script = """
import resource, sys
from pathlib import Path
from cbagan_ompl.errors import DatasetError
from cbagan_ompl.datasets.generation import GenerationSettings, generate
settings = GenerationSettings(maps=2, tasks=40, runs=1, generators=("blocks",))
resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))  # less than the list of the tasks
if __name__ == "__main__":
    try:
        generate(Path(sys.argv[1]), settings, 1, False, False)
    except DatasetError as error:
        print(error)
"""
    (tmp_path / "script.py").write_text(script)
    done = subprocess.run(
        [sys.executable, "-B", str(tmp_path / "script.py"), str(tmp_path / "set")],
        capture_output=True, text=True, timeout=120,
    )  # fmt: skip
    assert re.match(r"cannot write .*/map_\d\.csv: File too large", done.stdout), done
    files = [path for path in (tmp_path / "set").rglob("*") if path.is_file()]
    assert files
    assert all(path.suffix in (".png", ".json") for path in files)
    for path in files:
        if path.suffix == ".png":
            read_image(path, 64)


@pytest.mark.parametrize(
    ("option", "value", "message"),
    [
        ("maps", 10**9, "at most 524288"),
        ("maps", "3", "maps is a whole number"),
        ("maps", True, "maps is a whole number"),
        ("tasks", 10**300, "at most 524288, got <an integer of 997 bits>"),
        ("tasks", 200_000, "up to 524288 tasks, 1200000 are asked for"),
        ("size", 5000, "at most 4096"),
        ("hard_fraction", "half", "hard_fraction is a finite number"),
        ("range", 10**400, "range must be above 0"),
        ("min_distance", 1j, "min_distance is a finite number"),
        ("seed", 1.5, "seed is a whole number"),
        ("maps", 0, "maps is a whole number of at least 1, got 0"),
        ("size", 40, "size is a whole number of at least 48, got 40"),
        (
            "generators",
            ("blocks", "castles"),
            "'castles'; there are blocked_cells, blocks",
        ),
        ("range", -1.0, "range must be above 0"),
        ("min_distance", 1.0, "min_distance"),
        ("test_fraction", 1.5, "1.5"),
        ("split", "wish", "'wish'"),
        ("seed", -1, "seed"),
        ("copies", 6, "a split by map needs two original maps"),
    ],
)
def test_options_that_make_no_sense(option: str, value: object, message: str) -> None:
    with pytest.raises(ConfigError, match=message):
        replace(SMALL, **{option: value})


def test_a_distance_that_no_task_has() -> None:
    free = np.zeros((64, 64), dtype=np.bool_)
    free[30:34, 30:34] = True
    with pytest.raises(DatasetError, match="ask for a smaller distance"):
        _generate_task(GridMap(free), SMALL, np.random.default_rng(0))


def test_exact_labels_of_varied_maps(tmp_path: Path) -> None:
    settings = GenerationSettings(
        maps=2, tasks=6, size=64, generators=("cell_maze",), varied=True, label="geodesic",
        hard_fraction=1.0, seed=3,
    )  # fmt: skip
    generate(tmp_path / "one", settings, jobs=1, resume=False, progress=False)
    generate(tmp_path / "two", settings, jobs=2, resume=False, progress=False)
    one, two = load_dataset(tmp_path / "one"), load_dataset(tmp_path / "two")
    for tasks, again in ((one.train, two.train), (one.test, two.test)):
        assert np.array_equal(tasks.region, again.region)
        assert np.array_equal(tasks.start, again.start)
        for i in range(len(tasks)):
            free = tasks.free[i]
            (u, v), (x, y) = tasks.start[i].astype(int), tasks.goal[i].astype(int)
            parts = cv2.connectedComponents(
                (tasks.region[i] > 0).astype(np.uint8) & free, connectivity=4
            )[1]
            assert parts[v, u] == parts[y, x] > 0
            shortest = distance_field(free, (int(u), int(v)))[y, x]
            assert shortest >= 1.25 * np.hypot(u - x, v - y)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"label": "guess"}, "rrt, geodesic"),
        ({"hard_fraction": 1.5}, "hard_fraction is a fraction"),
    ],
)
def test_options_of_exact_labels(options: dict[str, Any], message: str) -> None:
    with pytest.raises(ConfigError, match=message):
        GenerationSettings(**options)
