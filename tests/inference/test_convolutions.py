from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import torch

from cbagan_ompl import load_model
from cbagan_ompl.inference.bundled_models import bundled_model
from cbagan_ompl.inference.convolutions import convolve_maps_once, use_onednn
from cbagan_ompl.inference.graphs import TorchGraphs
from cbagan_ompl.inference.model_files import load_script, read_model
from cbagan_ompl.inference.passages import PassagesPipeline

needs_onednn = pytest.mark.skipif(
    not torch.backends.mkldnn.is_available(), reason="this torch has no oneDNN"
)


def load(name: str | None = None) -> Any:
    module = load_script(read_model(bundled_model(name).with_suffix(".pt")).content)
    use_onednn(module)
    return module


def joint_channels(module: Any) -> list[int]:
    """Return how many channels the convolutions of ``paint`` read."""
    nodes = module.paint.graph.findAllNodes("aten::mkldnn_convolution")
    return [node.inputsAt(1).toIValue().shape[1] for node in nodes]


@needs_onednn
def test_features_of_a_map_are_convolved_when_it_is_read() -> None:
    one, other = load(), load()
    before = joint_channels(one)
    convolve_maps_once(other)
    assert joint_channels(one) == before
    free = np.random.default_rng(0).random((1, 80, 64)) < 0.9
    free[0, 2, 2] = free[0, 70, 60] = True
    ends = np.array([[2.5, 2.5], [60.5, 70.5]], np.float32)
    results = []
    for module in one, other:
        pipeline = PassagesPipeline(TorchGraphs(module))
        with pipeline.graphs.ready():
            maps = pipeline.read_maps(free)
            results.append((maps.arrays[0], pipeline.paint(maps, ends[:1], ends[1:])))
    (features, painted), (convolved, same) = results
    assert joint_channels(other) == [before[0] - features.shape[1]]
    assert joint_channels(load_model(bundled_model().with_suffix(".pt")).module) == joint_channels(
        other
    )
    assert not np.allclose(features, convolved)
    assert painted.region.max() > 0.5
    np.testing.assert_allclose(same.region, painted.region, rtol=0, atol=1e-6)
    assert same.directions is not None
    assert painted.directions is not None
    np.testing.assert_allclose(same.directions, painted.directions, rtol=0, atol=1e-4)


def test_other_models_stay_as_they_are() -> None:
    module = load("cbagan")
    before = str(module.graph)
    convolve_maps_once(module)
    assert str(module.graph) == before
