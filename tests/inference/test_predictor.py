from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

torch = pytest.importorskip("torch")

from cbagan_ompl import GridMap, Heatmap, MissingDependencyError, ModelError, TaskError
from cbagan_ompl.inference.predictor import Predictor, load_model


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
    assert (heatmap.values[~free] == 0).all()
    assert predictor.predict(grid, *endpoints).connects(*endpoints)


def test_predictions_repeat_and_leave_the_threads_alone(predictor: Predictor) -> None:
    grid, threads = GridMap(np.ones((32, 32))), torch.get_num_threads()
    first, second = (predictor.predict(grid, (1, 1), (30, 30)).values for _ in range(2))
    assert np.array_equal(first, second)
    assert torch.get_num_threads() == threads


STATES = {
    "default dtype": "torch.set_default_dtype(torch.float64)",
    "default device": "torch.set_default_device('meta')",
    "deterministic": "torch.use_deterministic_algorithms(True)",
    "inference mode": "mode.__enter__()",
    "autocast": "cast.__enter__()",
    "threads": "torch.set_num_threads(3)",
}


def test_the_callers_torch_settings_do_not_matter(exported: Path) -> None:
    """In another process, and one after the other, since few of the settings can be taken back."""
    code = f"""
import sys, numpy, torch
from cbagan_ompl import GridMap, load_model
grid = GridMap(numpy.ones((32, 32)))
predict = lambda model: model.predict(grid, (1, 1), (30, 30), repair=False).values
mode, cast = torch.inference_mode(), torch.autocast("cpu", torch.bfloat16)
before = load_model(sys.argv[1])
values = predict(before)
for name, change in {STATES!r}.items():
    exec(change)
    for model in (before, load_model(sys.argv[1])):
        assert numpy.array_equal(predict(model), values), name
assert torch.get_default_dtype() == torch.float64
assert torch.is_autocast_enabled("cpu")
assert torch.is_inference_mode_enabled()
assert str(torch.empty(1).device) == "meta"
assert torch.get_num_threads() == 3
"""
    command = [sys.executable, "-W", "ignore", "-c", code, str(exported)]
    result = subprocess.run(command, check=False, capture_output=True, text=True)
    assert result.returncode == 0, result.stderr


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


def test_many_tasks_have_the_heat_maps_of_each(predictor: Predictor) -> None:
    free = np.ones((40, 64), bool)
    free[:30, 30] = False
    grid = GridMap(free)
    rng = np.random.default_rng(0)
    starts, goals = rng.uniform((0, 0), (30, 40), (19, 2)), rng.uniform((31, 0), (64, 40), (19, 2))
    together = predictor.predict_many(grid, starts, goals)
    for heatmap, start, goal in zip(together, starts, goals, strict=True):
        alone = predictor.predict(grid, start, goal)
        np.testing.assert_allclose(heatmap.values, alone.values, atol=1e-4)
    assert predictor.predict_many(grid, [], []) == []


@pytest.mark.parametrize(
    ("starts", "goals", "message"),
    [
        ([(1, 1)], [], "1 and 0"),
        (3, [(1, 1)], "starts is a list of points"),
        ([(1, 1)], [(50, 50)], "outside"),
        ([(1, 1, 1)], [(5, 5)], "two finite numbers"),
    ],
)
def test_tasks_that_cannot_be_predicted(
    predictor: Predictor, starts: object, goals: object, message: str
) -> None:
    with pytest.raises(TaskError, match=message):
        predictor.predict_many(GridMap(np.ones((20, 20))), starts, goals)  # type: ignore[arg-type]


def test_tasks_outside_the_map(predictor: Predictor) -> None:
    with pytest.raises(TaskError):
        predictor.predict(GridMap(np.ones((20, 20))), (1, 1), (50, 50))


def test_lack_of_memory_is_said() -> None:
    def greedy(free: torch.Tensor, start: torch.Tensor, goal: torch.Tensor) -> torch.Tensor:
        return torch.empty(2**50)

    with pytest.raises(ModelError, match=r"not enough memory .*\(1, 64, 64\): give it fewer"):
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
    monkeypatch.setitem(sys.modules, "onnxruntime", None)
    with pytest.raises(MissingDependencyError, match=r"pip install -e '.\[torch\]'"):
        load_model()
