from __future__ import annotations

import numpy as np
import pytest

torch = pytest.importorskip("torch")

from cbagan_ompl.networks.encoding import map_image, point_image, region_image, region_probability


def test_region_image_and_probability_are_inverse() -> None:
    region = torch.rand(2, 1, 3, 4)
    torch.testing.assert_close(region_probability(region_image(region)), region)
    green = region_image(torch.ones(1, 1, 1, 1)).flatten().tolist()
    white = region_image(torch.zeros(1, 1, 1, 1)).flatten().tolist()
    assert (green, white) == ([-1, 1, -1], [1, 1, 1])


def test_map_image_is_white_where_free() -> None:
    free = torch.tensor([[[[1.0, 0.0]]]])
    assert map_image(free)[0, :, 0].T.tolist() == [[1, 1, 1], [-1, -1, -1]]


def test_point_image_has_a_blue_start_and_a_red_goal() -> None:
    image = point_image(torch.tensor([[3.5, 2.5]]), torch.tensor([[9.5, 5.5]]), 8, 13)[0]
    assert image.shape == (3, 8, 13)
    assert image[:, 2, 3].tolist() == [-1, -1, 1]
    assert image[:, 5, 9].tolist() == [1, -1, -1]
    assert image[:, 0, 12].tolist() == [1, 1, 1]
    assert (image[0, :, :7] < 0).sum() == 9


def test_spots_move_with_the_fraction_of_a_pixel() -> None:
    goal = torch.tensor([[20.0, 20.0]])
    left, right = (point_image(torch.tensor([[u, 8.0]]), goal, 32, 32) for u in (8.1, 8.4))
    assert not torch.equal(left, right)


def test_encoding_matches_a_slow_reference() -> None:
    start, goal = (5.2, 3.9), (10.0, 9.0)
    image = point_image(torch.tensor([start]), torch.tensor([goal]), 12, 16)[0].numpy()
    for row, column in np.ndindex(12, 16):
        distance = np.hypot(column + 0.5 - start[0], row + 0.5 - start[1])
        assert image[0, row, column] == pytest.approx(
            1 - 2 * np.clip(2.5 - distance, 0, 1), abs=1e-5
        )
