from __future__ import annotations

import contextlib
import csv
import filecmp
import json
import os
import signal
import struct
import tarfile
import time
import zipfile
import zlib
from dataclasses import replace
from multiprocessing import active_children
from multiprocessing.context import ForkServerProcess
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from helpers.interrupting import interrupted
from helpers.training_set import write_training_set

from cbagan_ompl import ConfigError, DatasetError
from cbagan_ompl.cli import main
from cbagan_ompl.common.parallel import run_all
from cbagan_ompl.datasets import augmentation
from cbagan_ompl.datasets.augmentation import augmented
from cbagan_ompl.datasets.dataset import Dataset, load_dataset
from cbagan_ompl.datasets.generation import (
    RECORD,
    GenerationSettings,
    _draw_task,
    draw_map,
    generate,
)
from cbagan_ompl.datasets.geodesic import distances
from cbagan_ompl.datasets.importing import described, read_set, write_dataset
from cbagan_ompl.datasets.rrt_labels import rrt_region
from cbagan_ompl.datasets.splits import is_test_task
from cbagan_ompl.evaluation.label_noise import label_noise
from cbagan_ompl.evaluation.metrics import connects
from cbagan_ompl.map_generators import MAP_GENERATORS, MIN_SIDE
from cbagan_ompl.maps.grid_map import GridMap

SMALL = GenerationSettings(maps=6, tasks=3, copies=2, runs=3, families=("blocks", "triangles"))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("sets") / "small"
    generate(path, SMALL, jobs=2, resume=False, progress=False)
    return path


@pytest.fixture(scope="module")
def dataset(folder: Path) -> Dataset:
    return load_dataset(folder)


def files(root: Path) -> set[str]:
    return {str(path.relative_to(root)) for path in root.rglob("*") if path.is_file()}


def assert_same_files(one: Path, other: Path) -> None:
    names = files(one)
    assert names == files(other)
    assert filecmp.cmpfiles(one, other, names, shallow=False)[1:] == ([], [])


# --- generated sets -------------------------------------------------------------------------------


def test_one_process_writes_the_same_files_as_two(folder: Path, tmp_path: Path) -> None:
    generate(tmp_path / "again", SMALL, jobs=1, resume=False, progress=False)
    assert_same_files(folder, tmp_path / "again")


def test_an_interrupted_run_goes_on_to_the_same_files(folder: Path, tmp_path: Path) -> None:
    path = tmp_path / "parts"
    generate(path, SMALL, jobs=1, resume=False, progress=False)
    # As if interrupted after the fourth map, in the middle of the fifth.
    for name in ("tasks/map_4.csv", "tasks/map_5.csv", "tasks/map_5/task_0.png", "train.csv"):
        (path / name).unlink()
    (path / "tasks/map_4/task_1_roi.png").write_bytes(b"half a file")
    generate(path, SMALL, jobs=1, resume=True, progress=False)
    assert_same_files(folder, path)


@pytest.mark.parametrize("size", [MIN_SIDE, 64])
def test_sets_of_all_families(tmp_path: Path, size: int) -> None:
    settings = GenerationSettings(maps=len(MAP_GENERATORS), tasks=1, size=size, runs=1)
    assert settings.families == tuple(MAP_GENERATORS)
    generate(tmp_path / "set", settings, jobs=1, resume=False, progress=False)
    made = load_dataset(tmp_path / "set")
    assert len(made.train) + len(made.test) == len(MAP_GENERATORS)
    assert len(np.unique(made.train.maps, axis=0)) == len(MAP_GENERATORS)


def test_another_seed_gives_other_maps_tasks_and_labels(dataset: Dataset, tmp_path: Path) -> None:
    generate(tmp_path / "set", replace(SMALL, seed=1), jobs=1, resume=False, progress=False)
    other = load_dataset(tmp_path / "set")
    assert (other.train.maps != dataset.train.maps).any()
    assert (other.train.start != dataset.train.start).any()


