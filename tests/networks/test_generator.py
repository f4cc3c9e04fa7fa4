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
