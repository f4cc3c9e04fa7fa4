from __future__ import annotations

import pytest

torch = pytest.importorskip("torch")

from torch.nn import functional

from cbagan_ompl.networks.attention import CBAM
from cbagan_ompl.networks.blocks import ResidualBlock, UpBlock, stride_of


def test_the_stride_is_that_of_the_patches_and_the_stages() -> None:
    assert (stride_of(1, (8, 8, 12, 16)), stride_of(4, (8, 8, 12))) == (16, 32)


def test_a_residual_block_by_value() -> None:
    torch.manual_seed(0)
    block = ResidualBlock(3, 4, 2, CBAM).eval()
    inputs = torch.randn(2, 3, 8, 8)
    first, norm1, _, second, norm2, attention = block.body
    _, projection, norm3 = block.shortcut
    features = norm1(functional.conv2d(inputs, first.weight, stride=2, padding=1)).clamp(min=0)
    features = attention(norm2(functional.conv2d(features, second.weight, padding=1)))
    pooled = inputs.view(2, 3, 4, 2, 4, 2).mean(dim=(3, 5))
    expected = features + norm3(functional.conv2d(pooled, projection.weight))
    assert expected.min() < 0, "or the last ReLU would not show"
    torch.testing.assert_close(block(inputs), expected.clamp(min=0))
    kept = ResidualBlock(3, 3, 1, CBAM).eval()
    torch.testing.assert_close(kept(inputs), (kept.body(inputs) + inputs).clamp(min=0))


def test_an_up_block_adds_the_skip() -> None:
    torch.manual_seed(0)
    up = UpBlock(4, 3, CBAM).eval()
    features, skip = torch.randn(2, 4, 4, 4), torch.randn(2, 3, 8, 8)
    projected = functional.conv2d(features, up.project.weight, up.project.bias)
    doubled = projected.repeat_interleave(2, dim=2).repeat_interleave(2, dim=3)
    torch.testing.assert_close(up(features, skip), up.block(doubled + skip))
