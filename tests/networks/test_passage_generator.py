"""The generator that learns costs of travel, and what is exported of it."""

from __future__ import annotations

import warnings
from typing import Any

import pytest

torch = pytest.importorskip("torch")

from cbagan_ompl.errors import ConfigError
from cbagan_ompl.networks.config import NetworkConfig
from cbagan_ompl.networks.encoding import map_image, point_image, region_probability, spot_centres
from cbagan_ompl.networks.export_model import make_region_model
from cbagan_ompl.networks.factory import make_generator
from cbagan_ompl.networks.passage_generator import PassageGenerator

CONFIG = NetworkConfig(widths=(8, 8), stem=8, patch=4, passages=True, white_obstacles=True)


def generator(**options: Any) -> PassageGenerator:
    torch.manual_seed(0)
    made = make_generator(CONFIG.updated(options)).eval()
    assert isinstance(made, PassageGenerator)
    return made


def walls() -> torch.Tensor:
    """Two rooms with one door of a pixel, (1, 1, 64, 48)."""
    free = torch.ones(1, 1, 64, 48)
    free[..., 30] = 0
    free[..., 50, 30] = 1
    return free


START, GOAL = torch.tensor([[5.5, 8.5]]), torch.tensor([[42.5, 9.5]])


def test_without_training_it_paints_the_way_through_the_door() -> None:
    free = walls()
    region, direction = paint(free)
    inside = region[0, 0] >= 0.5
    assert inside[50, 30]
    assert not inside[free[0, 0] == 0].any()
    assert inside[8, 5]
    assert inside[9, 42]
    assert not inside[60:, :5].any()
    # To the door, through it, and up to the goal.
    assert direction[0, 1, 5, 2] > 0.7
    assert direction[0, 0, 12, 6] > 0.7
    assert direction[0, 1, 8, 9] < -0.7
    length = direction.square().sum(1).sqrt()
    assert ((length - 1).abs() < 1e-4).logical_or(length == 0).all()


def paint(free: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
    network = generator()
    with torch.no_grad():
        for layer in (network.costs, network.head):
            for weight in layer.parameters():
                weight.zero_()
        points = point_image(START, GOAL, free.size(2), free.size(3))
        image, direction = network(map_image(free), points, torch.zeros_like(free))
    return region_probability(image), direction


def test_where_no_path_leads_there_is_no_direction() -> None:
    free = walls()
    free[..., 30] = 0
    direction = paint(free)[1]
    assert (direction[0, :, :, :7] == 0).all()
    assert (direction[0, :, :, 8:].abs().sum(0) > 0).sum() > 50


def test_the_exported_parts_compute_what_the_generator_does() -> None:
    network = generator()
    free = torch.nn.functional.pad(walls(), [0, 1, 0, 3])  # no multiple of the stride
    model = make_region_model(network)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        scripted = torch.jit.script(model)
    padded = torch.nn.functional.pad(free, [0, 15, 0, 13])
    with torch.no_grad():
        points = point_image(START, GOAL, padded.size(2), padded.size(3))
        image, _ = network(map_image(padded), points, torch.zeros_like(padded))
        expected = region_probability(image)[..., : free.size(2), : free.size(3)]
        for module in (model, scripted):
            assert module(free, START, GOAL) == pytest.approx(expected.numpy(), abs=1e-4)


def test_all_weights_are_trained() -> None:
    network = generator().train()
    free = torch.cat((walls(), walls().flip(3)))
    ends = torch.cat((START, GOAL)), torch.cat((GOAL, START))
    points = point_image(*ends, free.size(2), free.size(3))
    image, direction = network(map_image(free), points, torch.randn_like(free))
    (image.square().mean() + direction[:, 0].mean()).backward()
    for name, weight in network.named_parameters():
        assert weight.grad is not None, name
        assert weight.grad.abs().sum() > 0, name


def test_spots_are_found_where_they_were_painted() -> None:
    start, goal = spot_centres(point_image(START, GOAL, 64, 48))
    assert start.tolist() == [pytest.approx(START[0].tolist(), abs=1e-3)]
    assert goal.tolist() == [pytest.approx(GOAL[0].tolist(), abs=1e-3)]


@pytest.mark.parametrize("options", [{"patch": 8}, {"cost_maps": 2}, {"widths": (8,)}])
def test_what_does_not_go_with_passages(options: dict[str, Any]) -> None:
    with pytest.raises(ConfigError, match=r"passages|widths"):
        CONFIG.updated(options)
