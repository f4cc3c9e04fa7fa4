from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

torch = pytest.importorskip("torch")

from cbagan_ompl import GridMap, Heatmap, MissingDependencyError, ModelError, TaskError
from cbagan_ompl.inference.predictor import Predictor, load_model, scaled_free, scaled_shape


@pytest.fixture(scope="module")
def predictor(exported: Path) -> Predictor:
    return load_model(exported)


@pytest.mark.parametrize("shape", [(1, 2), (5, 3), (32, 32), (200, 31), (45, 130)])
def test_any_size(predictor: Predictor, shape: tuple[int, int]) -> None:
    free = np.ones(shape, bool)
    if min(shape) > 4:
        free[2:, 2] = False
    grid = GridMap(free, resolution=0.5, origin=(-1.0, 2.0, 0.3))
    endpoints = grid.to_world([(0.5, 0.5), (shape[1] - 0.5, shape[0] - 0.5)])
    heatmap = predictor.predict(grid, *endpoints, repair=False)
    assert isinstance(heatmap, Heatmap)
    assert heatmap.values.shape == shape
    assert (heatmap.values[free] > 0).all()
    assert (heatmap.values[~free] == 0).all()
    assert predictor.predict(grid, *endpoints).connects(*endpoints)


def test_predictions_repeat_and_leave_the_threads_alone(predictor: Predictor) -> None:
    grid, threads = GridMap(np.ones((32, 32))), torch.get_num_threads()
    first, second = (predictor.predict(grid, (1, 1), (30, 30)).values for _ in range(2))
    assert np.array_equal(first, second)
    assert torch.get_num_threads() == threads


def test_coordinates_of_the_network_are_pixels_of_the_scaled_map() -> None:
    seen: list[torch.Tensor] = []

    def module(free: torch.Tensor, start: torch.Tensor, goal: torch.Tensor) -> torch.Tensor:
        seen.extend((start, goal))
        return free * 0.75

    free = np.ones((40, 80), bool)
    free[:, 39:41] = False
    free[20] = True
    grid = GridMap(free, resolution=2.0)
    Predictor(module, {"working_size": 40}).predict(grid, (20, 10), (150, 70), repair=False)
    assert seen[0].tolist() == [[5, 2.5]]
    assert seen[1].tolist() == [[37.5, 17.5]]


def test_a_heat_map_without_region_can_be_sampled() -> None:
    predictor = Predictor(lambda free, start, goal: free * 0, {"working_size": 64})
    grid = GridMap(np.ones((20, 20)))
    heatmap = predictor.predict(grid, (1, 1), (18, 18), repair=False)
    assert heatmap.values.min() > 0
    assert not heatmap.region.any()


def test_tasks_outside_the_map(predictor: Predictor) -> None:
    with pytest.raises(TaskError):
        predictor.predict(GridMap(np.ones((20, 20))), (1, 1), (50, 50))


def test_scaled_shape_keeps_the_aspect() -> None:
    assert scaled_shape((256, 128), 64) == (64, 32)
    assert scaled_shape((30, 40), 64) == (48, 64)
    assert scaled_shape((64, 20), 64) == (64, 20)
    assert scaled_shape((1000, 3), 64) == (64, 1)
    assert scaled_shape((20, 10), 64) == (40, 20), "doubled at most"


def test_scaling_keeps_narrow_passages() -> None:
    free = np.zeros((10, 7), bool)
    free[:, 3] = True
    assert scaled_free(free, (4, 3)).tolist() == [[False, True, False]] * 4
    assert np.array_equal(scaled_free(free, free.shape), free)


def test_small_maps_are_enlarged() -> None:
    free = np.array([[True, False], [False, True]])
    enlarged = scaled_free(free, (4, 6))
    assert np.array_equal(enlarged, free.repeat(2, axis=0).repeat(3, axis=1))


def test_lack_of_memory_is_said() -> None:
    def greedy(free: torch.Tensor, start: torch.Tensor, goal: torch.Tensor) -> torch.Tensor:
        return torch.empty(2**50)

    with pytest.raises(ModelError, match=r"not enough memory .*\(1, 1, 64, 64\): give it fewer"):
        Predictor(greedy, {"working_size": 64}).predict(GridMap(np.ones((64, 64))), (1, 1), (9, 9))


def test_the_package_does_not_import_torch() -> None:
    code = (
        "import sys, cbagan_ompl, cbagan_ompl.cli.train, cbagan_ompl.evaluation.metrics;"
        "from cbagan_ompl.inference.predictor import load_model;"
        "sys.exit('torch' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_without_torch_the_message_says_what_to_install(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(sys.modules, "torch", None)
    with pytest.raises(MissingDependencyError, match=r"pip install 'cbagan-ompl\[torch\]'"):
        load_model()
