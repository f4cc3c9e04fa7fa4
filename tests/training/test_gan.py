from __future__ import annotations

import numpy as np
import pytest
from helpers.tiny_model import TINY

torch = pytest.importorskip("torch")

from cbagan_ompl.training.gan import Gan

CPU = torch.device("cpu")
NAMES = ("generator", "map_discriminator", "point_discriminator")


def test_each_optimizer_owns_its_network_alone() -> None:
    gan = Gan(TINY, CPU)
    owned = {
        name: {id(p) for group in optimizer.param_groups for p in group["params"]}
        for name, optimizer in gan.optimizers.items()
    }
    for name in NAMES:
        network = gan.generator if name == "generator" else gan.discriminators[name]
        assert owned[name] == {id(p) for p in network.parameters()}
    assert len(set.union(*owned.values())) == sum(map(len, owned.values()))


def test_the_recipe_reaches_the_optimizers() -> None:
    config = TINY.updated(
        {"generator_lr": 0.1, "map_discriminator_lr": 0.2, "point_discriminator_lr": 0.3}
        | {"beta1": 0.4, "beta2": 0.5, "weight_decay": 0.6}
    )
    gan = Gan(config, CPU)
    for scale in (1, 0.5):
        gan.set_learning_rates(scale)
        for name, rate in zip(NAMES, (0.1, 0.2, 0.3), strict=True):
            optimizer = gan.optimizers[name]
            assert isinstance(optimizer, torch.optim.AdamW)
            (group,) = optimizer.param_groups
            assert group["lr"] == pytest.approx(scale * rate)
            assert (group["betas"], group["weight_decay"]) == ((0.4, 0.5), 0.6)


def test_segmentation_alone_has_no_discriminators() -> None:
    gan, full = Gan(TINY.updated({"adversarial_weight": 0}), CPU), Gan(TINY, CPU)
    assert list(gan.optimizers) == ["generator"]
    assert gan.state_dict().keys() == {"generator", "average", "optimizers"}
    for one, other in zip(gan.generator.parameters(), full.generator.parameters(), strict=True):
        assert torch.equal(one, other), "the seed gives the same generator with and without"


def test_starting_from_a_run_with_and_without_discriminators() -> None:
    alone = TINY.updated({"adversarial_weight": 0, "seed": 1})
    for config, other in ((TINY, alone), (alone, TINY.updated({"seed": 2}))):
        gan, source = Gan(config, CPU), Gan(other, CPU)
        before = {name: net.state_dict() for name, net in Gan(config, CPU).discriminators.items()}
        gan.start_from(source.state_dict())
        for key, value in source.average.state_dict().items():
            assert torch.equal(value, gan.generator.state_dict()[key])
        for name, network in gan.discriminators.items():
            for key, value in network.state_dict().items():
                assert torch.equal(value, before[name][key])


def test_average_follows_the_generator() -> None:
    gan = Gan(TINY, CPU)
    with torch.no_grad():
        for parameter in gan.generator.parameters():
            parameter.add_(1)
    start = next(gan.average.parameters()).clone()
    gan.update_average(0.75, step=1000)
    torch.testing.assert_close(next(gan.average.parameters()), start + 0.25)


def test_the_greatest_seed() -> None:
    config = TINY.updated({"seed": 2**63 - 1})
    Gan(config, CPU)
    torch.Generator().manual_seed(config.seed)
    np.random.default_rng(config.seed)
