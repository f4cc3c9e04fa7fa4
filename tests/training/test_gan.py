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
        assert owned[name] == {id(p) for p in getattr(gan, name).parameters()}
    assert len(set.union(*owned.values())) == sum(map(len, owned.values()))


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
