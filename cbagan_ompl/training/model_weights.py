"""The weights that a run begins with: of another run's checkpoint, or of an exported model.

An exported model has no batch norms: ``torch.jit.freeze`` has folded them into the convolutions
before them, and has dropped all names. Its weights are found by their position: a generator of the
same architecture with random weights is exported too, and where one of those is in its file, the
model has the weight of that name. The result computes the same as the model, which is checked.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields
from itertools import pairwise
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn
from torch.nn.utils.fusion import fuse_conv_bn_weights

from ..datasets.dataset import Tasks
from ..errors import ModelError
from ..inference.bundled_models import find_model
from ..inference.model_files import ModelFormat, is_model, load_script, read_model
from ..inference.predictor import load_model
from ..networks.config import NetworkConfig
from ..networks.export_model import (
    AnyGenerator,
    PatchModel,
    RegionModel,
    make_region_model,
)
from ..networks.factory import make_generator
from ..networks.generator import Generator
from ..networks.passage_generator import PassageGenerator
from ..networks.passage_model import PassageModel
from ..networks.patch_generator import PatchGenerator
from .batches import encode, make_batch
from .checkpoints import load_checkpoint
from .torchscript import script_bytes

# Options of the architecture that records of earlier versions call otherwise.
_FORMER_NAMES = {"metrics": "cost_maps"}

# Largest difference of a probability from that of the model, by rounding.
_TOLERANCE = 1e-3

# Most tasks from which the statistics of the batch norms are estimated.
_MAX_TASKS = 64


def starting_weights(path: str | PathLike[str], tasks: Tasks) -> dict[str, Any]:
    """Return weights to begin a run with, as :meth:`.gan.Gan.start_from` takes them.

    Args:
        path: of a checkpoint, or of an exported model; or the name of a bundled one. Exported
            models hold a generator alone.
        tasks: from which the statistics of an exported model's batch norms are estimated.

    Raises:
        ModelError: the file cannot be read, or the weights of the model cannot be recovered.
    """
    file = find_model(path)
    if not is_model(file):
        weights: dict[str, Any] = load_checkpoint(file)["gan"]
        return weights
    generator = recover_generator(file)
    estimate_statistics(generator, tasks)
    return {"average": generator.state_dict()}


def recover_generator(path: Path) -> AnyGenerator:
    """Return a generator in evaluation mode that computes what an exported model does.

    Each batch norm that was folded into a convolution only adds a constant until
    :func:`estimate_statistics` has been applied.

    Raises:
        ModelError: the file cannot be read, or holds no generator of this version's architecture.
    """
    if read_model(Path(path)).format is ModelFormat.ONNX:
        raise ModelError(f"{path}: weights are recovered from TorchScript files (.pt) alone")
    model = load_model(path)
    generator = make_generator(_architecture(model.record)).eval()
    try:
        _take_over(generator, _weights_of(model.module, generator))
        error = _largest_difference(make_region_model(generator), model.module, generator.stride)
    except (ValueError, RuntimeError, KeyError) as cause:
        raise ModelError(f"{path}: its weights cannot be recovered ({cause})") from cause
    if not error < _TOLERANCE:
        raise ModelError(
            f"{path}: its weights cannot be recovered, the result differs by {error:.2g}; start "
            "from a checkpoint of its training run"
        )
    return generator


def _architecture(record: dict[str, Any]) -> NetworkConfig:
    recipe = {_FORMER_NAMES.get(name, name): value for name, value in record["recipe"].items()}
    names = {option.name for option in fields(NetworkConfig)}
    return NetworkConfig().updated({name: recipe[name] for name in names & recipe.keys()})


@torch.no_grad()
def estimate_statistics(generator: AnyGenerator, tasks: Tasks) -> None:
    """Give folded batch norms the statistics of their inputs, without changing what they compute.

    In training a batch norm scales its input by the statistics of the batch. It begins with what
    it computed before if its own statistics are those of the data.

    Args:
        generator: from :func:`recover_generator`.
        tasks: the first ones are used.
    """
    norms = [norm for _, norm in _folded_norms(generator).values()]
    moments: dict[nn.Module, list[Tensor]] = {norm: [] for norm in norms}

    def add(norm: nn.Module, inputs: tuple[Tensor]) -> None:
        values = inputs[0].transpose(0, 1).flatten(1).double()
        moments[norm].append(torch.stack((values.mean(1), values.square().mean(1))))

    hooks = [norm.register_forward_pre_hook(add) for norm in norms]
    for index in range(min(_MAX_TASKS, len(tasks))):
        batch = make_batch(tasks, np.array([index]), torch.device("cpu"))
        images = encode(batch)
        generator(images.map, images.points, torch.zeros_like(batch.free))
    for hook in hooks:
        hook.remove()
    for norm in norms:
        mean, square = torch.stack(moments[norm]).mean(0)
        variance = (square - mean**2).clamp(min=norm.eps)
        state = norm.state_dict()
        state["bias"].add_(mean)
        state["weight"].copy_((variance + norm.eps).sqrt())
        state["running_mean"].copy_(mean)
        state["running_var"].copy_(variance)


@torch.no_grad()
def _take_over(generator: AnyGenerator, weights: list[Tensor]) -> None:
    """Set the weights of a generator from those of an exported one."""
    # No two weights are equal: equal constants become one.
    for parameter in generator.parameters():
        parameter.normal_()
    kept = generator.state_dict()
    for name, buffer in generator.named_buffers():
        if name in kept and buffer.is_floating_point():
            buffer.uniform_(0.5, 1.5)
    region = make_region_model(generator)
    script = load_script(script_bytes(region, {}))
    own = _weights_of(script, generator)
    if [value.numel() for value in own] != [value.numel() for value in weights]:
        raise ValueError("it has other weights than the networks of this version")
    values = _named_values(region)
    state = {_name_of(value, values): weight for value, weight in zip(own, weights, strict=True)}
    current = generator.state_dict()
    for name, norm in _folded_norms(generator).values():
        current[f"{name}.weight"].fill_(1)
        current[f"{name}.running_mean"].zero_()
        current[f"{name}.running_var"].fill_(1 - norm.eps)
    if not isinstance(generator, Generator):
        state |= _unfold_stems(generator, state)
    for name in state.keys() & current.keys():
        current[name].copy_(state[name].view_as(current[name]))


def _unfold_stems(
    generator: PatchGenerator | PassageGenerator, state: dict[str, Tensor]
) -> dict[str, Tensor]:
    """Return the stems of a generator that compute what those of the exported model do."""
    # A map has three equal colours, 2 x - 1 of its free space x: each gets a third of the weight.
    stem = state["map.weight"].view_as(generator.map_stem.weight[:, :1]) / 6
    weight = stem.expand_as(generator.map_stem.weight)
    stems = {
        "map_stem.weight": weight,
        "map_stem.bias": state["map.bias"] + weight.sum((1, 2, 3)),
        # The noise is 0 in the model, and its weights are not in the file.
        "noise_stem.weight": torch.zeros_like(generator.noise_stem.weight),
        "noise_stem.bias": torch.zeros(len(generator.noise_stem.weight)),
    }
    if isinstance(generator, PassageGenerator):
        return stems | {"merge.bias": torch.zeros(len(generator.merge.weight))}
    white = state["white"].flatten() - state["point_stem.weight"].flatten(1).sum(1)
    return stems | {"point_stem.bias": white}


def _named_values(region: RegionModel | PassageModel) -> dict[str, Tensor]:
    """Return the weights of a model as the exported file has them, by name."""
    model = region if isinstance(region, PassageModel) else region.model
    generator = model.generator
    assert isinstance(generator, nn.Module)
    values = {
        name: value for name, value in generator.state_dict().items() if value.is_floating_point()
    }
    for convolution, (norm_name, norm) in _folded_norms(generator).items():
        assert norm.running_mean is not None
        assert norm.running_var is not None
        weight, bias = fuse_conv_bn_weights(
            values[f"{convolution}.weight"],
            None,
            norm.running_mean,
            norm.running_var,
            norm.eps,
            norm.weight,
            norm.bias,
        )
        values[f"{convolution}.weight"], values[f"{norm_name}.bias"] = weight, bias
    if isinstance(model, PatchModel | PassageModel):
        values["map.weight"], values["map.bias"] = model.map_stem.weight, model.map_stem.bias
    if isinstance(model, PassageModel):
        # The norm behind these layers is folded into the first one.
        assert model.merge.bias is not None
        values["merge.weight"], values["norm.bias"] = model.merge.weight, model.merge.bias
        values["offsets"] = model.generator.offsets
    if isinstance(model, PatchModel):
        values["points.bias"], values["white"] = model.point_stem.bias, model.white_features
    return values


def _name_of(value: Tensor, values: dict[str, Tensor]) -> str:
    for name, other in values.items():
        if other.numel() == value.numel() and torch.allclose(
            other.reshape(-1), value.reshape(-1), rtol=1e-4, atol=1e-5
        ):
            return name
    raise ValueError(f"no weight of the shape {tuple(value.shape)} has such values")


def _folded_norms(generator: nn.Module) -> dict[str, tuple[str, nn.BatchNorm2d]]:
    """Return each batch norm after a convolution, and its name, by that of the convolution."""
    found: dict[str, tuple[str, nn.BatchNorm2d]] = {}
    for name, module in generator.named_modules():
        if isinstance(module, nn.Sequential):
            for i, (layer, norm) in enumerate(pairwise(module)):
                if isinstance(layer, nn.Conv2d) and isinstance(norm, nn.BatchNorm2d):
                    found[f"{name}.{i}"] = (f"{name}.{i + 1}", norm)
    if isinstance(generator, PassageGenerator):  # its noise is a constant without noise
        found["merge"] = ("norm", generator.norm)
    return found


def _weights_of(model: Any, generator: AnyGenerator) -> list[Tensor]:
    """Return the different weights of a frozen model, in the order of their last use in it.

    Of the features of no point in a :class:`PatchModel` the last ones are kept, those of a white
    image: earlier versions have the ones of no noise as well, and add them.
    """
    white = None
    if isinstance(generator, PatchGenerator):
        white = (1, generator.point_stem.out_channels, 1, 1)
    weights: list[Tensor] = []
    for value in _all_constants(model.graph):
        weights = [
            other
            for other in weights
            if not torch.equal(value, other) and not value.shape == other.shape == white
        ]
        weights.append(value)
    return weights


def _all_constants(block: Any) -> Iterator[Tensor]:
    for node in block.nodes():
        value = node.output().toIValue() if node.kind() == "prim::Constant" else None
        if isinstance(value, Tensor) and value.is_floating_point():
            yield value
        for inner in node.blocks():
            yield from _all_constants(inner)


@torch.no_grad()
def _largest_difference(one: nn.Module, other: nn.Module, stride: int) -> float:
    """Return the largest difference of two models' probabilities on some random maps."""
    rng = torch.Generator().manual_seed(0)
    side = max(4 * stride, 64)
    free = torch.ones(2, 1, side, side)
    walls = torch.rand(2, 1, side // 8, side // 8, generator=rng) < 0.2
    free -= walls.float().repeat_interleave(8, 2).repeat_interleave(8, 3)
    start, goal = (torch.rand(2, 2, generator=rng) * side for _ in range(2))
    return float((one(free, start, goal) - other(free, start, goal)).abs().max())