def test_labels_hold_the_ends_and_lie_in_free_space(dataset: Dataset) -> None:
    for tasks in (dataset.train, dataset.test):
        for i in range(len(tasks)):
            region = tasks.region[i].astype(bool)
            start, goal = (tuple(end[i].astype(int).tolist()) for end in (tasks.start, tasks.goal))
            assert not (region & ~tasks.free[i]).any()
            assert region[start[1], start[0]]
            assert connects(region, start, goal)
            assert np.hypot(*(tasks.start[i] - tasks.goal[i])) >= 0.25 * 64


def test_copies_stay_with_their_original(dataset: Dataset) -> None:
    originals = [np.unique(np.array(part.map_of) // 2) for part in (dataset.train, dataset.test)]
    assert not np.intersect1d(*originals).size
    assert described(dataset)["shared_maps"] == 0


def test_the_list_of_a_map_says_where_its_tasks_are(folder: Path, dataset: Dataset) -> None:
    with (folder / "train.csv").open() as file:
        first = next(csv.DictReader(file))
    number = Path(first["task"]).stem.removeprefix("task_")
    with (folder / "tasks" / f"{Path(first['map']).stem}.csv").open() as file:
        row = list(csv.DictReader(file))[int(number)]
    (u, v), (x, y) = dataset.train.start[0] - 0.5, dataset.train.goal[0] - 0.5
    assert [float(row[k]) for k in ("istart", "jstart", "igoal", "jgoal")] == [v, u, y, x]
    assert float(row["euclid"]) == pytest.approx(np.hypot(u - x, v - y))


def test_a_folder_with_a_set_is_not_overwritten(folder: Path, tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="holds a set already"):
        generate(folder, SMALL, jobs=1, resume=False)
    with pytest.raises(ConfigError, match="other options"):
        generate(folder, replace(SMALL, runs=4), jobs=1, resume=True)
    (tmp_path / RECORD).write_text("{")
    with pytest.raises(DatasetError, match="cannot read how the set was made"):
        generate(tmp_path, SMALL, jobs=1, resume=True)


@pytest.mark.parametrize(
    ("option", "value", "message"),
    [
        ("maps", 0, "maps must be at least 1"),
        ("size", 40, "size must be at least 48, got 40"),
        ("families", ("blocks", "castles"), "'castles'; there are blocked_cells, blocks, bug_trap"),
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
        _draw_task(GridMap(free), SMALL, np.random.default_rng(0))


# --- labels ---------------------------------------------------------------------------------------


def test_labels_are_seeded_and_differ() -> None:
    grid = GridMap(draw_map(SMALL, 0))
    rows, columns = np.nonzero(grid.free)
    task = grid.check_task((columns[0] + 0.5, rows[0] + 0.5), (columns[-1] + 0.5, rows[-1] + 0.5))
    one, same, other = (rrt_region(grid, task, 3, 2.0, 5000, seed) for seed in (5, 5, 6))
    assert np.array_equal(one, same)
    assert (one != other).any()
    more = rrt_region(grid, task, 12, 2.0, 5000, 5)
    assert not (one & ~more).any(), "further runs only add pixels"
    assert not rrt_region(grid, task, 3, 2.0, 5, 5).any(), "five iterations find no path"


def test_noise_of_labels(dataset: Dataset) -> None:
    noise = label_noise(dataset.test, runs=3, range=1.0, seed=0, jobs=1, progress=False)
    assert 0.05 < noise["two labels"]["iou"] < 1
    assert noise["majority"]["iou"] > 0
    again = label_noise(dataset.test, runs=3, range=1.0, seed=0, jobs=2, progress=False)
    assert again == noise
    with pytest.raises(ConfigError, match="runs"):
        label_noise(dataset.test, runs=0, range=1.0, seed=0, jobs=1)


# --- augmentation ---------------------------------------------------------------------------------


def test_augmented_maps_are_the_same_obstacles_elsewhere() -> None:
    free = np.ones((64, 64), dtype=np.bool_)
    free[20:34, 24:40] = False
    turned = 0
    for seed in range(40):
        copy = augmented(free, np.random.default_rng(seed))
        assert np.array_equal(copy, augmented(free, np.random.default_rng(seed)))
        # A turned or leaning box keeps its area, but for the pixels at its rim.
        assert abs(int((~copy).sum()) - int((~free).sum())) < 0.12 * (~free).sum()
        upright = (~copy).any(axis=0).sum() <= 16 + 3
        turned += not upright
        if upright and (~copy).any(axis=1).sum() <= 14 + 2:
            rows = np.nonzero((~copy).any(axis=1))[0]
            assert abs(rows.mean() - 26.5) <= augmentation.SHIFT + 14
    assert 8 <= turned <= 32, "about half of the copies are turned"


def test_copies_differ_from_their_original() -> None:
    settings = replace(SMALL, copies=3)
    original, *copies = (draw_map(settings, k) for k in range(3))
    assert all((copy != original).any() for copy in copies)
    assert np.array_equal(original, draw_map(replace(settings, copies=1), 0))


# --- splits and imports ---------------------------------------------------------------------------


def test_splits() -> None:
    originals = np.repeat(np.arange(10), 20)
    by_task = is_test_task("task", originals, 0.2, 0)
    assert by_task.sum() == 40
    assert len(np.unique(originals[by_task])) > 5
    by_map = is_test_task("map", originals, 0.2, 0)
    assert by_map.sum() == 40
    assert len(np.unique(originals[by_map])) == 2
    assert np.array_equal(by_map, is_test_task("map", originals, 0.2, 0))


def test_import_and_split_anew(dataset: Dataset, tmp_path: Path) -> None:
    write_dataset(tmp_path / "kept", dataset)
    kept = load_dataset(tmp_path / "kept")
    assert len(kept.test) == len(dataset.test)
    assert {region.tobytes() for region in kept.test.region} == {
        region.tobytes() for region in dataset.test.region
    }
    write_dataset(tmp_path / "tasks", dataset, split="task", seed=3)
    assert described(load_dataset(tmp_path / "tasks"))["shared_maps"] > 0
    write_dataset(tmp_path / "maps", dataset, split="map", copies=2, test_fraction=0.3)
    split = load_dataset(tmp_path / "maps")
    assert not set(split.train.map_of // 2) & set(split.test.map_of // 2)
    assert len(split.train) + len(split.test) == SMALL.maps * SMALL.tasks
    with pytest.raises(ConfigError, match="holds a set already"):
        write_dataset(tmp_path / "maps", dataset)


def test_a_copy_of_a_set_with_gaps_still_tells_whose_copies_its_maps_are(
    folder: Path, tmp_path: Path
) -> None:
    for name in ("train", "test"):
        rows = (folder / f"{name}.csv").read_text().splitlines()
        kept = [row for row in rows if not row.startswith("map_0.")]
        (tmp_path / f"{name}.csv").write_text("\n".join(kept) + "\n")
    for name in ("maps", "tasks"):
        (tmp_path / name).symlink_to(folder / name)
    write_dataset(tmp_path / "copy", load_dataset(tmp_path))
    copy = load_dataset(tmp_path / "copy")
    assert copy.map_numbers == (1, 2, 3, 4, 5)
    for seed in range(4):
        write_dataset(tmp_path / str(seed), copy, split="map", copies=2, seed=seed)
        split = load_dataset(tmp_path / str(seed))
        originals = [
            {split.map_numbers[k] // 2 for k in part.map_of} for part in (split.train, split.test)
        ]
        assert not set.intersection(*originals)


def test_archives(folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    archive = tmp_path / "small.tar.gz"
    with tarfile.open(archive, "w:gz") as tar:
        tar.add(folder, "inner/small")
    assert main(["dataset", "import", str(archive), "--json", str(tmp_path / "set.json")]) == 0
    assert "labels that join start and goal:     100.00%" in capsys.readouterr().out
    values = json.loads((tmp_path / "set.json").read_text())
    assert (values["maps"], values["blocked_ends"], values["repeated_tasks"]) == (6, 0, 0)


def test_what_is_no_set(tmp_path: Path) -> None:
    (tmp_path / "text.tar.gz").write_text("text")
    with pytest.raises(DatasetError, match="neither a folder nor an archive"):
        read_set(tmp_path / "text.tar.gz")
    with tarfile.open(tmp_path / "empty.tar", "w"):
        pass
    with pytest.raises(DatasetError, match=r"holds one train\.csv, not 0"):
        read_set(tmp_path / "empty.tar")


def test_tar_archives_need_a_python_that_unpacks_them_safely(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    root = write_training_set(tmp_path / "set")
    with tarfile.open(tmp_path / "set.tar", "w") as tar:
        tar.add(root, "set")
    assert read_set(tmp_path / "set.tar").name == "set"
    monkeypatch.delattr(tarfile, "data_filter")
    with pytest.raises(DatasetError, match=r"3\.10\.12.*unpack it yourself, and give the folder"):
        read_set(tmp_path / "set.tar")


def test_archives_that_are_damaged_or_ambiguous(tmp_path: Path) -> None:
    root = write_training_set(tmp_path / "set")
    for name, folders in (("two.zip", ("a", "b")), ("one.zip", (".",))):
        with zipfile.ZipFile(tmp_path / name, "w", zipfile.ZIP_DEFLATED) as archive:
            for folder in folders:
                for file in files(root):
                    archive.write(root / file, f"{folder}/{file}")
    assert read_set(tmp_path / "one.zip").name == "one"
    with pytest.raises(DatasetError, match=r"holds one train\.csv, not 2"):
        read_set(tmp_path / "two.zip")
    data = (tmp_path / "one.zip").read_bytes()
    for seed in range(40):
        rng = np.random.default_rng(seed)
        damaged = bytearray(data)
        place = int(rng.integers(len(data) - 40))
        damaged[place : place + 40] = rng.bytes(40)
        (tmp_path / "damaged.zip").write_bytes(damaged)
        # Whatever else is raised fails the test; damage between the files does no harm.
        with contextlib.suppress(DatasetError):
            read_set(tmp_path / "damaged.zip")


def test_faults_inside_an_archive_name_the_archive_and_the_file(tmp_path: Path) -> None:
    root = write_training_set(tmp_path / "set")
    (root / "maps" / "map_1.png").write_bytes(b"")
    with tarfile.open(tmp_path / "set.tar", "w") as archive:
        archive.add(root, "inner")
    with pytest.raises(DatasetError, match=r"set\.tar: inner/maps/map_1\.png: not an image"):
        read_set(tmp_path / "set.tar")


def test_lists_that_lead_out_of_the_folder(tmp_path: Path) -> None:
    root = write_training_set(tmp_path / "set")
    text = (root / "train.csv").read_text()
    (root / "train.csv").write_text(text.replace("map_0.png", "../maps/map_0.png"))
    with pytest.raises(DatasetError, match=r"train\.csv: '\.\./maps/map_0\.png' is no name"):
        load_dataset(root)
    (root / "train.csv").write_text(text.replace("map_0.png", "map_0\0.png"))
    with pytest.raises(DatasetError, match="cannot read"):
        load_dataset(root)


def test_faults_of_a_set_are_told(tmp_path: Path) -> None:
    root = write_training_set(tmp_path / "set")
    rows = (root / "train.csv").read_text().splitlines()
    (root / "test.csv").write_text("\n".join(rows[:3]) + "\n")
    values = described(load_dataset(root))
    assert (values["repeated_tasks"], values["shared_maps"]) == (2, 1)


def test_maps_of_other_names_have_no_known_originals(tmp_path: Path) -> None:
    root = write_training_set(tmp_path / "set")
    (root / "maps" / "map_1.png").rename(root / "maps" / "hall.png")
    (root / "tasks" / "map_1").rename(root / "tasks" / "hall")
    for name in ("train", "test"):
        text = (root / f"{name}.csv").read_text().replace("map_1", "hall")
        (root / f"{name}.csv").write_text(text)
    dataset = load_dataset(root)
    assert dataset.map_numbers == (-1, 0)
    with pytest.raises(ConfigError, match=r"not called map_K\.png"):
        write_dataset(tmp_path / "copy", dataset, split="map", copies=2)
    write_dataset(tmp_path / "copy", dataset)
    assert load_dataset(tmp_path / "copy").map_numbers == (0, 1)


def test_an_image_that_is_too_large(tmp_path: Path) -> None:
    root = write_training_set(tmp_path / "set")
    path = root / "maps" / "map_1.png"
    data = bytearray(path.read_bytes())
    data[16:24] = struct.pack(">II", 60_000, 60_000)  # width and height of the header
    data[29:33] = struct.pack(">I", zlib.crc32(data[12:29]))
    path.write_bytes(data)
    with pytest.raises(DatasetError, match=r"map_1\.png: an image that is too large"):
        load_dataset(root)


# --- the command ----------------------------------------------------------------------------------


def test_generate_import_and_noise_commands(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["dataset", "generate", "--output", str(tmp_path / "set"), "--maps", "2"]
    words += ["--tasks", "2", "--runs", "2", "--families", "ellipses,tl_shapes", "--split", "task"]
    assert main(words) == 0
    assert "4 tasks written" in capsys.readouterr().out
    report = tmp_path / "noise.json"
    words = ["dataset", "noise", str(tmp_path / "set"), "--runs", "2", "--json", str(report)]
    assert main(words) == 0
    assert json.loads(report.read_text())["tasks"] == 1
    for more, message in (
        (("--tasks", "7"), "from 1 to 1, got 7"),
        (("--tasks", "1", "--seed", "-1"), "seed must be at least 0, got -1"),
        (("--runs", "0"), "runs and range must be positive, got 0"),
        (("--json", str(tmp_path / "none" / "x.json")), "its folder does not exist"),
    ):
        assert main([*words, *more]) == 2
        assert message in capsys.readouterr().err


def test_a_split_without_a_copy_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    root = write_training_set(tmp_path / "set")
    words = ["dataset", "import", str(root), "--split", "task"]
    assert main(words) == 2
    assert "give --output as well" in capsys.readouterr().err
    assert main([*words, "--output", str(tmp_path / "copy"), "--seed", "-1"]) == 2
    assert "seed must be at least 0, got -1" in capsys.readouterr().err
    assert not (tmp_path / "copy").exists()


def test_a_process_that_dies() -> None:
    with pytest.raises(DatasetError, match="a process that worked on the maps has died"):
        run_all(os._exit, [(3,)], 1, "maps", progress=False)


@pytest.mark.usefixtures("interruptible")
def test_an_interrupt_says_how_to_go_on(tmp_path: Path) -> None:
    words = ["dataset", "generate", "--output", str(tmp_path), "--maps", "500", "--runs", "5"]
    status, said = interrupted(words, lambda: any(tmp_path.glob("tasks/*.csv")))
    assert status == 130, said
    assert "--resume" in said
    assert "Traceback" not in said


@pytest.mark.usefixtures("interruptible")
def test_an_interrupt_while_processes_start_leaves_none(monkeypatch: pytest.MonkeyPatch) -> None:
    start, started = ForkServerProcess.start, []

    def interrupt_and_start(process: ForkServerProcess) -> None:
        os.kill(os.getpid(), signal.SIGINT)
        start(process)
        started.append(process)

    monkeypatch.setattr(ForkServerProcess, "start", interrupt_and_start)
    with pytest.raises(KeyboardInterrupt):
        run_all(time.sleep, [(3600,), (3600,)], 2, "maps", progress=False)
    assert started
    assert not active_children()


def test_exact_labels_of_varied_maps(tmp_path: Path) -> None:
    settings = GenerationSettings(
        maps=2, tasks=6, size=64, families=("cell_maze",), varied=True, label="geodesic",
        hard_share=1.0, seed=3,
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
            way = distances(free, (int(u), int(v)))[y, x]
            assert way >= 1.25 * np.hypot(u - x, v - y)


@pytest.mark.parametrize(
    ("options", "message"),
    [({"label": "guess"}, "rrt, geodesic"), ({"hard_share": 1.5}, "hard_share is a fraction")],
)
def test_options_of_exact_labels(options: dict[str, Any], message: str) -> None:
    with pytest.raises(ConfigError, match=message):
        GenerationSettings(**options)
