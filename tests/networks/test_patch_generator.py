"""The generator that reads patches: its options, and its exported form."""

from __future__ import annotations

import warnings
from pathlib import Path

import pytest

torch = pytest.importorskip("torch")

from cbagan_ompl import ConfigError, DatasetError
from cbagan_ompl.networks.blocks import stride_of
from cbagan_ompl.networks.discriminator import Discriminator
from cbagan_ompl.networks.encoding import map_image, point_image
from cbagan_ompl.networks.export_model import ImageModel, RegionModel
from cbagan_ompl.networks.generator import Generator
from cbagan_ompl.networks.patch_generator import PatchGenerator, squares
from cbagan_ompl.networks.patch_model import PatchModel
from cbagan_ompl.training.batches import check_trainable
from cbagan_ompl.training.config import TrainingConfig
from cbagan_ompl.training.export import save_script
from cbagan_ompl.training.gan import make_generator

CONFIG = TrainingConfig(
    widths=(8, 8, 12, 16), stem=12, patch=4, metrics=3, white_obstacles=True, discriminator_width=4
)


def generator(**options: object) -> PatchGenerator:
    torch.manual_seed(0)
    made = make_generator(CONFIG.updated(options)).eval()
    assert isinstance(made, PatchGenerator)
    return made


def images(free: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
    """Inputs for maps (B, 1, H, W) whose tasks lead from corner to corner."""
    height, width = free.shape[-2:]
    start = torch.full((len(free), 2), 3.5)
    goal = torch.tensor([width - 3.5, height - 3.5]).expand(len(free), 2)
    points = point_image(start, goal, height, width)
    return map_image(free), points, torch.zeros_like(free)


def clutter(*shape: int) -> torch.Tensor:
    return (torch.rand(shape, generator=torch.Generator().manual_seed(1)) > 0.2).float()


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


def test_the_exported_model_gives_obstacles_no_probability() -> None:
    free = clutter(1, 1, 50, 70)
    start, goal = torch.tensor([[3.5, 3.5]]), torch.tensor([[60.5, 40.5]])
    probability = RegionModel(generator())(free, start, goal)
    assert probability.shape == free.shape
    assert (probability[free == 0] == 0).all()
    assert (probability[free == 1] > 0).all()


@pytest.mark.parametrize(("height", "width"), [(64, 64), (75, 130)])
def test_eager_scripted_and_reloaded_agree(tmp_path: Path, height: int, width: int) -> None:
    eager = RegionModel(generator()).eval()
    assert eager.stride == 64
    save_script(eager, tmp_path / "model.pt", {})
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        models = (torch.jit.script(eager), torch.jit.load(str(tmp_path / "model.pt")))
    free, start = clutter(2, 1, height, width), torch.tensor([[5.2, 60.9], [30.0, 2.0]])
    with torch.inference_mode():
        expected = eager(free, start, start.flip(0))
        assert expected.shape == free.shape
        for model in models:
            output = model(free, start, start.flip(0))
            torch.testing.assert_close(output, expected, rtol=0, atol=1e-5)


@pytest.mark.parametrize("metrics", [0, 3])
def test_every_pixel_of_a_patch_matters(metrics: int) -> None:
    # Sixteen maps, in each of which another pixel of one patch is blocked.
    free = torch.ones(17, 1, 64, 64)
    for pixel in range(16):
        free[1 + pixel, 0, 32 + pixel // 4, 20 + pixel % 4] = 0
    outputs = generator(metrics=metrics)(*images(free))
    # What obstacles paint white themselves does not count.
    outputs[:, :, 32:36, 20:24] = 0
    for i in range(17):
        for j in range(i):
            assert not torch.equal(outputs[i], outputs[j])


def test_points_and_noise_matter_to_the_pixel() -> None:
    model, (of_map, points, noise) = generator(), images(torch.ones(1, 1, 64, 64))
    points.requires_grad_()
    noise.requires_grad_()
    weights = torch.rand(1, 3, 64, 64, generator=torch.Generator().manual_seed(0))
    (model(of_map, points, noise) * weights).sum().backward()
    for inputs in (points, noise):
        assert inputs.grad is not None
        assert (inputs.grad != 0).float().mean() > 0.99


def test_the_default_options_are_the_papers_generator() -> None:
    assert (TrainingConfig().stem, TrainingConfig().patch, TrainingConfig().metrics) == (16, 1, 0)
    model = make_generator(TrainingConfig())
    assert isinstance(model, Generator)
    assert model.map_stem.kernel_size == (3, 3)
    assert not TrainingConfig().white_obstacles


def test_fronts_begin_where_most_of_a_spot_is() -> None:
    starts, goals = torch.tensor([[13.0, 3.0], [8.0, 20.5]]), torch.tensor([[30.5, 25.2]] * 2)
    ends = squares(point_image(starts, goals, 32, 40), 8)
    assert ends.shape == (2, 2, 4, 5)
    assert ends[0, 0].nonzero().tolist() == [[0, 1]]
    # Half of it on either side of a border.
    assert ends[1, 0].nonzero().tolist() == [[2, 0], [2, 1]]
    assert ends[:, 1].nonzero().tolist() == [[0, 3, 3], [1, 3, 3]]


@pytest.mark.parametrize("white_obstacles", [True, False])
@pytest.mark.parametrize("patch", [2, 4])
@pytest.mark.parametrize(
    ("start", "goal"),
    [
        ((70.3, 20.9), (5.2, 60.9)),
        ((0.1, 0.1), (127.9, 63.9)),
        ((30.0, 40.6), (32.9, 42.1)),  # the spots overlap
        ((29.4, 31.7), (44.8, 31.7)),  # each in the window of the other
        ((63.5, 0.5), (63.5, 63.5)),
    ],
)
def test_without_the_images_the_result_is_the_same(
    start: tuple[float, float], goal: tuple[float, float], patch: int, white_obstacles: bool
) -> None:
    model = generator(patch=patch, white_obstacles=white_obstacles)
    with torch.no_grad():
        model.head.weight.mul_(20)  # so that the result is not one half everywhere
        free, points = clutter(2, 1, 64, 128), torch.tensor([start, goal])
        ends = points[:1].expand(2, 2), points[1:].expand(2, 2)
        lean, full = PatchModel(model)(free, *ends), ImageModel(model)(free, *ends)
    assert full.std() > 0.1
    torch.testing.assert_close(lean, full, rtol=0, atol=1e-5)


def test_discriminators_see_patches_asplaces() -> None:
    inputs = torch.zeros(2, 3, 64, 64)
    logits = Discriminator(4, patch=4)(inputs, inputs)
    assert logits.shape == Discriminator(4)(inputs[..., :16, :16], inputs[..., :16, :16]).shape


def test_sides_are_multiples_of_the_stride() -> None:
    assert (stride_of(1, CONFIG.widths), stride_of(4, CONFIG.widths[:3])) == (16, 32)
    check_trainable(128, CONFIG)
    with pytest.raises(DatasetError, match="a multiple of 64 pixels; these have 96"):
        check_trainable(96, CONFIG)


@pytest.mark.parametrize(
    ("option", "value"),
    [("patch", 0), ("stem", 0), ("noise_stem", 0), ("metrics", -1), ("positive_weight", -0.5)],
)
def test_options_that_make_no_sense(option: str, value: float) -> None:
    with pytest.raises(ConfigError, match=option):
        CONFIG.updated({option: value})


@pytest.mark.parametrize("option", [{"metrics": 1}, {"white_obstacles": True}])
def test_options_of_patches_are_refused_without_them(option: dict[str, object]) -> None:
    with pytest.raises(ConfigError, match=f"{next(iter(option))} must be left out where patch is"):
        TrainingConfig().updated(option)


def test_fronts_heed_walls_before_anything_is_learned() -> None:
    # A wall through the middle, open at the top: the fronts must not flow through it.
    free = torch.ones(1, 1, 128, 128)
    free[:, :, 16:, 56:72] = 0
    model = generator(metrics=3)
    assert model.wavefront is not None
    seen: list[torch.Tensor] = []
    model.wavefront.register_forward_hook(lambda _, inputs, fronts: seen.append(fronts))
    points = point_image(torch.tensor([[20.5, 100.5]]), torch.tensor([[108.5, 100.5]]), 128, 128)
    with torch.no_grad():
        model(map_image(free), points, torch.zeros_like(free))
    sharp = seen[0][0, :3]
    assert (sharp[:, :2, 7:9].amax((1, 2)) > 0.9).all(), "the best ways pass the opening"
    assert (sharp[:, 12, 7:9] < 0.4).all(), "and not the wall, straight on"
