"""The two steps of adversarial training: of the discriminators, and of the generator."""

from __future__ import annotations

from collections.abc import Mapping

import torch
from torch import Tensor

from ..networks.encoding import region_probability
from . import losses
from .batches import Batch, Images
from .config import TrainingConfig
from .gan import Gan, Painted


def discriminator_step(gan: Gan, images: Images, fake: Tensor) -> dict[str, float]:
    """Train both discriminators to tell the true regions from the generated ones.

    Args:
        gan: the weights of its two discriminators change, those of its generator do not.
        images: a batch, or this process's shard of it.
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
            gan.run(name, condition, images.region), gan.run(name, condition, fake)
        )
        _descend(loss, gan.optimizers[name])
        values[name] = loss.item()
    return gan.group.means(values)


def generator_step(
    gan: Gan,
    config: TrainingConfig,
    batch: Batch,
    images: Images,
    painted: Painted,
    weights: tuple[float, float] | None,
) -> dict[str, float]:
    """Train the generator.

    Args:
        gan: the weights of its generator change, those of its discriminators do not.
        config: factors of the losses.
        batch: tasks with their regions, or this process's shard of them.
        images: the same as images.
        painted: the generator's images of the regions, with their graph.
        weights: of the map and the point discriminator in the adversarial loss, adding up to 1;
            None for a step without an adversarial loss.

    Returns:
        The parts of the loss, means over the processes.
    """
    fake = painted.image
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
    if weights is not None:
        # The discriminators pass gradients on to the image, but collect none for themselves.
        for discriminator in gan.discriminators.values():
            discriminator.requires_grad_(False)
        map_logits = gan.run("map_discriminator", images.map, fake, trained=False)
        point_logits = gan.run("point_discriminator", images.points, fake, trained=False)
        parts["adversarial"] = 2 * (
            weights[0] * losses.adversarial_loss(map_logits)
            + weights[1] * losses.adversarial_loss(point_logits)
        )
    if painted.direction is not None:
        parts["direction"] = losses.direction_loss(painted.direction, batch.direction, batch.region)
    loss = losses.generator_loss(
        parts.get("adversarial", fake.new_zeros(())),
        parts["pixel"],
        parts["segmentation"],
        config.adversarial_weight,
        config.pixel_weight,
    )
    loss = loss + config.direction_weight * parts.get("direction", 0.0)
    _descend(loss, gan.optimizers["generator"], config.clip_norm)
    for discriminator in gan.discriminators.values():
        discriminator.requires_grad_(True)
    return gan.group.means({name: value.item() for name, value in parts.items()})


def adversarial_weights(config: TrainingConfig, errors: Mapping[str, float]) -> tuple[float, float]:
    """Return the weights of the map and the point discriminator in the generator's loss.

    Args:
        config: ``adaptive_alpha``.
        errors: what :func:`discriminator_step` returned.

    Returns:
        Two numbers that add up to 1.
    """
    if not config.adaptive_alpha:
        return 0.5, 0.5
    return losses.adaptive_weights(
        errors["map_discriminator"], errors["point_discriminator"], config.adaptive_alpha
    )


def _descend(loss: Tensor, optimizer: torch.optim.Optimizer, clip_norm: float = 0.0) -> None:
    optimizer.zero_grad()
    loss.backward()  # type: ignore[no-untyped-call]
    if clip_norm:
        weights = [weight for group in optimizer.param_groups for weight in group["params"]]
        torch.nn.utils.clip_grad_norm_(weights, clip_norm)
    optimizer.step()
