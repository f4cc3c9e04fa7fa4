from __future__ import annotations

import copy
from dataclasses import replace

import numpy as np
import pytest
from helpers.tiny_model import TINY

torch = pytest.importorskip("torch")

from cbagan_ompl.datasets.dataset import Dataset
from cbagan_ompl.datasets.synthetic import SyntheticSettings, generate_map_tasks
from cbagan_ompl.networks.config import NetworkConfig
from cbagan_ompl.networks.encoding import region_probability
from cbagan_ompl.training import losses
from cbagan_ompl.training.batches import Batch, Images, encode, make_batch
from cbagan_ompl.training.gan import Gan, Painted
from cbagan_ompl.training.steps import adversarial_weights, discriminator_step, generator_step

CPU = torch.device("cpu")
NAMES = ("generator", "map_discriminator", "point_discriminator")


def network_of(gan: Gan, name: str) -> torch.nn.Module:
    return gan.generator if name == "generator" else gan.discriminators[name]


def weights(gan: Gan) -> dict[str, list[torch.Tensor]]:
    return {
        name: [p.detach().clone() for p in network_of(gan, name).parameters()] for name in NAMES
    }


def first_step(gan: Gan, dataset: Dataset) -> tuple[Batch, Images, torch.Tensor]:
    batch = make_batch(dataset.train, np.arange(4), CPU)
    images = encode(batch)
    return batch, images, gan.generator(images.map, images.points, torch.randn(batch.free.shape))


def changed(before: list[torch.Tensor], after: list[torch.Tensor]) -> bool:
    return any(not torch.equal(a, b) for a, b in zip(before, after, strict=True))


def test_steps_change_the_weights_that_they_train(dataset: Dataset) -> None:
    gan = Gan(TINY, CPU)
    batch = make_batch(dataset.train, np.arange(4), CPU)
    images = encode(batch)
    before = weights(gan)
    fake = gan.generator(images.map, images.points, torch.zeros_like(batch.free))

    discriminator_step(gan, images, fake)
    after = weights(gan)
    assert [changed(before[name], after[name]) for name in NAMES] == [False, True, True]

    parts = generator_step(gan, TINY, batch, images, Painted.of(fake), (0.5, 0.5))
    assert parts["adversarial"] > 0
    last = weights(gan)
    assert [changed(after[name], last[name]) for name in NAMES] == [True, False, False]
    assert all(p.requires_grad for p in network_of(gan, NAMES[1]).parameters())


def test_each_discriminator_sees_its_own_condition(dataset: Dataset) -> None:
    gan = Gan(TINY, CPU)
    _, images, fake = first_step(gan, dataset)
    conditions = {"map_discriminator": images.map, "point_discriminator": images.points}
    expected = {}
    for name, condition in conditions.items():
        judge = copy.deepcopy(gan.discriminators[name])
        real, generated = judge(condition, images.region), judge(condition, fake.detach())
        expected[name] = losses.discriminator_loss(real, generated).item()
    assert discriminator_step(gan, images, fake) == pytest.approx(expected, rel=1e-6)
    assert expected["map_discriminator"] != pytest.approx(expected["point_discriminator"], rel=1e-3)


def test_the_generator_descends_the_papers_loss(dataset: Dataset) -> None:
    factors = {"adversarial_weight": 0.7, "pixel_weight": 3, "bce_weight": 2, "dice_weight": 5}
    config = TINY.updated(factors)
    gan = Gan(config, CPU)
    batch, images, fake = first_step(gan, dataset)
    judges = copy.deepcopy(gan.discriminators)
    on_map = losses.adversarial_loss(judges["map_discriminator"](images.map, fake))
    on_points = losses.adversarial_loss(judges["point_discriminator"](images.points, fake))
    adversarial = 2 * (0.8 * on_map + 0.2 * on_points)
    pixel = ((fake - images.region) ** 2).mean()
    region = region_probability(fake)
    segmentation = 2 * losses.bce_loss(region, batch.region) + 5 * losses.dice_loss(
        region, batch.region
    )
    loss = 0.7 * adversarial + 3 * pixel + segmentation
    expected = torch.autograd.grad(loss, list(gan.generator.parameters()), retain_graph=True)
    parts = generator_step(gan, config, batch, images, Painted.of(fake), (0.8, 0.2))
    assert parts["adversarial"] == pytest.approx(adversarial.item(), rel=1e-6)
    assert parts["pixel"] == pytest.approx(pixel.item(), rel=1e-6)
    assert on_map.item() != pytest.approx(on_points.item(), rel=1e-3)
    for gradient, parameter in zip(expected, gan.generator.parameters(), strict=True):
        torch.testing.assert_close(parameter.grad, gradient)


