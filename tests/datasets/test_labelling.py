from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from helpers.training_set import assert_same_files

from cbagan_ompl import ConfigError, GridMap
from cbagan_ompl.datasets.dataset import load_dataset
from cbagan_ompl.datasets.generation import GenerationSettings
from cbagan_ompl.datasets.labelling import label_maps, square_map

SETTINGS = GenerationSettings(
    maps=2, tasks=4, size=48, split="task", test_fraction=0.5, min_distance=0.3, runs=3
)


def own_maps() -> dict[str, GridMap]:
    free = np.ones((40, 60), dtype=np.bool_)
    free[10:30, 28:32] = False
    metric = GridMap(free[:20, :20], resolution=0.05, origin=(-1.0, 2.0, 0.0))
    return {"wall.png": GridMap(free), "ros.yaml": metric}


def test_square_maps() -> None:
    free = np.ones((40, 60), dtype=np.bool_)
    square = square_map(free, 30)
    assert square.shape == (30, 30)
    assert square[:20].all()
    assert not square[20:].any()
    assert square_map(free[:10, :10], 32).sum() == 20 * 20, "twice as large at most"
    assert np.array_equal(square_map(free[:32, :32], 32), free[:32, :32])


@pytest.mark.parametrize("label", ["rrt", "geodesic"])
def test_own_maps_become_a_set(tmp_path: Path, label: str) -> None:
    settings = GenerationSettings(**{**vars(SETTINGS), "label": label})
    label_maps(tmp_path / "one", own_maps(), settings, 1, False, progress=False)
    dataset = load_dataset(tmp_path / "one")
    assert (len(dataset.train), len(dataset.test), dataset.train.size) == (4, 4, 48)
    for map_, grid in zip(dataset.train.maps, own_maps().values(), strict=True):
        assert np.array_equal(map_.astype(bool), square_map(grid.free, 48))
    for tasks in (dataset.train, dataset.test):
        for i, region in enumerate(tasks.region):
            free = tasks.free[i]
            assert not (region.astype(bool) & ~free).any()
            (u, v), (x, y) = (np.floor(p[i]).astype(int) for p in (tasks.start, tasks.goal))
            assert free[v, u]
            assert free[y, x]
            assert region[v, u]
            assert np.hypot(u - x, v - y) >= 0.3 * 48
    label_maps(tmp_path / "two", own_maps(), settings, 2, False, progress=False)
    assert_same_files(tmp_path / "one", tmp_path / "two")


def test_going_on_needs_the_same_maps(tmp_path: Path) -> None:
    label_maps(tmp_path / "set", own_maps(), SETTINGS, 1, False, progress=False)
    files = {path: path.read_bytes() for path in (tmp_path / "set").rglob("*.*")}
    (tmp_path / "set" / "tasks" / "map_1.csv").unlink()
    label_maps(tmp_path / "set", own_maps(), SETTINGS, 1, True, progress=False)
    assert files == {path: path.read_bytes() for path in (tmp_path / "set").rglob("*.*")}
    assert list(json.loads((tmp_path / "set/dataset.json").read_text())["maps"]) == [*own_maps()]
    with pytest.raises(ConfigError, match="holds a set already"):
        label_maps(tmp_path / "set", own_maps(), SETTINGS, 1, False, progress=False)
    others = own_maps() | {"ros.yaml": GridMap(np.ones((20, 20), dtype=np.bool_))}
    others["wall.png"] = GridMap(np.ones((9, 9), dtype=np.bool_))
    with pytest.raises(ConfigError, match="with other options or maps"):
        label_maps(tmp_path / "set", others, SETTINGS, 1, True, progress=False)
