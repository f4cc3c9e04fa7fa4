from __future__ import annotations

from math import exp, log

import pytest

torch = pytest.importorskip("torch")

from cbagan_ompl.training import losses

P = torch.tensor([[[[0.9, 0.2]]], [[[0.5, 0.5]]]])
T = torch.tensor([[[[1.0, 0.0]]], [[[0.0, 1.0]]]])
BCE = -(log(0.9) + log(0.8) + log(0.5) + log(0.5)) / 4
DICE = ((1 - (2 * 0.9 + 1) / (0.85 + 1 + 1)) + (1 - (2 * 0.5 + 1) / (0.5 + 1 + 1))) / 2


def test_bce_is_summed_over_two_directions() -> None:
    assert losses.bce_loss(P, T).item() == pytest.approx(2 * BCE, rel=1e-6)


def test_positive_weight_is_a_factor_of_the_regions_part() -> None:
    expected = -(3 * log(0.9) + log(0.8) + log(0.5) + 3 * log(0.5)) / 4
    assert losses.bce_loss(P, T, 3.0).item() == pytest.approx(2 * expected, rel=1e-6)
    soft = torch.full((1, 1, 1, 1), 0.25)
    expected = -(3 * 0.25 * log(0.1) + 0.75 * log(0.9))
    assert losses.bce_loss(torch.full_like(soft, 0.1), soft, 3.0).item() == pytest.approx(
        2 * expected, rel=1e-6
    )


def test_positive_weight_leaves_a_loss_of_certain_errors_finite() -> None:
    predicted = torch.tensor([[[[0.0, 1.0]]]], requires_grad=True)
    loss = losses.bce_loss(predicted, torch.tensor([[[[1.0, 0.0]]]]), 2.0)
    assert loss.item() == pytest.approx(2 * (2 * 100 + 100) / 2)
    loss.backward()
    assert predicted.grad is not None
    assert predicted.grad.isfinite().all()


def test_dice_per_image() -> None:
    assert losses.dice_loss(P, T).item() == pytest.approx(DICE, rel=1e-6)


def test_dice_of_a_perfect_or_an_empty_region() -> None:
    assert losses.dice_loss(T, T).item() == pytest.approx(0, abs=1e-6)
    nothing = torch.zeros_like(T)
    assert losses.dice_loss(nothing, nothing).item() == 0


def test_segmentation_loss_has_the_papers_factor() -> None:
    assert losses.segmentation_loss(P, T).item() == pytest.approx(2 * BCE + 10 * DICE, rel=1e-6)


def test_discriminator_loss() -> None:
    real, fake = torch.tensor([2.0, -1.0]), torch.tensor([0.5])
    expected = (log(1 + exp(-2)) + log(1 + exp(1))) / 2 + log(1 + exp(0.5))
    assert losses.discriminator_loss(real, fake).item() == pytest.approx(expected, rel=1e-6)


def test_a_discriminator_that_is_right_has_the_lower_loss() -> None:
    high, low = torch.tensor([5.0]), torch.tensor([-5.0])
    assert losses.discriminator_loss(high, low) < losses.discriminator_loss(low, high)


def test_adversarial_loss_is_low_where_the_discriminator_takes_predictions_for_labels() -> None:
    assert losses.adversarial_loss(torch.tensor([1.0])).item() == pytest.approx(
        log(1 + exp(-1)), rel=1e-6
    )


def test_pixel_loss() -> None:
    image = torch.tensor([1.0, -1.0, 0.0]).view(1, 3, 1, 1)
    assert losses.pixel_loss(image, torch.ones(1, 3, 1, 1)).item() == pytest.approx((4 + 1) / 3)


def test_generator_loss_weights() -> None:
    parts = (torch.tensor(3.0), torch.tensor(0.2), torch.tensor(7.0))
    assert losses.generator_loss(*parts).item() == pytest.approx(0.5 * 3 + 20 * 0.2 + 7)


def test_adaptive_weights_follow_the_errors_of_the_discriminators() -> None:
    assert losses.adaptive_weights(0.2, 0.4, alpha=3.0) == pytest.approx((0.6, 0.4))
    assert losses.adaptive_weights(0.5, 0.5, alpha=1.0) == pytest.approx((0.5, 0.5))


def test_adaptive_weights_of_discriminators_without_error() -> None:
    assert losses.adaptive_weights(0.0, 0.0, alpha=3.0) == pytest.approx((0.75, 0.25))
    assert losses.adaptive_weights(0.0, 0.1, alpha=3.0) == (0, 1)


def test_direction_loss_weighs_patches_by_the_region_and_by_what_is_known() -> None:
    region = torch.zeros(1, 1, 8, 8)
    region[..., :4, :4], region[..., 4:, :4] = 1, 0.5
    target = torch.zeros(1, 2, 2, 2)
    target[0, 0] = 1  # to the right
    target[0, 0, 1, 0] = 0.5
    vectors = target.sign()
    assert losses.direction_loss(vectors, target, region).item() == pytest.approx(0)
    vectors[0, :, 1, 0] = torch.tensor([0.0, 1.0])
    # A right angle costs 1, at a quarter of the weight of the patch that is right.
    assert losses.direction_loss(vectors, target, region).item() == pytest.approx(0.25 / 1.25)
    vectors[0, :, :, 1] = torch.tensor([[-1.0], [0.0]])  # outside of the region
    assert losses.direction_loss(vectors, target, region).item() == pytest.approx(0.25 / 1.25)
    assert losses.direction_loss(vectors, 0 * target, region).item() == 0