def test_the_discriminators_reach_the_generator(dataset: Dataset) -> None:
    config = TINY.updated({"pixel_weight": 0, "bce_weight": 0, "dice_weight": 0})
    gan = Gan(config.updated({"weight_decay": 0}), CPU)
    batch = make_batch(dataset.train, np.arange(4), CPU)
    images = encode(batch)
    before = weights(gan)["generator"]
    fake = gan.generator(images.map, images.points, torch.zeros_like(batch.free))
    generator_step(gan, config, batch, images, Painted.of(fake), (0.5, 0.5))
    assert changed(before, weights(gan)["generator"])


def test_the_recipes_weights_reach_the_segmentation_loss(dataset: Dataset) -> None:
    weights = {"bce_weight": 2, "dice_weight": 3, "dice_smooth": 4, "positive_weight": 5}
    config = TINY.updated(weights)
    gan = Gan(config, CPU)
    batch = make_batch(dataset.train, np.arange(4), CPU)
    images = encode(batch)
    fake = gan.generator(images.map, images.points, torch.zeros_like(batch.free))
    expected = losses.segmentation_loss(region_probability(fake), batch.region, 2, 3, 4, 5).item()
    parts = generator_step(gan, config, batch, images, Painted.of(fake), None)
    assert parts["segmentation"] == pytest.approx(expected)


@pytest.mark.parametrize("limit", [0.0, 0.01])
def test_long_gradients_are_shortened(dataset: Dataset, limit: float) -> None:
    config = TINY.updated({"clip_norm": limit})
    gan = Gan(config, CPU)
    batch = make_batch(dataset.train, np.arange(4), CPU)
    images = encode(batch)
    fake = gan.generator(images.map, images.points, torch.zeros_like(batch.free))
    generator_step(gan, config, batch, images, Painted.of(fake), None)
    gradients = [w.grad for w in gan.generator.parameters() if w.grad is not None]
    norm = float(torch.linalg.vector_norm(torch.cat([g.flatten() for g in gradients])))
    if limit:
        assert norm == pytest.approx(limit, rel=1e-3)
    else:
        assert norm > 0.01, "or the other case would show nothing"


def test_adaptive_weights_of_a_recipe() -> None:
    errors = {"map_discriminator": 0.2, "point_discriminator": 0.4}
    assert adversarial_weights(TINY, errors) == (0.5, 0.5)
    adaptive = TINY.updated({"adaptive_alpha": 3})
    assert adversarial_weights(adaptive, errors) == pytest.approx((0.6, 0.4))


def test_directions_are_trained_where_they_are_known() -> None:
    network = NetworkConfig(widths=(4, 4), stem=4, patch=4, passages=True, white_obstacles=True)
    config = replace(TINY, network=network, adversarial_weight=0.0, direction_weight=3.0)
    tasks = generate_map_tasks(SyntheticSettings(size=64), 0, 1)
    batch = make_batch(tasks, np.arange(4), CPU)
    gan, images = Gan(config, CPU), encode(batch)
    painted = gan.generate(images.map, images.points, torch.zeros_like(batch.free))
    assert painted.direction is not None
    parts = {
        "pixel": losses.pixel_loss(painted.image, images.region) * config.pixel_weight,
        "segmentation": losses.segmentation_loss(
            region_probability(painted.image),
            batch.region,
            config.bce_weight,
            config.dice_weight,
            config.dice_smooth,
        ),
        "direction": 3 * losses.direction_loss(painted.direction, batch.direction, batch.region),
    }
    weights = list(gan.generator.parameters())
    loss = torch.stack(list(parts.values())).sum()
    expected = torch.autograd.grad(loss, weights, retain_graph=True, allow_unused=True)
    values = generator_step(gan, config, batch, images, painted, None)
    assert 3 * values["direction"] == pytest.approx(parts["direction"].item(), rel=1e-5)
    for gradient, weight in zip(expected, weights, strict=True):
        torch.testing.assert_close(weight.grad, gradient)
