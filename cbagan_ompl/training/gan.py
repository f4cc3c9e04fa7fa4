"""The three networks with their optimisers, and the images that they see."""

from __future__ import annotations

import copy
import os
from dataclasses import dataclass
from typing import Any

import torch
from torch import Tensor, nn
from torch.nn.parallel import DistributedDataParallel

from ..errors import ConfigError
from ..networks.attention import Attention
from ..networks.discriminator import Discriminator
from ..networks.encoding import map_image, point_image, region_image
from ..networks.generator import Generator
from ..networks.patch_generator import PatchGenerator
from .batches import Batch
from .config import TrainingConfig
from .distributed import ProcessGroup, share_batch_norm


class Networks:
    """The three networks, their optimisers, and the moving average of the generator.

    Each optimiser owns the weights of one network and of no other.

    Args:
        config: the recipe; ``config.seed`` decides the initial weights.
        device: where the weights live.
        group: the processes that share each batch.
    """

    def __init__(
        self, config: TrainingConfig, device: torch.device, group: ProcessGroup | None = None
    ) -> None:
        torch.manual_seed(config.seed)
        self.group = group or ProcessGroup()
        self.generator = make_generator(config)
        attention = attention_of(config)
        self.map_discriminator = Discriminator(config.discriminator_width, attention, config.patch)
        self.point_discriminator = Discriminator(
            config.discriminator_width, attention, config.patch
        )
        self.average = copy.deepcopy(self.generator).requires_grad_(False).eval()
        self.rates = {
            "generator": config.generator_lr,
            "map_discriminator": config.map_discriminator_lr,
            "point_discriminator": config.point_discriminator_lr,
        }
        self.optimizers: dict[str, torch.optim.Optimizer] = {}
        self._taught: dict[str, nn.Module] = {}
        for name, rate in self.rates.items():
            network = getattr(self, name)
            if self.group.size > 1:
                share_batch_norm(network)
            _place(network, device)
            self._taught[name] = network
            if self.group.size > 1:
                self._taught[name] = DistributedDataParallel(network)
            self.optimizers[name] = torch.optim.AdamW(
                network.parameters(),
                lr=rate,
                betas=(config.beta1, config.beta2),
                weight_decay=config.weight_decay,
            )
        _place(self.average, device)
        self._precision = torch.autocast(
            device.type, torch.bfloat16, enabled=config.precision == "bfloat16"
        )

    def run(self, name: str, *inputs: Tensor, taught: bool = True) -> Tensor:
        """The output of a network, in the precision of the recipe.

        Args:
            name: ``generator``, ``map_discriminator`` or ``point_discriminator``.
            inputs: of the network.
            taught: the backward pass reaches the weights of the network, and their gradients are
                averaged over the processes. A discriminator that judges for the generator's sake
                is not taught.
        """
        network = self._taught[name] if taught else getattr(self, name)
        with self._precision:
            output: Tensor = network(*inputs)
        return output.float()

    def set_learning_rates(self, factor: float) -> None:
        """Set each learning rate to ``factor`` times its highest value."""
        for name, optimizer in self.optimizers.items():
            for group in optimizer.param_groups:
                group["lr"] = factor * self.rates[name]

    @torch.no_grad()
    def update_average(self, decay: float, step: int) -> None:
        """Move the average towards the generator.

        Args:
            decay: weight of the old average; lower in the first steps, which have little to say.
            step: steps done so far.
        """
        decay = min(decay, (1 + step) / (10 + step))
        current = self.generator.state_dict()
        for name, value in self.average.state_dict().items():
            if value.is_floating_point():
                value.lerp_(current[name], 1 - decay)
            else:
                value.copy_(current[name])

    def state_dict(self) -> dict[str, Any]:
        """Weights and optimiser states."""
        state: dict[str, Any] = {name: getattr(self, name).state_dict() for name in self._modules}
        state["optimizers"] = {name: opt.state_dict() for name, opt in self.optimizers.items()}
        return state

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """The inverse of :meth:`state_dict`."""
        for name in self._modules:
            getattr(self, name).load_state_dict(state[name])
        for name, optimizer in self.optimizers.items():
            optimizer.load_state_dict(state["optimizers"][name])

    def start_from(self, state: dict[str, Any]) -> None:
        """Begin with the weights of another run, the generator with its average there.

        Args:
            state: what :meth:`state_dict` of the other run gave.

        Raises:
            ConfigError: they belong to other networks.
        """
        try:
            for name in self._modules:
                weights = state["average" if name == "generator" else name]
                getattr(self, name).load_state_dict(weights)
        except RuntimeError as error:
            raise ConfigError(
                "the run to start from has other networks: give its options of them"
            ) from error

    _modules = ("generator", "map_discriminator", "point_discriminator", "average")


def _place(network: nn.Module, device: torch.device) -> None:
    # Channels-last convolutions take two thirds of the time on a CPU.
    network.to(device, memory_format=torch.channels_last)  # type: ignore[call-overload]


def make_generator(config: TrainingConfig) -> Generator | PatchGenerator:
    """The generator that a recipe asks for, with fresh weights."""
    attention = attention_of(config)
    if config.patch == 1:
        return Generator(config.widths, attention, config.stem, config.noise_stem)
    return PatchGenerator(
        config.widths,
        attention,
        config.stem,
        config.patch,
        config.metrics,
        config.white_obstacles,
    )


def attention_of(config: TrainingConfig) -> Attention:
    """The kinds of attention that a recipe asks for, in all three networks."""
    return Attention(config.channel_attention, config.spatial_attention, config.self_attention)


@dataclass(frozen=True)
class Images:
    """A batch as the networks see it, (B, 3, S, S) in [-1, 1] each."""

    map: Tensor
    points: Tensor
    region: Tensor


def encode(batch: Batch) -> Images:
    """Draw the images of a batch."""
    height, width = batch.free.shape[-2:]
    images = (
        map_image(batch.free),
        point_image(batch.start, batch.goal, height, width),
        region_image(batch.region),
    )
    return Images(*(image.contiguous(memory_format=torch.channels_last) for image in images))


def pick_device(name: str) -> torch.device:
    """The device of a name; ``auto`` is a GPU if there is one.

    Of the processes that ``torchrun`` starts on a machine each gets its own GPU, unless the name
    has a number. The GPU is made the current one, through which the processes talk.

    Raises:
        ConfigError: no such device.
    """
    if name == "auto":
        name = "cuda" if torch.cuda.is_available() else "cpu"
    try:
        device = torch.device(name)
        if device.type == "cuda" and device.index is None:
            device = torch.device("cuda", int(os.environ.get("LOCAL_RANK", "0")))
        torch.empty(1, device=device)
        if device.type == "cuda":
            torch.cuda.set_device(device)
    except (RuntimeError, AssertionError) as error:
        raise ConfigError(f"cannot use device {name!r}: {error}") from error
    return device
