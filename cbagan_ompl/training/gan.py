"""The three networks of the GAN with their optimisers, and the average of the generator."""

from __future__ import annotations

import copy
from typing import Any, NamedTuple

import torch
from torch import Tensor, nn
from torch.nn.parallel import DistributedDataParallel

from ..errors import ConfigError
from ..networks.discriminator import Discriminator
from ..networks.factory import make_discriminator, make_generator
from .config import TrainingConfig
from .distributed import ProcessGroup, synchronize_batch_norm


class Painted(NamedTuple):
    """What a generator returns, in float32.

    Attributes:
        image: of the region, (B, 3, H, W) in [-1, 1].
        direction: of travel, (B, 2, h, w), see
            :class:`cbagan_ompl.networks.passage_generator.PassageGenerator`; None of the others.
    """

    image: Tensor
    direction: Tensor | None

    @classmethod
    def of(cls, output: Tensor | tuple[Tensor, Tensor]) -> Painted:
        """Return the output of any generator."""
        if isinstance(output, Tensor):
            return cls(output.float(), None)
        return cls(output[0].float(), output[1].float())


class Gan:
    """The generator, its exponential moving average, and two discriminators, with optimisers.

    With an ``adversarial_weight`` of 0 there are no discriminators.

    Each optimiser (AdamW; Loshchilov and Hutter, "Decoupled weight decay regularization", 2019,
    https://arxiv.org/abs/1711.05101) owns the weights of one network and of no other.

    Attributes:
        group: the processes that train together.
        generator: a generator of :mod:`cbagan_ompl.networks`.
        discriminators: ``map_discriminator``, which sees the map image, and
            ``point_discriminator``, which sees the point image; or none.
        average: the moving average of the generator.
        learning_rates: the highest one of each trained network.
        optimizers: of each trained network.

    Args:
        config: the recipe; ``config.seed`` decides the initial weights.
        device: where the weights are.
        group: the processes that divide each batch among them.
    """

    def __init__(
        self, config: TrainingConfig, device: torch.device, group: ProcessGroup | None = None
    ) -> None:
        torch.manual_seed(config.seed)
        self.group = group or ProcessGroup()
        self.generator = make_generator(config.network)
        self.discriminators: dict[str, Discriminator] = {}
        if config.adversarial_weight:
            self.discriminators = {
                name: make_discriminator(config.network)
                for name in ("map_discriminator", "point_discriminator")
            }
        self.average = copy.deepcopy(self.generator).requires_grad_(False).eval()
        self.learning_rates = {
            "generator": config.generator_lr,
            "map_discriminator": config.map_discriminator_lr,
            "point_discriminator": config.point_discriminator_lr,
        }
        self.optimizers: dict[str, torch.optim.Optimizer] = {}
        self._networks: dict[str, nn.Module] = {"generator": self.generator, **self.discriminators}
        self._trained: dict[str, nn.Module] = {}
        for name, network in self._networks.items():
            if self.group.size > 1:
                synchronize_batch_norm(network)
            _move(network, device)
            self._trained[name] = network
            if self.group.size > 1:
                self._trained[name] = DistributedDataParallel(network)
            self.optimizers[name] = torch.optim.AdamW(
                network.parameters(),
                lr=self.learning_rates[name],
                betas=(config.beta1, config.beta2),
                weight_decay=config.weight_decay,
            )
        _move(self.average, device)
        self._networks["average"] = self.average
        self._precision = torch.autocast(
            device.type, torch.bfloat16, enabled=config.precision == "bfloat16"
        )

    def generate(self, *inputs: Tensor) -> Painted:
        """Return what the generator paints, computed as by :meth:`run`."""
        with self._precision:
            return Painted.of(self._trained["generator"](*inputs))

    def run(self, name: str, *inputs: Tensor, trained: bool = True) -> Tensor:
        """Return the output of a network, computed in the precision of the recipe, in float32.

        Args:
            name: ``map_discriminator`` or ``point_discriminator``.
            inputs: of the network.
            trained: the backward pass reaches the weights of the network, and their gradients are
                averaged over the processes. False for a discriminator in a step of the generator.
        """
        network = self._trained[name] if trained else self._networks[name]
        with self._precision:
            output: Tensor = network(*inputs)
        return output.float()

    def set_learning_rates(self, factor: float) -> None:
        """Set each learning rate to ``factor`` times its highest value."""
        for name, optimizer in self.optimizers.items():
            for group in optimizer.param_groups:
                group["lr"] = factor * self.learning_rates[name]

    @torch.no_grad()
    def update_average(self, decay: float, step: int) -> None:
        """Move the average towards the generator.

        Args:
            decay: weight of the old average; it is at most (1 + step) / (10 + step), since the
                weights of the first steps are poor.
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
        """Return the weights and the states of the optimisers."""
        state: dict[str, Any] = {
            name: network.state_dict() for name, network in self._networks.items()
        }
        state["optimizers"] = {name: opt.state_dict() for name, opt in self.optimizers.items()}
        return state

    def load_state_dict(self, state: dict[str, Any]) -> None:
        """Restore what :meth:`state_dict` returned.

        Raises:
            Exception: of many types, for a state of other networks or a damaged one.
        """
        for name, network in self._networks.items():
            network.load_state_dict(state[name])
        for name, optimizer in self.optimizers.items():
            before = [dict(group) for group in optimizer.param_groups]
            optimizer.load_state_dict(state["optimizers"][name])
            _check_optimizer(optimizer, before)

    def start_from(self, state: dict[str, Any]) -> None:
        """Take over the weights of another run; the generator those of the average there.

        Args:
            state: what :meth:`state_dict` of the other run returned. Discriminators that it does
                not have keep their first weights.

        Raises:
            ConfigError: the weights belong to networks of another architecture.
        """
        try:
            for name, network in self._networks.items():
                source = "average" if name == "generator" else name
                if source in state:
                    network.load_state_dict(state[source])
        except Exception as error:  # torch raises several types
            raise ConfigError(
                "the run to start from has other networks: set the same options of the networks"
            ) from error


def _check_optimizer(optimizer: torch.optim.Optimizer, groups: list[dict[str, Any]]) -> None:
    """Raise if a state that was loaded has other options than before, or does not fit the weights.

    torch compares neither, and a step would fail or read what is not there.
    """
    for before, now in zip(groups, optimizer.param_groups, strict=True):
        # The learning rate is set for each step.
        for option in before.keys() - {"lr", "params"}:
            if type(now.get(option)) is not type(before[option]) or now[option] != before[option]:
                raise ValueError(f"the optimiser has another {option}")
        for weight in now["params"]:
            state = optimizer.state.get(weight, {})
            shapes = {name: tuple(value.shape) for name, value in state.items()}
            shape = tuple(weight.shape)
            if shapes and shapes != {"step": (), "exp_avg": shape, "exp_avg_sq": shape}:
                raise ValueError("the state of the optimiser has other shapes than its weights")


def _move(network: nn.Module, device: torch.device) -> None:
    # Channels-last convolutions take two thirds of the time on a CPU.
    network.to(device, memory_format=torch.channels_last)  # type: ignore[call-overload]
