"""Lists of training sets and of stored predictions: odd ones, and large ones."""

from __future__ import annotations

from pathlib import Path

import pytest
from helpers.attacks import assert_refused, run_commands
from helpers.fuzzing import mutations, read_all
from helpers.training_set import write_training_set

from cbagan_ompl import DatasetError
from cbagan_ompl.datasets import dataset as datasets
from cbagan_ompl.datasets.dataset import load_dataset
from cbagan_ompl.datasets.tables import MAX_LINES, read_table


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_lines_of_every_system(tmp_path: Path, end: str) -> None:
    path = tmp_path / "list.csv"
    path.write_bytes(end.join(("\ufeffb,a,c", "1,2,3", "", '"x\ny",5')).encode())
    assert read_table(path, ("a", "b")) == [("2", "1"), ("5", "x\ny")]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (b"", "column a, b is missing"),
        (b"a,b\n1\n", r"line \['1'\] has an empty or missing cell"),
        (b"a,b\n1,\n", "empty or missing cell"),
        (b"a,b\n\xff,1\n", "no text file in UTF-8"),
        (b"a,b\n" + b"," * 20_000, "a line of more than 16384 characters"),
        (b"a,b\n" + b'"' + b"x\n" * 100_000, "cannot read the list"),
        (b"a,b\n" + b"1,1\n" * (MAX_LINES + 1), "up to 524288 lines"),
        (b"\n" * (2 * MAX_LINES + 1), "about 1048577 lines"),
    ],
)
def test_lists_that_are_none(tmp_path: Path, text: bytes, message: str) -> None:
    path = tmp_path / "list.csv"
    path.write_bytes(text)
    with pytest.raises(DatasetError, match=message):
        read_table(path, ("a", "b"))


def test_long_lists_cost_little(tmp_path: Path) -> None:
    folders = []
    for name, lines in (
        ("3-million", b"map_0.png,task_0.png,task_0_roi.png\n" * 3_000_000),
        ("short", b"a,b,c\n" * 3_000_000),
        ("missing", b"".join(b"map_%d.png,t,r\n" % i for i in range(500_000))),
        ("commas", b"a,b,c" + b"," * 30_000_000),
        ("empty", b"\n" * 30_000_000),
        ("quotes", b'"\n",' * 6_000_000),
    ):
        folders.append(write_training_set(tmp_path / name))
        (folders[-1] / "train.csv").write_bytes(b"map,task,roi\n" + lines)
    commands = [["dataset", "import", str(folder)] for folder in folders]
    modules = ["cbagan_ompl.datasets.importing"]
    for outcome in run_commands(commands, modules):
        assert_refused(outcome, seconds=4)


def test_more_pixels_than_memory_holds(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    root = write_training_set(tmp_path / "set")
    monkeypatch.setattr(datasets, "MAX_PIXELS", 32 * 32 * 10)
    with pytest.raises(DatasetError, match="16 images of 32 x 32 pixels; a set holds up to"):
        load_dataset(root)


@pytest.mark.parametrize("name", ["$x^", "a\nb", "x" * 300, "n\0l", "..", "größe 図", "a.b c"])
def test_odd_names_of_maps(tmp_path: Path, name: str) -> None:
    root = write_training_set(tmp_path / "set")
    for part in ("train", "test"):
        text = (root / f"{part}.csv").read_text()
        (root / f"{part}.csv").write_text(text.replace("map_1.png", f'"{name}.png"'))
    if name in ("x" * 300, "n\0l", ".."):
        with pytest.raises(DatasetError, match=r"cannot read|is no name of a file") as caught:
            load_dataset(root)
        assert len(str(caught.value)) < 1000
        return
    (root / "maps" / "map_1.png").rename(root / "maps" / f"{name}.png")
    (root / "tasks" / "map_1").rename(root / "tasks" / name)
    assert load_dataset(root).map_numbers == (-1, 0)


def test_numbers_of_maps_that_are_too_long_are_none(tmp_path: Path) -> None:
    root = write_training_set(tmp_path / "set")
    for part in ("train", "test"):
        text = (root / f"{part}.csv").read_text()
        (root / f"{part}.csv").write_text(text.replace("map_1", "map_" + "1" * 200))
    (root / "maps" / "map_1.png").rename(root / "maps" / f"map_{'1' * 200}.png")
    (root / "tasks" / "map_1").rename(root / "tasks" / ("map_" + "1" * 200))
    assert load_dataset(root).map_numbers == (-1, 0)
    text = (root / "train.csv").read_text()
    (root / "train.csv").write_text(text.replace("1" * 200, "1" * 5000))
    with pytest.raises(DatasetError, match="File name too long"):
        load_dataset(root)


def test_names_that_are_not_in_utf_8(tmp_path: Path) -> None:
    root = write_training_set(tmp_path / "set")
    text = (root / "train.csv").read_bytes()
    (root / "train.csv").write_bytes(text.replace(b"map_1", b"m\xfcp_1"))
    with pytest.raises(DatasetError, match="no text file in UTF-8"):
        load_dataset(root)


@pytest.mark.parametrize(("count", "seed"), [(1500, 0)])
def test_damaged_lists_are_read_or_refused(tmp_path: Path, count: int, seed: int) -> None:
    root = write_training_set(tmp_path / "set", maps=1, tasks=5)
    path = root / "train.csv"
    valid = path.read_bytes()
    variants = [valid, valid.replace(b"\n", b"\r\n"), valid.replace(b",", b'","')]

    def load(data: bytes) -> None:
        path.write_bytes(data)
        load_dataset(root)

    counts = read_all(load, mutations(variants, count, seed))
    assert min(counts["read"], counts["refused"]) > 5
