from __future__ import annotations

import pytest

torch = pytest.importorskip("torch")

from torch.nn import functional

from cbagan_ompl.networks.attention import AttentionBlock
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


def test_discriminator_is_the_papers_by_value() -> None:
    torch.manual_seed(0)
    discriminator = Discriminator(4).eval()
    inputs = torch.randn(2, 3, 32, 32), torch.randn(2, 3, 32, 32)

    def leaky(features: torch.Tensor) -> torch.Tensor:
        return torch.where(features > 0, features, 0.2 * features)

    branches = []
    stems = (discriminator.condition_stem, discriminator.region_stem)
    for stem, image in zip(stems, inputs, strict=True):
        convolution, _, attention = stem
        assert convolution.out_channels == 4
        assert isinstance(attention, AttentionBlock)
        features = functional.conv2d(image, convolution.weight, convolution.bias, 2, 1)
        branches.append(attention(leaky(features)))
    both = torch.cat(branches, 1)
    first, norm1, _, second, norm2, _, attention, third, _, last = discriminator.body
    assert [layer.out_channels for layer in (first, second, third, last)] == [16, 32, 8, 1]
    assert last.kernel_size == (2, 2)
    for convolution, norm in ((first, norm1), (second, norm2)):
        both = leaky(norm(functional.conv2d(both, convolution.weight, None, 2, 1)))
    both = leaky(functional.conv2d(attention(both), third.weight, third.bias))
    expected = functional.conv2d(both, last.weight, last.bias)
    torch.testing.assert_close(discriminator(*inputs), expected)
