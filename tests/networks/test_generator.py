from __future__ import annotations

import pytest

torch = pytest.importorskip("torch")

from cbagan_ompl.networks.generator import Generator


@pytest.mark.parametrize("size", [(16, 16), (48, 32)])
def test_generator_keeps_height_and_width(size: tuple[int, int]) -> None:
    generator = Generator((4, 4, 6, 8)).eval()
    image = generator(torch.zeros(2, 3, *size), torch.zeros(2, 3, *size), torch.zeros(2, 1, *size))
    assert image.shape == (2, 3, *size)
    assert image.abs().max() < 1


def test_generator_is_the_papers_by_value() -> None:
    torch.manual_seed(0)
    generator = Generator((4, 4, 6, 8), stem=5, noise_stem=7).eval()
    inputs = [torch.randn(2, channels, 32, 32) for channels in (3, 3, 1)]
    stems = (generator.map_stem, generator.point_stem, generator.noise_stem)
    assert [(s.in_channels, s.out_channels, s.kernel_size) for s in stems] == [
        (3, 5, (3, 3)),
        (3, 5, (3, 3)),
        (1, 7, (3, 3)),
    ]
    features = [
        torch.nn.functional.conv2d(image, stem.weight, stem.bias, padding=1).clamp(min=0)
        for image, stem in zip(inputs, stems, strict=True)
    ]
    half = generator.down1(torch.cat(features, 1))
    last = generator.up1(generator.trunk(half), features[0] + features[1])
    head = torch.einsum("oc,bchw->bohw", generator.head.weight[:, :, 0, 0], last)
    expected = torch.tanh(head + generator.head.bias[:, None, None])
    torch.testing.assert_close(generator(*inputs), expected)
