"""The training recipe: one frozen record of every choice, with named presets."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields, replace
from os import PathLike
from pathlib import Path
from typing import Any

import yaml

from ..errors import ConfigError

SCHEDULES = ("one-cycle", "exponential")
PRECISIONS = ("float32", "bfloat16")


@dataclass(frozen=True)
class TrainingConfig:
    """Everything that decides what a training run gives, apart from the data.

    Attributes:
        epochs: passes over the training tasks.
        batch_size: tasks in one step.
        generator_lr: highest learning rate of the generator.
        map_discriminator_lr: highest learning rate of the map discriminator.
        point_discriminator_lr: highest learning rate of the point discriminator.
        beta1: decay of the optimisers' first moment.
        beta2: decay of the optimisers' second moment.
        weight_decay: decoupled decay (AdamW); with 0 the optimiser is plain Adam.
        clip_norm: gradients of the generator longer than this are shortened to it; 0 turns it off.
            Those of wavefronts are tens of times as long as usual now and then, and Adam takes
            hundreds of steps to recover from one.
        schedule: ``one-cycle`` (linear warm-up, then a half cosine to 0) or ``exponential``.
        warmup: share of the steps that the warm-up of ``one-cycle`` takes.
        decay: factor on the learning rates after each epoch of ``exponential``.
        plateau_patience: epochs without a better validation IoU after which the learning rates
            are lowered (on top of the schedule); 0 turns it off.
        plateau_factor: factor on the learning rates each time.
        widths: channels of the generator after each of its stages down, which halve the size.
        stem: channels of its map stem (the paper's has a point stem with as many).
        patch: side of the patches of pixels that its map stem reads as one place; with 1 it is the
            paper's generator, which reads pixels.
        noise_stem: channels of the noise stem of the paper's generator.
        metrics: of the wavefronts of a generator with patches; 0 for none.
        channel_attention: use channel attention (in all three networks).
        spatial_attention: use spatial attention (in all three networks).
        self_attention: use the self-attention of SAGAN (in all three networks).
        discriminator_width: channels of each input of a discriminator after its first layer.
        adversarial_every: train the discriminators, and the generator against them, in every
            n-th step; the other steps train the generator on the supervised losses alone.
        adversarial_weight: factor of each adversarial loss (alpha_1 = alpha_2 of the paper).
        adaptive_alpha: alpha of the paper's adaptive generator loss, in which the discriminator
            that errs more weighs more; 0 gives both the same weight.
        pixel_weight: factor of the pixel-wise squared error.
        bce_weight: factor of the binary cross-entropy.
        dice_weight: factor of the Dice loss.
        dice_smooth: smoothing term of the Dice loss.
        positive_weight: factor of the region's part of the binary cross-entropy; above 1 a missed
            place costs more than one too many.
        white_obstacles: a generator with patches paints obstacles white, and learns about free
            space alone.
        scales: each batch is scaled down by one of these factors at random, so that the networks
            learn to see coarse maps as well.
        symmetries: turn and mirror each task at random (8 symmetries of the square).
        reversal: exchange start and goal at random. Only for regions that do not depend on which
            is which: those of the paper's data set grew from one end, and there it costs
            0.04 of IoU.
        ema_decay: validate and export a moving average of the generator with this decay a step;
            0 turns it off.
        precision: of the networks' arithmetic: ``float32``, or ``bfloat16`` where that is faster
            (weights and losses stay float32).
        validation_fraction: share of the training tasks that is held back for validation.
        seed: seeds the weights, the split, the order, the augmentation and the noise.
    """

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
    widths: tuple[int, ...] = (32, 64, 96, 128)
    stem: int = 16
    patch: int = 1
    noise_stem: int = 32
    metrics: int = 0
    channel_attention: bool = True
    spatial_attention: bool = True
    self_attention: bool = False
    discriminator_width: int = 32
    adversarial_every: int = 6
    adversarial_weight: float = 0.05
    adaptive_alpha: float = 0.0
    pixel_weight: float = 20.0
    bce_weight: float = 1.0
    dice_weight: float = 10.0
    dice_smooth: float = 1.0
    positive_weight: float = 1.0
    white_obstacles: bool = False
    scales: tuple[int, ...] = (1,)
    symmetries: bool = True
    reversal: bool = False
    ema_decay: float = 0.998
    precision: str = "float32"
    validation_fraction: float = 0.05
    seed: int = 0

    def __post_init__(self) -> None:
        """Check the values.

        Raises:
            ConfigError: a value that makes no sense; the message names the option.
        """
        self._check_widths()
        for name, choices in (("schedule", SCHEDULES), ("precision", PRECISIONS)):
            if getattr(self, name) not in choices:
                raise ConfigError(
                    f"{name} is one of {', '.join(choices)}, got {getattr(self, name)!r}"
                )
        # Batch norm needs two tasks where the coarsest stage has one pixel.
        self._check("batch_size", self.batch_size >= 2, "at least 2")
        at_least_one = ("epochs", "discriminator_width", "adversarial_every")
        for name in (*at_least_one, "stem", "noise_stem", "patch"):
            self._check(name, getattr(self, name) >= 1, "at least 1")
        for name in ("metrics", "white_obstacles"):
            self._check(
                name, self.patch > 1 or not getattr(self, name), "left out where patch is 1"
            )
        for name in ("generator_lr", "map_discriminator_lr", "point_discriminator_lr"):
            self._check(name, getattr(self, name) > 0, "positive")
        for name in ("decay", "plateau_factor"):
            self._check(name, 0 < getattr(self, name) <= 1, "above 0 and at most 1")
        for name in ("beta1", "beta2", "warmup", "ema_decay"):
            self._check(name, 0 <= getattr(self, name) < 1, "at least 0 and below 1")
        self._check("validation_fraction", 0 < self.validation_fraction < 1, "between 0 and 1")
        for field in fields(self):
            if field.name.endswith(
                ("_weight", "_decay", "_smooth", "_norm", "_alpha", "_patience", "metrics", "seed")
            ):
                self._check(field.name, getattr(self, field.name) >= 0, "at least 0")
        self._check("seed", self.seed < 2**63, "below 2**63")
        self._check("scales", len(self.scales) > 0 and min(self.scales) >= 1, "at least 1")

    def _check_widths(self) -> None:
        if len(self.widths) < 3 or min(self.widths) < 1:
            raise ConfigError(f"widths are three or more positive numbers, got {self.widths}")
        # The queries of self-attention have an eighth of the channels.
        if self.self_attention and min(self.widths[1:]) < 8:
            raise ConfigError(
                "with self_attention all widths but the first must be at least 8, "
                f"got {self.widths}"
            )

    def _check(self, name: str, holds: bool, rule: str) -> None:
        if not holds:
            raise ConfigError(f"{name} must be {rule}, got {getattr(self, name)}")

    @classmethod
    def preset(cls, name: str) -> TrainingConfig:
        """One of :data:`PRESETS`.

        Raises:
            ConfigError: there is no preset of that name.
        """
        if name not in PRESETS:
            raise ConfigError(f"unknown preset {name!r}; choose one of {', '.join(PRESETS)}")
        return PRESETS[name]

    def with_network(self, name: str) -> TrainingConfig:
        """The same recipe for one of :data:`NETWORKS`.

        Raises:
            ConfigError: there is no network of that name.
        """
        if name not in NETWORKS:
            raise ConfigError(f"unknown network {name!r}; choose one of {', '.join(NETWORKS)}")
        return self.updated(NETWORKS[name])

    @classmethod
    def from_file(
        cls, path: str | PathLike[str], base: TrainingConfig | None = None
    ) -> TrainingConfig:
        """Read options from a JSON or YAML file; those it leaves out keep the values of ``base``.

        Raises:
            ConfigError: the file is missing, cannot be parsed, holds an unknown option, or a value
                of the wrong type or out of range.
        """
        try:
            values = yaml.safe_load(Path(path).read_text(encoding="utf-8"))
        except OSError as error:
            raise ConfigError(f"{path}: cannot read the file ({error.strerror})") from error
        except (yaml.YAMLError, UnicodeDecodeError) as error:
            raise ConfigError(f"{path}: neither JSON nor YAML ({error})") from error
        if not isinstance(values, dict):
            raise ConfigError(f"{path}: a configuration holds lines such as 'epochs: 20'")
        return (base or cls()).updated(values)

    def updated(self, values: Mapping[str, Any]) -> TrainingConfig:
        """A copy with some options changed.

        Raises:
            ConfigError: an unknown option, or a value of the wrong type or out of range.
        """
        known = asdict(self)
        for name in values:
            if name not in known:
                raise ConfigError(f"unknown option {name!r}; known are {', '.join(known)}")
        return replace(
            self, **{name: _as_type_of(known[name], name, value) for name, value in values.items()}
        )

    def to_dict(self) -> dict[str, Any]:
        """The options as JSON has them."""
        return {
            name: list(value) if isinstance(value, tuple) else value
            for name, value in asdict(self).items()
        }


def _as_type_of(default: Any, name: str, value: Any) -> Any:
    """The value in the type of the default; YAML reads 1e-4 as text, and 1 where 1.0 was meant."""
    if isinstance(default, tuple):
        if isinstance(value, list | tuple) and all(type(item) is int for item in value):
            return tuple(value)
    elif isinstance(default, float):
        try:
            if not isinstance(value, bool):
                return float(value)
        except (TypeError, ValueError):
            pass
    elif type(value) is type(default):
        return value
    kind = "list of integers" if isinstance(default, tuple) else type(default).__name__
    raise ConfigError(f"{name} must be a value of type {kind}, got {value!r}")


#: The networks that the paper compares: CBAGAN, its ablations with spatial attention, channel
#: attention or neither, and SAGAN, with widths that give its generator the paper's 1.24 million
#: parameters. The paper gives CBAGAN 0.88 million and no widths; the ones here give its generator,
#: which is all that a planner needs, 0.81 million, and the ablations a little less.
NETWORKS: dict[str, dict[str, Any]] = {
    "cbagan": {},
    "sa": {"channel_attention": False},
    "ca": {"spatial_attention": False},
    "none": {"channel_attention": False, "spatial_attention": False},
    "sagan": {
        "channel_attention": False,
        "spatial_attention": False,
        "self_attention": True,
        "widths": (36, 84, 112, 160),
    },
}

#: ``worlds`` is what the bundled model was trained with: for images of 256 pixels, drawn without
#: end. ``best`` is the best one for the paper's data. ``paper`` has the values of the paper's
#: tables. Where these and its text differ (50 epochs, momentum 0.9), the tables are followed;
#: ``alpha_1 = alpha_2 = 0.5`` is the text's, the table's 1 being for another loss, as are its
#: factors of an IoU loss and of a plain generator loss. The numbers that it leaves out (decay,
#: plateau) are PyTorch's defaults or this project's.
PRESETS: dict[str, TrainingConfig] = {
    "best": TrainingConfig(),
    "worlds": TrainingConfig(
        epochs=40,
        batch_size=16,
        warmup=0.05,
        clip_norm=2.0,
        widths=(32, 48, 64),
        patch=4,
        metrics=2,
        white_obstacles=True,
        adversarial_every=8,
        pixel_weight=4.0,
        dice_weight=2.0,
        positive_weight=3.5,
        scales=(1, 1, 1, 2),
        precision="bfloat16",
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
