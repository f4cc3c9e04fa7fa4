from __future__ import annotations

import pytest

torch = pytest.importorskip("torch")

from cbagan_ompl.networks.discriminator import MIN_PATCHES, Discriminator


def test_each_part_of_the_image_has_a_logit() -> None:
    logits = Discriminator(4)(torch.zeros(2, 3, 64, 64), torch.zeros(2, 3, 64, 64))
    assert logits.shape == (2, 1, 7, 7)


def test_patches_count_like_pixels() -> None:
    inputs = torch.zeros(2, 3, 64, 64)
    logits = Discriminator(4, patch=4)(inputs, inputs)
    assert logits.shape == Discriminator(4)(inputs[..., :16, :16], inputs[..., :16, :16]).shape


@pytest.mark.parametrize("patch", [1, 4])
def test_the_smallest_image(patch: int) -> None:
    discriminator = Discriminator(4, patch=patch)
    smallest = torch.zeros(2, 3, MIN_PATCHES * patch, MIN_PATCHES * patch)
    assert discriminator(smallest, smallest).shape == (2, 1, 1, 1)
    smaller = smallest[..., :-patch]
    with pytest.raises(RuntimeError, match="Kernel size can't be greater"):
        discriminator(smaller, smaller)
