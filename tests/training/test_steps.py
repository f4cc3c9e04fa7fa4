from __future__ import annotations

import numpy as np
import pytest
from helpers.tiny_model import TINY

torch = pytest.importorskip("torch")

from cbagan_ompl.datasets.dataset import Dataset
from cbagan_ompl.networks.encoding import region_probability
from cbagan_ompl.training import losses
from cbagan_ompl.training.batches import encode, make_batch
from cbagan_ompl.training.gan import Gan
from cbagan_ompl.training.steps import adversarial_weights, discriminator_step, generator_step

CPU = torch.device("cpu")
NAMES = ("generator", "map_discriminator", "point_discriminator")


def weights(gan: Gan) -> dict[str, list[torch.Tensor]]:
    return {name: [p.detach().clone() for p in getattr(gan, name).parameters()] for name in NAMES}


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

    parts = generator_step(gan, TINY, batch, images, fake, (0.5, 0.5))
    assert parts["adversarial"] > 0
    last = weights(gan)
    assert [changed(after[name], last[name]) for name in NAMES] == [True, False, False]
    assert all(p.requires_grad for p in gan.map_discriminator.parameters())


def test_the_discriminators_reach_the_generator(dataset: Dataset) -> None:
    config = TINY.updated({"pixel_weight": 0, "bce_weight": 0, "dice_weight": 0})
    gan = Gan(config.updated({"weight_decay": 0}), CPU)
    batch = make_batch(dataset.train, np.arange(4), CPU)
    images = encode(batch)
    before = weights(gan)["generator"]
    fake = gan.generator(images.map, images.points, torch.zeros_like(batch.free))
    generator_step(gan, config, batch, images, fake, (0.5, 0.5))
    assert changed(before, weights(gan)["generator"])


def test_the_recipes_weights_reach_the_segmentation_loss(dataset: Dataset) -> None:
    weights = {"bce_weight": 2, "dice_weight": 3, "dice_smooth": 4, "positive_weight": 5}
    config = TINY.updated(weights)
    gan = Gan(config, CPU)
    batch = make_batch(dataset.train, np.arange(4), CPU)
    images = encode(batch)
    fake = gan.generator(images.map, images.points, torch.zeros_like(batch.free))
    expected = losses.segmentation_loss(region_probability(fake), batch.region, 2, 3, 4, 5).item()
    parts = generator_step(gan, config, batch, images, fake, None)
    assert parts["segmentation"] == pytest.approx(expected)


@pytest.mark.parametrize("limit", [0.0, 0.01])
def test_long_gradients_are_shortened(dataset: Dataset, limit: float) -> None:
    config = TINY.updated({"clip_norm": limit})
    gan = Gan(config, CPU)
    batch = make_batch(dataset.train, np.arange(4), CPU)
    images = encode(batch)
    fake = gan.generator(images.map, images.points, torch.zeros_like(batch.free))
    generator_step(gan, config, batch, images, fake, None)
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
