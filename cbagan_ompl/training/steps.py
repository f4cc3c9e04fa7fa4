"""The two steps of adversarial training: of the discriminators, and of the generator."""

from __future__ import annotations

from collections.abc import Mapping

import torch
from torch import Tensor

from ..networks.encoding import region_probability
from . import losses
from .batches import Batch
from .config import TrainingConfig
from .gan import Images, Networks


def discriminator_step(networks: Networks, images: Images, fake: Tensor) -> dict[str, float]:
    """Teach both discriminators to tell the true regions from the generated ones.

    Args:
        networks: the weights of the two discriminators change, those of the generator do not.
        images: a batch, or this process's share of it.
        fake: the generated region images of the batch; no gradient flows back into them.

    Returns:
        The two losses, means over the processes.
    """
    fake = fake.detach()
    values = {}
    for name, condition in (
        ("map_discriminator", images.map),
        ("point_discriminator", images.points),
    ):
        loss = losses.discriminator_loss(
            networks.run(name, condition, images.region), networks.run(name, condition, fake)
        )
        _descend(loss, networks.optimizers[name])
        values[name] = loss.item()
    return networks.group.means(values)


def generator_step(
    networks: Networks,
    config: TrainingConfig,
    batch: Batch,
    images: Images,
    fake: Tensor,
    shares: tuple[float, float] | None,
) -> dict[str, float]:
    """Teach the generator.

    Args:
        networks: the weights of the generator change, those of the discriminators do not.
        config: weights of the losses.
        batch: tasks with their regions, or this process's share of them.
        images: the same as images.
        fake: the generator's images of the regions, with their graph.
        shares: of the map and the point discriminator in the adversarial loss, adding up to 1;
            None where they have no say in this step.

    Returns:
        The parts of the loss, means over the processes.
    """
    parts = {
        "pixel": losses.pixel_loss(fake, images.region),
        "segmentation": losses.segmentation_loss(
            region_probability(fake),
            batch.region,
            config.bce_weight,
            config.dice_weight,
            config.dice_smooth,
            config.positive_weight,
        ),
    }
    judges = (networks.map_discriminator, networks.point_discriminator)
    if shares is not None:
        # The judges pass gradients on to the image, but collect none for themselves.
        for judge in judges:
            judge.requires_grad_(False)
        by_map = networks.run("map_discriminator", images.map, fake, taught=False)
        by_points = networks.run("point_discriminator", images.points, fake, taught=False)
        parts["adversarial"] = 2 * (
            shares[0] * losses.adversarial_loss(by_map)
            + shares[1] * losses.adversarial_loss(by_points)
        )
    loss = losses.generator_loss(
        parts.get("adversarial", fake.new_zeros(())),
        parts["pixel"],
        parts["segmentation"],
        config.adversarial_weight,
        config.pixel_weight,
    )
    _descend(loss, networks.optimizers["generator"], config.clip_norm)
    for judge in judges:
        judge.requires_grad_(True)
    return networks.group.means({name: value.item() for name, value in parts.items()})


def adversarial_shares(config: TrainingConfig, errors: Mapping[str, float]) -> tuple[float, float]:
    """What the map and the point discriminator weigh in the generator's loss; adds up to 1.

    Args:
        config: ``adaptive_alpha``.
        errors: what :func:`discriminator_step` returned.
    """
    if not config.adaptive_alpha:
        return 0.5, 0.5
    return losses.adaptive_shares(
        errors["map_discriminator"], errors["point_discriminator"], config.adaptive_alpha
    )


def _descend(loss: Tensor, optimizer: torch.optim.Optimizer, clip_norm: float = 0.0) -> None:
    optimizer.zero_grad()
    loss.backward()  # type: ignore[no-untyped-call]
    if clip_norm:
        weights = [weight for group in optimizer.param_groups for weight in group["params"]]
        torch.nn.utils.clip_grad_norm_(weights, clip_norm)
    optimizer.step()
