"""The losses of the paper.

The paper writes the segmentation loss for a map "in the x direction" and one "in the y direction"
(P^x, P^y) without defining them. They are read here as the same map, summed along rows and along
columns: then L_bce^xy is twice the binary cross-entropy and L_dice^xy is the Dice loss. Sums over
pixels are taken as means, so that no weight depends on the size of the images.
"""

from __future__ import annotations

import torch
from torch import Tensor
from torch.nn import functional


def bce_loss(predicted: Tensor, target: Tensor, positive_weight: float = 1.0) -> Tensor:
    """L_bce^xy (eq. total_ce_loss), the mean over all pixels.

    Args:
        predicted: probability of the region, (B, 1, H, W) in [0, 1].
        target: the true region, the same shape, in [0, 1].
        positive_weight: factor of -target log(predicted); 1 in the paper.
    """
    loss = functional.binary_cross_entropy(predicted, target)
    if positive_weight != 1:
        # -target log(predicted), with PyTorch's bounds of the logarithm and of its gradient.
        missed = functional.binary_cross_entropy(predicted, torch.ones_like(target), target)
        loss = loss + (positive_weight - 1) * missed
    return 2 * loss


def dice_loss(predicted: Tensor, target: Tensor, smooth: float = 1.0) -> Tensor:
    """L_dice^xy (eq. dice_loss), the mean over the images of a batch.

    Args:
        predicted: probability of the region, (B, 1, H, W) in [0, 1].
        target: the true region, the same shape, 0 or 1.
        smooth: added above and below the fraction, so that an empty region has a loss.
    """
    overlap = (predicted * target).sum(dim=(1, 2, 3))
    size = (predicted.square() + target.square()).sum(dim=(1, 2, 3))
    return (1 - (2 * overlap + smooth) / (size + smooth)).mean()


def segmentation_loss(
    predicted: Tensor,
    target: Tensor,
    bce_weight: float = 1.0,
    dice_weight: float = 10.0,
    smooth: float = 1.0,
    positive_weight: float = 1.0,
) -> Tensor:
    """L (eq. total_loss), with the paper's factor 10 on the Dice loss.

    The paper adds L to the loss of each discriminator as well. It does not depend on their
    weights, so it has no effect there; it is part of the generator's loss instead.

    Args:
        predicted: probability of the region, (B, 1, H, W) in [0, 1].
        target: the true region, the same shape, 0 or 1.
        bce_weight: factor of L_bce^xy.
        dice_weight: factor of L_dice^xy.
        smooth: see :func:`dice_loss`.
        positive_weight: see :func:`bce_loss`.
    """
    return bce_weight * bce_loss(predicted, target, positive_weight) + dice_weight * dice_loss(
        predicted, target, smooth
    )


def discriminator_loss(real_logits: Tensor, fake_logits: Tensor) -> Tensor:
    """-log D(real) - log(1 - D(fake)) (eq. loss_map_discriminator, eq. loss_point_discriminator).

    The paper prints the sum of logarithms that a discriminator maximises; this is what it
    minimises.

    Args:
        real_logits: the discriminator's logits for true regions, any shape.
        fake_logits: its logits for generated regions.
    """
    return functional.binary_cross_entropy_with_logits(
        real_logits, torch.ones_like(real_logits)
    ) + functional.binary_cross_entropy_with_logits(fake_logits, torch.zeros_like(fake_logits))


def adversarial_loss(fake_logits: Tensor) -> Tensor:
    """-log D(fake): what one discriminator adds to the generator's loss.

    Args:
        fake_logits: the discriminator's logits for generated regions, any shape.
    """
    return functional.binary_cross_entropy_with_logits(fake_logits, torch.ones_like(fake_logits))


def adaptive_shares(map_loss: float, point_loss: float, alpha: float) -> tuple[float, float]:
    """Weights of the two adversarial losses in the adaptive generator loss; they add up to 1.

    The paper names the variant and its alpha (3) and gives no formula. This is the one of the
    work that it builds on (Zhang et al., "Generative adversarial network based heuristics for
    sampling-based path planning"): each discriminator weighs as much as it errs, and the map
    discriminator alpha times as much.

    Args:
        map_loss: :func:`discriminator_loss` of the map discriminator.
        point_loss: the same of the point discriminator.
        alpha: factor on the map discriminator's share.
    """
    if map_loss == point_loss == 0:
        # Equal errors, as in the limit of ever smaller ones.
        map_loss = point_loss = 1.0
    total = alpha * map_loss + point_loss
    return alpha * map_loss / total, point_loss / total


def pixel_loss(image: Tensor, target: Tensor) -> Tensor:
    """L_mse (eq. mse_loss), the mean over pixels and channels.

    Args:
        image: the generated region image, (B, 3, H, W) in [-1, 1].
        target: the region image of the true region.
    """
    return functional.mse_loss(image, target)


def generator_loss(
    adversarial: Tensor,
    pixel: Tensor,
    segmentation: Tensor,
    adversarial_weight: float = 0.5,
    pixel_weight: float = 20.0,
) -> Tensor:
    """L_G (eq. total_generator_loss) plus L.

    Args:
        adversarial: sum of :func:`adversarial_loss` over the two discriminators; in the adaptive
            variant twice their mean weighted by :func:`adaptive_shares`.
        pixel: :func:`pixel_loss`.
        segmentation: :func:`segmentation_loss`, already weighted.
        adversarial_weight: alpha_1 = alpha_2.
        pixel_weight: factor of the pixel-wise loss, 20 in the paper's table.
    """
    return adversarial_weight * adversarial + pixel_weight * pixel + segmentation
