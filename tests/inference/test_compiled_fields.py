from __future__ import annotations

import numpy as np
import pytest

torch = pytest.importorskip("torch")

from helpers.patches import generator

from cbagan_ompl import GridMap
from cbagan_ompl.inference.choice import make_pipeline
from cbagan_ompl.inference.compiled_fields import distance_fields
from cbagan_ompl.inference.graphs import TorchGraphs
from cbagan_ompl.inference.pipelines import WavefrontPipeline, WholePipeline
from cbagan_ompl.inference.predictor import Predictor
from cbagan_ompl.networks import wavefront
from cbagan_ompl.networks.export_model import RegionModel, make_region_model


@pytest.mark.parametrize("shape", [(32, 32), (5, 40), (1, 9), (9, 1)])
@pytest.mark.parametrize(("batch", "cost_maps"), [(1, 1), (1, 2), (3, 2)])
def test_the_fields_are_those_of_the_network_to_the_last_bit(
    shape: tuple[int, int], batch: int, cost_maps: int
) -> None:
    rng = torch.Generator().manual_seed(shape[0] + batch)
    edges = (3 * torch.randn(4, *shape, batch * cost_maps, generator=rng)).clamp(-3, 6).exp()
    endpoints = torch.zeros(batch, 2, *shape)
    for task in range(batch):
        for endpoint in range(2):
            row, column = (int(torch.randint(n, (1,), generator=rng)) for n in shape)
            endpoints[task, endpoint, row, column] = 1
    endpoints[0, 0, 0, :2] = 1  # two cells that tie
    source = (endpoints.permute(1, 2, 3, 0) > 0).repeat_interleave(cost_maps, dim=3)
    costs = wavefront.step_costs(edges)
    expected = wavefront.distance_fields(costs, source, steps=shape[0] * shape[1])
    fields = distance_fields(edges.numpy(), endpoints.numpy())
    assert np.array_equal(fields, expected.numpy())


def test_long_detours_are_followed() -> None:
    """Along walls that turn back again and again, where one pass of the sweeps is not enough."""
    size = 24
    edges = np.full((4, size, size, 1), 1e3, np.float32)
    edges[0, ::2] = 1  # along every other row, and down at its ends
    for row in range(0, size - 2, 2):
        column = size - 1 if row % 4 == 0 else 0
        edges[1, row : row + 2, column] = 1
    endpoints = np.zeros((1, 2, size, size))
    endpoints[0, :, 0, 0] = 1
    steps = (size // 2) * (size - 1) + size - 2
    last = size - 1 if (size - 2) % 4 == 0 else 0
    assert distance_fields(edges, endpoints)[0, size - 2, last, 0] == steps


@pytest.mark.parametrize("shape", [(64, 64), (50, 90)])
def test_a_model_in_parts_computes_what_the_whole_does(shape: tuple[int, int]) -> None:
    module = make_region_model(generator())
    parts, whole = make_pipeline(TorchGraphs(module)), WholePipeline(TorchGraphs(module))
    assert isinstance(parts, WavefrontPipeline)
    rng = np.random.default_rng(0)
    for maps in (1, 3):
        free = rng.random((maps, *shape)) < 0.9
        start, goal = (rng.random((3, 2)) * shape[::-1] for _ in range(2))
        points = start.astype(np.float32), goal.astype(np.float32)
        with torch.inference_mode():
            expected = whole.paint(whole.read_maps(free), *points).region
            result = parts.paint(parts.read_maps(free), *points).region
        assert result.shape == (3, *shape)
        np.testing.assert_allclose(result, expected, rtol=0, atol=1e-5)


def test_models_without_distance_fields_are_whole() -> None:
    without = generator(cost_maps=0)
    module = make_region_model(without)
    assert type(module) is RegionModel
    assert isinstance(make_pipeline(TorchGraphs(module)), WholePipeline)


def test_a_map_is_read_once(monkeypatch: pytest.MonkeyPatch) -> None:
    predictor = Predictor(make_region_model(generator()), {"working_size": 64})
    called: list[str] = []
    call = TorchGraphs.call

    def record(self: TorchGraphs, name: str, *inputs: object) -> object:
        called.append(name)
        return call(self, name, *inputs)

    monkeypatch.setattr(TorchGraphs, "call", record)
    grid = GridMap(np.ones((64, 64)))
    predictor.predict(grid, (1, 1), (60, 60))
    assert called == ["read_map", "encode", "paint"]
    predictor.predict_many(grid, [(2, 2), (3, 9)], [(50, 60), (60, 5)])
    assert called[3:] == ["encode", "paint"]
    predictor.predict(GridMap(np.ones((64, 64))), (1, 1), (60, 60))
    assert called[5:] == ["read_map", "encode", "paint"]
