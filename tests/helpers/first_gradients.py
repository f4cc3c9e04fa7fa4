"""One training step in as many processes as torchrun starts; the first one saves the gradients.

Usage: torchrun first_gradients.py DATASET OUTPUT
"""

from __future__ import annotations

import sys

import numpy as np
import torch

from cbagan_ompl.datasets.dataset import load_dataset
from cbagan_ompl.networks.config import NetworkConfig
from cbagan_ompl.training.config import TrainingConfig
from cbagan_ompl.training.distributed import process_group
from cbagan_ompl.training.gan import Gan
from cbagan_ompl.training.loop import Run, _step

CONFIG = TrainingConfig(
    network=NetworkConfig(widths=(4, 4, 6, 8), discriminator_width=4),
    batch_size=8,
    adaptive_alpha=3.0,
)


def main(folder: str, output: str) -> None:
    cpu = torch.device("cpu")
    tasks = load_dataset(folder).train
    with process_group(cpu) as group:
        gan = Gan(CONFIG, cpu, group)
        # A discriminator's first step would turn rounding errors of tiny gradients into a weight.
        gan.set_learning_rates(1e-6)
        run = Run(gan, np.random.default_rng(0), torch.Generator().manual_seed(0))
        _step(run, CONFIG, tasks, np.arange(8), cpu, 0)
        if group.is_leader:
            networks = {"generator": gan.generator, **gan.discriminators}
            gradients = {
                f"{name}.{key}": parameter.grad
                for name in gan.learning_rates
                for key, parameter in networks[name].named_parameters()
            }
            buffers = dict(gan.generator.named_buffers())
            torch.save({**gradients, **buffers}, output)


if __name__ == "__main__":
    main(*sys.argv[1:])
