from __future__ import annotations

import contextlib
import tarfile
import zipfile
from pathlib import Path

import numpy as np
import pytest
from helpers.training_set import SMALL, relative_files, write_training_set

from cbagan_ompl import ConfigError, DatasetError
from cbagan_ompl.datasets.dataset import Dataset, load_dataset
from cbagan_ompl.datasets.importing import describe, import_dataset, write_dataset


def test_import_and_split_again(small_dataset: Dataset, tmp_path: Path) -> None:
    write_dataset(tmp_path / "kept", small_dataset)
    kept = load_dataset(tmp_path / "kept")
    assert len(kept.test) == len(small_dataset.test)
    assert {region.tobytes() for region in kept.test.region} == {
        region.tobytes() for region in small_dataset.test.region
    }
    write_dataset(tmp_path / "tasks", small_dataset, split="task", seed=3)
    assert describe(load_dataset(tmp_path / "tasks"))["shared_maps"] > 0
    write_dataset(tmp_path / "maps", small_dataset, split="map", copies=2, test_fraction=0.3)
    split = load_dataset(tmp_path / "maps")
    assert not set(split.train.map_of // 2) & set(split.test.map_of // 2)
    assert len(split.train) + len(split.test) == SMALL.maps * SMALL.tasks
    with pytest.raises(ConfigError, match="holds a set already"):
        write_dataset(tmp_path / "maps", small_dataset)


def test_a_copy_of_a_set_with_gaps_keeps_the_numbers_of_its_maps(
    small_folder: Path, tmp_path: Path
) -> None:
    for name in ("train", "test"):
        rows = (small_folder / f"{name}.csv").read_text().splitlines()
        kept = [row for row in rows if not row.startswith("map_0.")]
        (tmp_path / f"{name}.csv").write_text("\n".join(kept) + "\n")
    for name in ("maps", "tasks"):
        (tmp_path / name).symlink_to(small_folder / name)
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


def test_files_that_are_no_set(tmp_path: Path) -> None:
    (tmp_path / "text.tar.gz").write_text("text")
    with pytest.raises(DatasetError, match="neither a folder nor an archive"):
        import_dataset(tmp_path / "text.tar.gz")
    with tarfile.open(tmp_path / "empty.tar", "w"):
        pass
    with pytest.raises(DatasetError, match=r"holds one train\.csv, not 0"):
        import_dataset(tmp_path / "empty.tar")


def test_a_set_in_a_folder_of_an_archive_is_called_after_it(tmp_path: Path) -> None:
    root = write_training_set(tmp_path / "set")
    with tarfile.open(tmp_path / "set.tar", "w") as tar:
        tar.add(root, "set")
    assert import_dataset(tmp_path / "set.tar").name == "set"


def test_archives_that_are_damaged_or_ambiguous(tmp_path: Path) -> None:
    root = write_training_set(tmp_path / "set")
    for name, folders in (("two.zip", ("a", "b")), ("one.zip", (".",))):
        with zipfile.ZipFile(tmp_path / name, "w", zipfile.ZIP_DEFLATED) as archive:
            for folder in folders:
                for file in relative_files(root):
                    archive.write(root / file, f"{folder}/{file}")
    assert import_dataset(tmp_path / "one.zip").name == "one"
    with pytest.raises(DatasetError, match=r"holds one train\.csv, not 2"):
        import_dataset(tmp_path / "two.zip")
    data = (tmp_path / "one.zip").read_bytes()
    for seed in range(40):
        rng = np.random.default_rng(seed)
        damaged = bytearray(data)
        first = int(rng.integers(len(data) - 40))
        damaged[first : first + 40] = rng.bytes(40)
        (tmp_path / "damaged.zip").write_bytes(damaged)
        # Whatever else is raised fails the test; damage between the files does no harm.
        with contextlib.suppress(DatasetError):
            import_dataset(tmp_path / "damaged.zip")


def test_faults_inside_an_archive_name_the_archive_and_the_file(tmp_path: Path) -> None:
    root = write_training_set(tmp_path / "set")
    (root / "maps" / "map_1.png").write_bytes(b"")
    with tarfile.open(tmp_path / "set.tar", "w") as archive:
        archive.add(root, "inner")
    with pytest.raises(DatasetError, match=r"set\.tar: inner/maps/map_1\.png: the file is empty"):
        import_dataset(tmp_path / "set.tar")


def test_repeated_tasks_and_shared_maps_are_counted(tmp_path: Path) -> None:
    root = write_training_set(tmp_path / "set")
    rows = (root / "train.csv").read_text().splitlines()
    (root / "test.csv").write_text("\n".join(rows[:3]) + "\n")
    values = describe(load_dataset(root))
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
