"""The losses of the CBAGAN-RRT paper (https://arxiv.org/abs/2305.10442).

With P the true region and Q the predicted one, the paper writes its segmentation losses for a map
"in the x direction" and one "in the y direction" (P^x, P^y) without defining them. They are read
here as the same map, summed along rows and along columns: then L_bce^xy is twice the binary
cross-entropy and L_dice^xy is the Dice loss. Sums over pixels are taken as means, so that no weight
depends on the size of the images.
"""

from __future__ import annotations

import torch
from torch import Tensor
from torch.nn import functional

from ..errors import ConfigError


def bce_loss(predicted: Tensor, target: Tensor, positive_weight: float = 1.0) -> Tensor:
    """Return the paper's total cross-entropy loss, the mean over all pixels.

    L_bce^xy(P, Q) = L_bce^x + L_bce^y = -2 mean(w P log Q + (1 - P) log(1 - Q)), with w = 1 in the
    paper.

    Args:
        predicted: Q, probability of the region, (B, 1, H, W) in [0, 1].
        target: P, the true region, the same shape, in [0, 1].
        positive_weight: w.

    Raises:
        ConfigError: the prediction is not finite.
    """
    try:
        loss = functional.binary_cross_entropy(predicted, target)
    except RuntimeError as error:
        if torch.isfinite(predicted).all():
            raise
        raise ConfigError("the prediction is not finite; lower the learning rates") from error
    if positive_weight != 1:
        # -P log Q, with PyTorch's bounds of the logarithm and of its gradient.
        missed = functional.binary_cross_entropy(predicted, torch.ones_like(target), target)
        loss = loss + (positive_weight - 1) * missed
    return 2 * loss


def dice_loss(predicted: Tensor, target: Tensor, smooth: float = 1.0) -> Tensor:
    """Return the Dice loss, the mean over the images of a batch.

    L_dice^xy(P, Q) = 1 - (2 sum(P Q) + s) / (sum(P^2) + sum(Q^2) + s), with sums over the pixels of
    an image. The paper has no smoothing term s.

    Args:
        predicted: Q, probability of the region, (B, 1, H, W) in [0, 1].
        target: P, the true region, the same shape, in [0, 1].
        smooth: s, so that an empty region has a loss.
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
    """Return the sum of cross-entropy and Dice loss, L = a L_bce^xy + b L_dice^xy.

    The paper's formula has a = b = 1, its table the factor 10 on the Dice loss. The paper adds L to
    the loss of each discriminator as well. It does not depend on their weights, so it has no effect
    there; it is part of the generator's loss instead.

    Args:
        predicted: probability of the region, (B, 1, H, W) in [0, 1].
        target: the true region, the same shape, in [0, 1].
        bce_weight: a.
        dice_weight: b.
        smooth: see :func:`dice_loss`.
        positive_weight: see :func:`bce_loss`.
    """
    return bce_weight * bce_loss(predicted, target, positive_weight) + dice_weight * dice_loss(
        predicted, target, smooth
    )


def discriminator_loss(real_logits: Tensor, fake_logits: Tensor) -> Tensor:
    """Return the loss of a discriminator D, -mean(log D(real)) - mean(log(1 - D(fake))).

    The paper prints the sum of the logarithms, which a discriminator maximises; this is its
    negative, to be minimised. It is the same for the map and the point discriminator.

    Args:
        real_logits: the discriminator's logits for true regions, any shape.
        fake_logits: its logits for generated regions.
    """
    return functional.binary_cross_entropy_with_logits(
        real_logits, torch.ones_like(real_logits)
    ) + functional.binary_cross_entropy_with_logits(fake_logits, torch.zeros_like(fake_logits))


def adversarial_loss(fake_logits: Tensor) -> Tensor:
    """Return what one discriminator D adds to the generator's loss, -mean(log D(fake)).

    Args:
        fake_logits: the discriminator's logits for generated regions, any shape.
    """
    return functional.binary_cross_entropy_with_logits(fake_logits, torch.ones_like(fake_logits))


def adaptive_weights(map_loss: float, point_loss: float, alpha: float) -> tuple[float, float]:
    """Return the weights of the two adversarial losses in the adaptive generator loss.

    The paper names the variant and its alpha (3) and gives no formula. This is the one of the
    work that it builds on (Zhang et al., "Generative adversarial network based heuristics for
    sampling-based path planning", 2022, https://arxiv.org/abs/2012.03490): each discriminator
    weighs as much as it errs, and the map discriminator alpha times as much. The weights
    alpha L_map / (alpha L_map + L_point) and L_point / (alpha L_map + L_point) add up to 1.

    Args:
        map_loss: L_map, the :func:`discriminator_loss` of the map discriminator.
        point_loss: L_point, the same of the point discriminator.
        alpha: factor on the map discriminator's weight.

    Example:
        >>> adaptive_weights(1.0, 1.0, alpha=3.0)
        (0.75, 0.25)
    """
    if map_loss == point_loss == 0:
        # Equal errors, as in the limit of ever smaller ones.
        map_loss = point_loss = 1.0
    total = alpha * map_loss + point_loss
    return alpha * map_loss / total, point_loss / total


def pixel_loss(image: Tensor, target: Tensor) -> Tensor:
    """Return the squared error L_mse = mean((G - Y)^2) over pixels and channels.

    Args:
        image: G, the generated region image, (B, 3, H, W) in [-1, 1].
        target: Y, the region image of the true region.
    """
    return functional.mse_loss(image, target)


def direction_loss(vectors: Tensor, target: Tensor, region: Tensor) -> Tensor:
    """Return the mean of 1 - cos of the angle between painted and true directions of travel.

    Args:
        vectors: unit vectors, (B, 2, h, w); 0 where nothing is painted.
        target: the true ones, (B, 2, h, w); shorter where less certain, 0 where unknown.
        region: the true region, (B, 1, H, W) in [0, 1]: its mean in a patch is the patch's weight.
    """
    length = (target[:, 0].square() + target[:, 1].square()).sqrt()
    weight = length * functional.adaptive_avg_pool2d(region, (target.size(2), target.size(3)))[:, 0]
    cosine = (vectors * target).sum(1) / length.clamp(min=1e-6)
    return (weight * (1 - cosine)).sum() / weight.sum().clamp(min=1e-6)


def generator_loss(
    adversarial: Tensor,
    pixel: Tensor,
    segmentation: Tensor,
    adversarial_weight: float = 0.5,
    pixel_weight: float = 20.0,
) -> Tensor:
    """Return the paper's total loss of the generator, with the segmentation loss added.

    L_G = alpha (A_map + A_point) + beta L_mse + L, with the adversarial losses A of the two
    discriminators. The paper's formula has beta = 1, its table 20.

    Args:
        adversarial: A_map + A_point, see :func:`adversarial_loss`; in the adaptive variant twice
            their mean weighted by :func:`adaptive_weights`.
        pixel: L_mse, see :func:`pixel_loss`.
        segmentation: L, see :func:`segmentation_loss`, already weighted.
        adversarial_weight: alpha, the paper's alpha_1 = alpha_2.
        pixel_weight: beta.
    """
    return adversarial_weight * adversarial + pixel_weight * pixel + segmentation
