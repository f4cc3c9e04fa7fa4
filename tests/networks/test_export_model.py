from __future__ import annotations

import warnings
from pathlib import Path

import pytest

torch = pytest.importorskip("torch")

from helpers.patches import clutter, generator

from cbagan_ompl.networks.config import NETWORKS, NetworkConfig
from cbagan_ompl.networks.export_model import ImageModel, PatchModel, RegionModel
from cbagan_ompl.networks.factory import make_generator
from cbagan_ompl.training.torchscript import save_script


def test_the_exported_model_gives_obstacles_no_probability() -> None:
    free = clutter(1, 1, 50, 70)
    start, goal = torch.tensor([[3.5, 3.5]]), torch.tensor([[60.5, 40.5]])
    probability = RegionModel(generator())(free, start, goal)
    assert probability.shape == free.shape
    assert (probability[free == 0] == 0).all()
    assert (probability[free == 1] > 0).all()


@pytest.mark.parametrize(("height", "width"), [(64, 64), (75, 130)])
def test_patches_agree_when_exported(tmp_path: Path, height: int, width: int) -> None:
    eager = RegionModel(generator()).eval()
    assert eager.stride == 64
    save_script(eager, tmp_path / "model.pt", {})
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        models = (torch.jit.script(eager), torch.jit.load(str(tmp_path / "model.pt")))
    free, start = clutter(2, 1, height, width), torch.tensor([[5.2, 60.9], [30.0, 2.0]])
    with torch.inference_mode():
        expected = eager(free, start, start.flip(0))
        assert expected.shape == free.shape
        for model in models:
            output = model(free, start, start.flip(0))
            torch.testing.assert_close(output, expected, rtol=0, atol=1e-5)


@pytest.mark.parametrize("network", NETWORKS)
@pytest.mark.parametrize("size", [(64, 64), (40, 88)])
def test_every_network_agrees_when_exported(
    network: str, size: tuple[int, int], tmp_path: Path
) -> None:
    torch.manual_seed(0)
    generator = make_generator(NetworkConfig().variant(network)).eval()
    for name, parameter in generator.named_parameters():
        if name.endswith("self_attention.factor"):
            torch.nn.init.constant_(parameter, 0.5)  # or self-attention would do nothing yet
    eager = RegionModel(generator).eval()
    save_script(eager, tmp_path / "model.pt", {})
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        models = (torch.jit.script(eager), torch.jit.load(str(tmp_path / "model.pt")))
    free, endpoints = (torch.rand(1, 1, *size) > 0.3).float(), torch.rand(2, 1, 2) * 40
    with torch.inference_mode():
        expected = eager(free, endpoints[0], endpoints[1])
        for model in models:
            torch.testing.assert_close(
                model(free, endpoints[0], endpoints[1]), expected, rtol=0, atol=1e-5
            )


@pytest.mark.parametrize("white_obstacles", [True, False])
@pytest.mark.parametrize("patch", [2, 4])
@pytest.mark.parametrize(
    ("start", "goal"),
    [
        ((70.3, 20.9), (5.2, 60.9)),
        ((0.1, 0.1), (127.9, 63.9)),
        ((30.0, 40.6), (32.9, 42.1)),  # the spots overlap
        ((29.4, 31.7), (44.8, 31.7)),  # each in the window of the other
        ((63.5, 0.5), (63.5, 63.5)),
    ],
)
def test_without_the_images_the_result_is_the_same(
    start: tuple[float, float], goal: tuple[float, float], patch: int, white_obstacles: bool
) -> None:
    model = generator(patch=patch, white_obstacles=white_obstacles)
    with torch.no_grad():
        model.head.weight.mul_(20)  # so that the result is not one half everywhere
        free, points = clutter(2, 1, 64, 128), torch.tensor([start, goal])
        endpoints = points[:1].expand(2, 2), points[1:].expand(2, 2)
        lean, full = PatchModel(model)(free, *endpoints), ImageModel(model)(free, *endpoints)
    assert full.std() > 0.1
    torch.testing.assert_close(lean, full, rtol=0, atol=1e-5)
