from __future__ import annotations

import pytest

torch = pytest.importorskip("torch")

from helpers.patches import clutter, generator

from cbagan_ompl.networks.encoding import map_image, point_image
from cbagan_ompl.networks.patch_generator import endpoint_cells


def images(free: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
    """Inputs for maps (B, 1, H, W) whose tasks lead from corner to corner."""
    height, width = free.shape[-2:]
    start = torch.full((len(free), 2), 3.5)
    goal = torch.tensor([width - 3.5, height - 3.5]).expand(len(free), 2)
    points = point_image(start, goal, height, width)
    return map_image(free), points, torch.zeros_like(free)


@pytest.mark.parametrize(("height", "width"), [(64, 64), (64, 128)])
def test_the_image_has_the_size_of_the_map_and_white_obstacles(height: int, width: int) -> None:
    free = clutter(2, 1, height, width)
    image = generator()(*images(free))
    assert image.shape == (2, 3, height, width)
    obstacles = (free == 0).expand_as(image)
    assert (image[obstacles] == 1).all()
    assert (image[:, ::2][~obstacles[:, ::2]].abs() < 1).all()
    assert (image[:, 1] == 1).all(), "green on white is green everywhere"
    unmasked = generator(white_obstacles=False)(*images(free))
    assert (unmasked[:, ::2][obstacles[:, ::2]] != 1).all()


@pytest.mark.parametrize("cost_maps", [0, 3])
def test_every_pixel_of_a_patch_matters(cost_maps: int) -> None:
    # Sixteen maps, in each of which another pixel of one patch is blocked.
    free = torch.ones(17, 1, 64, 64)
    for pixel in range(16):
        free[1 + pixel, 0, 32 + pixel // 4, 20 + pixel % 4] = 0
    outputs = generator(cost_maps=cost_maps)(*images(free))
    # What is white because of the obstacles does not count.
    outputs[:, :, 32:36, 20:24] = 0
    for i in range(17):
        for j in range(i):
            assert not torch.equal(outputs[i], outputs[j])


def test_points_and_noise_matter_to_the_pixel() -> None:
    model, (map_images, points, noise) = generator(), images(torch.ones(1, 1, 64, 64))
    points.requires_grad_()
    noise.requires_grad_()
    weights = torch.rand(1, 3, 64, 64, generator=torch.Generator().manual_seed(0))
    (model(map_images, points, noise) * weights).sum().backward()
    for inputs in (points, noise):
        assert inputs.grad is not None
        assert (inputs.grad != 0).float().mean() > 0.99


def test_the_cell_of_a_point_has_most_of_its_spot() -> None:
    starts, goals = torch.tensor([[13.0, 3.0], [8.0, 20.5]]), torch.tensor([[30.5, 25.2]] * 2)
    endpoints = endpoint_cells(point_image(starts, goals, 32, 40), 8)
    assert endpoints.shape == (2, 2, 4, 5)
    assert endpoints[0, 0].nonzero().tolist() == [[0, 1]]
    # Half of it on either side of a border.
    assert endpoints[1, 0].nonzero().tolist() == [[2, 0], [2, 1]]
    assert endpoints[:, 1].nonzero().tolist() == [[0, 3, 3], [1, 3, 3]]


def test_paths_avoid_walls_before_training() -> None:
    # A wall through the middle, open at the top: the distance fields must not spread through it.
    free = torch.ones(1, 1, 128, 128)
    free[:, :, 16:, 56:72] = 0
    model = generator(cost_maps=3)
    assert model.wavefront is not None
    seen: list[torch.Tensor] = []
    model.wavefront.register_forward_hook(lambda _, inputs, outputs: seen.append(outputs))
    points = point_image(torch.tensor([[20.5, 100.5]]), torch.tensor([[108.5, 100.5]]), 128, 128)
    with torch.no_grad():
        model(map_image(free), points, torch.zeros_like(free))
    sharp = seen[0][0, :3]
    assert (sharp[:, :2, 7:9].amax((1, 2)) > 0.9).all(), "the best paths pass the opening"
    assert (sharp[:, 12, 7:9] < 0.4).all(), "and not the wall, straight on"
