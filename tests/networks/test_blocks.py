from __future__ import annotations

import pytest

pytest.importorskip("torch")

from cbagan_ompl.networks.blocks import stride_of


def test_the_stride_is_that_of_the_patches_and_the_stages() -> None:
    assert (stride_of(1, (8, 8, 12, 16)), stride_of(4, (8, 8, 12))) == (16, 32)
