"""The training recipe: one frozen record of every choice, with named presets.

In configuration files, in ``--set KEY=VALUE``, in checkpoints and on model cards all options have
flat names: ``widths`` is an option next to ``epochs``, though it belongs to the architecture, which
has a record of its own (:class:`cbagan_ompl.networks.config.NetworkConfig`). No name occurs twice.
This module does not import torch.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields, replace
from os import PathLike
from typing import Any

from ..common.files import as_path, read_bytes
from ..common.yaml_text import MAX_YAML_BYTES, parse_yaml
from ..errors import ConfigError, show
from ..networks.config import (
    AT_LEAST_0,
    NetworkConfig,
    Rule,
    between,
    check_types,
    check_values,
    convert_values,
)

SCHEDULES = ("one-cycle", "exponential")
PRECISIONS = ("float32", "bfloat16")

#: The checkpoints of a run: of its last epoch, and of its best one.
LAST, BEST = "last.pt", "best.pt"

#: Most epochs of a run.
MAX_EPOCHS = 10_000


@dataclass(frozen=True)
class TrainingConfig:
    """Everything that decides the result of a training run, apart from the data.

    Attributes:
        network: the architecture of the networks.
        epochs: passes over the training tasks.
        batch_size: tasks in one step.
        generator_lr: highest learning rate of the generator.
        map_discriminator_lr: highest learning rate of the map discriminator.
        point_discriminator_lr: highest learning rate of the point discriminator.
        beta1: decay of the optimisers' first moment.
        beta2: decay of the optimisers' second moment.
        weight_decay: decoupled decay (AdamW, https://arxiv.org/abs/1711.05101); with 0 the
            optimiser is plain Adam.
        clip_norm: gradients of the generator longer than this are shortened to it; 0 turns it off.
            Those of wavefronts are tens of times as long as usual now and then, and Adam takes
            hundreds of steps to recover from one.
        schedule: ``one-cycle`` (linear warm-up, then a half cosine to 0, after
            https://arxiv.org/abs/1708.07120) or ``exponential``.
        warmup: fraction of the steps that the warm-up of ``one-cycle`` takes.
        decay: factor on the learning rates after each epoch of ``exponential``.
        plateau_patience: epochs without a better validation IoU after which the learning rates
            are lowered (on top of the schedule); 0 turns it off.
        plateau_factor: factor on the learning rates each time.
        adversarial_every: train the discriminators, and the generator against them, in every
            n-th step; the other steps train the generator on the supervised losses alone.
        adversarial_weight: factor of each adversarial loss (alpha_1 = alpha_2 of the paper); with
            0 there are no discriminators, and the generator is trained for segmentation alone.
        adaptive_alpha: alpha of the paper's adaptive generator loss, in which the discriminator
            that errs more weighs more; 0 gives both the same weight.
        pixel_weight: factor of the pixel-wise squared error.
        bce_weight: factor of the binary cross-entropy.
        dice_weight: factor of the Dice loss.
        dice_smooth: smoothing term of the Dice loss.
        positive_weight: factor of the region's part of the binary cross-entropy; above 1 a missed
            pixel costs more than one too many.
        direction_weight: factor of the loss of the directions of travel, for networks that paint
            them on tasks that have them.
        scales: each batch is scaled down by one of these factors at random, so that the networks
            learn from coarse maps as well.
        symmetries: turn and mirror each task at random (8 symmetries of the square).
        reversal: exchange start and goal at random. Only for regions that do not depend on which
            is which: those of the paper's data set grew from one endpoint, and there it costs
            0.04 of IoU.
        ema_decay: validate and export an exponential moving average of the generator with this
            decay for each step; 0 turns it off.
        precision: of the networks' arithmetic: ``float32``, or ``bfloat16`` where that is faster
            (weights and losses stay float32).
        validation_fraction: fraction of the training tasks that is held out for validation.
        seed: seeds the weights, the split, the order, the augmentation and the noise.

    Raises:
        ConfigError: a value that makes no sense; the message names the option.

    Example:
        >>> config = TrainingConfig.preset("synthetic").updated({"epochs": 2, "stem": 8})
        >>> config.epochs, config.network.stem
        (2, 8)
    """

    network: NetworkConfig = field(default_factory=NetworkConfig)
    epochs: int = 26
    batch_size: int = 32
    generator_lr: float = 2e-3
    map_discriminator_lr: float = 5e-5
    point_discriminator_lr: float = 5e-5
    beta1: float = 0.9
    beta2: float = 0.999
    weight_decay: float = 0.01
    clip_norm: float = 0.0
    schedule: str = "one-cycle"
    warmup: float = 0.1
    decay: float = 0.95
    plateau_patience: int = 0
    plateau_factor: float = 0.1
    adversarial_every: int = 6
    adversarial_weight: float = 0.05
    adaptive_alpha: float = 0.0
    pixel_weight: float = 20.0
    bce_weight: float = 1.0
    dice_weight: float = 10.0
    dice_smooth: float = 1.0
    positive_weight: float = 1.0
    direction_weight: float = 1.0
    scales: tuple[int, ...] = (1,)
    symmetries: bool = True
    reversal: bool = False
    ema_decay: float = 0.998
    precision: str = "float32"
    validation_fraction: float = 0.05
    seed: int = 0

    def __post_init__(self) -> None:
        check_types(
            self, {field.name: field.default for field in fields(self) if field.name != "network"}
        )
        if not isinstance(self.network, NetworkConfig):
            raise ConfigError(f"network is a NetworkConfig, got {show(self.network)}")
        for name, choices in (("schedule", SCHEDULES), ("precision", PRECISIONS)):
            if getattr(self, name) not in choices:
                raise ConfigError(
                    f"{name} is one of {', '.join(choices)}, got {show(getattr(self, name))}"
                )
        check_values(self, RULES)

    @classmethod
    def preset(cls, name: str) -> TrainingConfig:
        """Return one of :data:`PRESETS`.

        Raises:
            ConfigError: there is no preset of that name.
        """
        if not isinstance(name, str) or name not in PRESETS:
            raise ConfigError(f"unknown preset {show(name)}; choose one of {', '.join(PRESETS)}")
        return PRESETS[name]

    @classmethod
    def from_file(
        cls, path: str | PathLike[str], base: TrainingConfig | None = None
    ) -> TrainingConfig:
        """Read options from a JSON or YAML file; those it leaves out keep the values of ``base``.

        Raises:
            ConfigError: the file is missing, cannot be parsed, holds an unknown option, or a value
                of the wrong type or out of range.
        """
        text = read_bytes(as_path(path), ConfigError, MAX_YAML_BYTES)
        values = parse_yaml(text, str(path), ConfigError)
        if not isinstance(values, dict):
            raise ConfigError(f"{path}: a configuration holds lines such as 'epochs: 20'")
        return (base or cls()).updated(values)

    def with_network(self, name: str) -> TrainingConfig:
        """Return the same recipe for one of :data:`cbagan_ompl.networks.config.NETWORKS`.

        Raises:
            ConfigError: there is no network of that name.
        """
        return replace(self, network=self.network.variant(name))

    def with_assignments(self, assignments: Sequence[str]) -> TrainingConfig:
        """Return a copy with the options of some texts ``KEY=VALUE``, as YAML reads the values.

        Raises:
            ConfigError: a text without ``=``, an unknown option, or a value that cannot be parsed,
                is of the wrong type or out of range.

        Example:
            >>> TrainingConfig().with_assignments(["epochs=3", "widths=[8, 8, 16]"]).epochs
            3
        """
        values: dict[Any, Any] = {}
        for assignment in assignments:
            name, equals, text = assignment.partition("=")
            if not equals:
                raise ConfigError(f"--set takes KEY=VALUE, got {show(assignment)}")
            values[name] = parse_yaml(text, f"--set {show(assignment)}", ConfigError)
        return self.updated(values)

    def updated(self, values: Mapping[Any, Any]) -> TrainingConfig:
        """Return a copy with some options changed.

        Args:
            values: by the flat name of the option, the architecture's as well.

        Raises:
            ConfigError: an unknown option, or a value of the wrong type or out of range.
        """
        known = self.to_dict()
        for name in values:
            if name not in known:
                raise ConfigError(f"unknown option {show(name)}; known are {', '.join(known)}")
        own = {option.name: getattr(self, option.name) for option in fields(self)}
        network = {name: value for name, value in values.items() if name not in own}
        rest = {name: value for name, value in values.items() if name in own}
        return replace(self, network=self.network.updated(network), **convert_values(own, rest))

    def to_dict(self) -> dict[str, Any]:
        """Return all options by their flat names, the architecture's first, with JSON's types."""
        values = asdict(self)
        values = values.pop("network") | values
        return {
            name: list(value) if isinstance(value, tuple) else value
            for name, value in values.items()
        }


_POSITIVE = Rule(lambda value: value > 0, "positive")
_FACTOR = Rule(lambda value: 0 < value <= 1, "above 0 and at most 1")
_BELOW_1 = Rule(lambda value: 0 <= value < 1, "at least 0 and below 1")

#: The rule of each option that is a number, and of ``scales``.
RULES = {
    # More would make the log in a checkpoint longer than a reader follows.
    "epochs": between(1, MAX_EPOCHS),
    # Batch norm needs two tasks where the coarsest stage has one pixel.
    "batch_size": between(2, 2**16),
    "generator_lr": _POSITIVE,
    "map_discriminator_lr": _POSITIVE,
    "point_discriminator_lr": _POSITIVE,
    "beta1": _BELOW_1,
    "beta2": _BELOW_1,
    "weight_decay": AT_LEAST_0,
    "clip_norm": AT_LEAST_0,
    "warmup": _BELOW_1,
    "decay": _FACTOR,
    "plateau_patience": between(0, MAX_EPOCHS),
    "plateau_factor": _FACTOR,
    "adversarial_every": between(1, 2**31),
    "adversarial_weight": AT_LEAST_0,
    "adaptive_alpha": AT_LEAST_0,
    "pixel_weight": AT_LEAST_0,
    "bce_weight": AT_LEAST_0,
    "dice_weight": AT_LEAST_0,
    "dice_smooth": AT_LEAST_0,
    "positive_weight": AT_LEAST_0,
    "direction_weight": AT_LEAST_0,
    "scales": Rule(
        lambda value: 0 < len(value) <= 64 and min(value) >= 1 and max(value) <= 64,
        "from 1 to 64, and 64 of them at most",
    ),
    "ema_decay": _BELOW_1,
    "validation_fraction": Rule(lambda value: 0 < value < 1, "between 0 and 1"),
    # The bounds of torch's random numbers.
    "seed": Rule(lambda value: 0 <= value < 2**63, "at least 0 and below 2**63"),
}

# The architecture of the bundled model.
_BUNDLED = NetworkConfig(widths=(24, 32), patch=4, passages=True, white_obstacles=True)

#: ``synthetic`` is what the bundled model was trained with: for images of 256 pixels, with new maps
#: in every epoch. ``refine`` goes on from it on a data set, for segmentation alone, on maps that
#: are met again as they are (no symmetries). ``best`` is the best one for the paper's data.
#: ``paper`` has the values of the tables of the CBAGAN-RRT paper. Where these and its text differ
#: (50 epochs, momentum 0.9), the tables are followed; ``alpha_1 = alpha_2 = 0.5`` is the text's,
#: the table's 1 being for another loss, as are its factors of an IoU loss and of a plain generator
#: loss. The numbers that it leaves out (decay, plateau) are PyTorch's defaults or this project's.
PRESETS: dict[str, TrainingConfig] = {
    "best": TrainingConfig(),
    "synthetic": TrainingConfig(
        network=_BUNDLED,
        epochs=14,
        batch_size=16,
        warmup=0.05,
        clip_norm=2.0,
        adversarial_every=16,
        pixel_weight=4.0,
        dice_weight=2.0,
        positive_weight=1.5,
        scales=(1, 1, 1, 2),
        precision="bfloat16",
    ),
    "refine": TrainingConfig(
        network=_BUNDLED,
        epochs=60,
        batch_size=8,
        generator_lr=1e-3,
        clip_norm=2.0,
        adversarial_weight=0.0,
        pixel_weight=4.0,
        dice_weight=2.0,
        positive_weight=3.5,
        symmetries=False,
        ema_decay=0.95,
        validation_fraction=0.1,
    ),
    "paper": TrainingConfig(
        epochs=20,
        batch_size=8,
        generator_lr=1e-4,
        map_discriminator_lr=5e-5,
        point_discriminator_lr=5e-5,
        beta1=0.5,
        beta2=0.999,
        weight_decay=1e-4,
        schedule="exponential",
        plateau_patience=10,
        adversarial_every=1,
        adversarial_weight=0.5,
        ema_decay=0.0,
    ),
}
