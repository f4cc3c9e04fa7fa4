"""The architecture of the networks as one frozen record; this module does not import torch.

The checks of option values live here too, since :mod:`cbagan_ompl.training.config` shares them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, replace
from math import isfinite
from typing import Any, NamedTuple

from ..errors import ConfigError, show

#: The networks that the CBAGAN-RRT paper (https://arxiv.org/abs/2305.10442) compares, as changes
#: of a :class:`NetworkConfig`: CBAGAN, its ablations with spatial attention, channel attention or
#: neither, and SAGAN, with widths that give its generator the paper's 1.24 million parameters. The
#: paper gives CBAGAN 0.88 million and no widths; the default widths give its generator, which is
#: all that a planner needs, 0.81 million, and the ablations a little less.
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

#: Height and width of the largest images that networks are trained on and applied to, in pixels.
MAX_IMAGE_SIZE = 1024

#: Most weights of the generator and the discriminators of a run together; the paper's have two
#: million. A checkpoint has up to six numbers for each.
MAX_WEIGHTS = 2**23

# Channels of a layer, and stages of a generator, which halve an image each.
_MAX_WIDTH, _MAX_STAGES = 4096, 10

# The queries of self-attention have an eighth of the channels of its input.
_MIN_SELF_ATTENTION_WIDTH = 8


class Rule(NamedTuple):
    """What the value of an option must satisfy.

    Attributes:
        holds: whether a value is allowed.
        text: completes the sentence "OPTION must be ..." of the error message.
    """

    holds: Callable[[Any], bool]
    text: str


AT_LEAST_0 = Rule(lambda value: value >= 0, "at least 0")


def between(least: int, most: int) -> Rule:
    """Return the rule of a whole number with both bounds."""
    return Rule(lambda value: least <= value <= most, f"at least {least} and at most {most}")


def check_types(config: Any, defaults: Mapping[str, Any]) -> None:
    """Raise if a value of a configuration is not of the type of its option.

    Args:
        config: has an attribute for each of the defaults.
        defaults: a value of the right type for each option.

    Raises:
        ConfigError: the message has the name of the option, the type and the value.
    """
    for name, default in defaults.items():
        value = getattr(config, name)
        if isinstance(value, str) != isinstance(default, str) or isinstance(value, list):
            raise _wrong_type(name, default, value)
        _convert(default, name, value)


def check_values(config: object, rules: Mapping[str, Rule]) -> None:
    """Raise if a value of a configuration breaks the rule of its option.

    Args:
        config: has an attribute for each of the rules.
        rules: by the name of the option.

    Raises:
        ConfigError: the message has the name of the option, the rule and the value.
    """
    for name, rule in rules.items():
        value = getattr(config, name)
        if not rule.holds(value):
            raise ConfigError(f"{name} must be {rule.text}, got {show(value)}")


def convert_values(defaults: Mapping[str, Any], values: Mapping[str, Any]) -> dict[str, Any]:
    """Return values in the types of their options.

    YAML reads 1e-4 as text, and 1 where 1.0 was meant; both become floats. JSON and YAML have
    lists, which become tuples.

    Args:
        defaults: a value of the right type for each option.
        values: by the name of the option; each must have a default.

    Raises:
        ConfigError: a value of the wrong type.

    Example:
        >>> convert_values({"widths": (1,), "rate": 0.1}, {"widths": [2, 3], "rate": "1e-4"})
        {'widths': (2, 3), 'rate': 0.0001}
    """
    return {name: _convert(defaults[name], name, value) for name, value in values.items()}


def _convert(default: Any, name: str, value: Any) -> Any:
    if isinstance(default, tuple):
        if isinstance(value, list | tuple) and all(type(item) is int for item in value):
            return tuple(value)
    elif isinstance(default, float):
        try:
            number = float(value)
        except Exception:  # whatever the class of the value raises
            number = float("nan")
        if isfinite(number) and not isinstance(value, bool):
            return number
    elif type(value) is type(default):
        return value
    raise _wrong_type(name, default, value)


def _wrong_type(name: str, default: Any, value: Any) -> ConfigError:
    kinds = {tuple: "list of integers", float: "finite float"}
    kind = kinds.get(type(default), type(default).__name__)
    return ConfigError(f"{name} must be a value of type {kind}, got {show(value)}")


@dataclass(frozen=True)
class NetworkConfig:
    """The architecture of the generator and of the two discriminators.

    Attributes:
        widths: channels of the generator after each of its stages down, which halve the size.
        stem: channels of its map stem (the paper's has a point stem with as many).
        patch: size of the square patches of pixels that its map stem reads at once; with 1 it is
            the paper's generator, which reads single pixels.
        noise_stem: channels of the noise stem of the paper's generator.
        cost_maps: learned cost maps of the wavefront of a generator with patches; 0 for no
            wavefront.
        passages: the generator learns costs of travel and finds the distances from start and goal
            exactly (:mod:`.passages`), and paints directions of travel; ``patch`` is 4.
        channel_attention: use channel attention (in all three networks).
        spatial_attention: use spatial attention (in all three networks).
        self_attention: use the self-attention of SAGAN (in all three networks).
        discriminator_width: channels of each input of a discriminator after its first layer.
        white_obstacles: a generator with patches paints obstacles white, and learns about free
            space alone.

    Raises:
        ConfigError: a value that makes no sense; the message names the option.

    Example:
        >>> NetworkConfig(patch=4, cost_maps=2).variant("sa").channel_attention
        False
    """

    widths: tuple[int, ...] = (32, 64, 96, 128)
    stem: int = 16
    patch: int = 1
    noise_stem: int = 32
    cost_maps: int = 0
    passages: bool = False
    channel_attention: bool = True
    spatial_attention: bool = True
    self_attention: bool = False
    discriminator_width: int = 32
    white_obstacles: bool = False

    def __post_init__(self) -> None:
        check_types(self, {field.name: field.default for field in fields(self)})
        least, text = (2, "two") if self.passages else (3, "three")
        if len(self.widths) < least or min(self.widths) < 1:
            raise ConfigError(
                f"widths are {text} or more positive numbers, got {show(self.widths)}"
            )
        if len(self.widths) > _MAX_STAGES or max(self.widths) > _MAX_WIDTH:
            raise ConfigError(
                f"widths are at most {_MAX_STAGES} numbers of at most {_MAX_WIDTH}, got "
                f"{show(self.widths)}"
            )
        if self.self_attention and min(self.widths[1:]) < _MIN_SELF_ATTENTION_WIDTH:
            raise ConfigError(
                "with self_attention all widths but the first must be at least "
                f"{_MIN_SELF_ATTENTION_WIDTH}, got {show(self.widths)}"
            )
        check_values(self, RULES)
        if self.patch == 1:
            check_values(self, _RULES_WITHOUT_PATCHES)
        if self.passages:
            check_values(self, _RULES_OF_PASSAGES)

    def variant(self, name: str) -> NetworkConfig:
        """Return this architecture with the changes of one of :data:`NETWORKS`.

        Raises:
            ConfigError: there is no network of that name.
        """
        if not isinstance(name, str) or name not in NETWORKS:
            raise ConfigError(f"unknown network {show(name)}; choose one of {', '.join(NETWORKS)}")
        return self.updated(NETWORKS[name])

    def updated(self, values: Mapping[str, Any]) -> NetworkConfig:
        """Return a copy with some options changed.

        Args:
            values: by the name of the option, all of them known.

        Raises:
            ConfigError: a value of the wrong type or out of range.
        """
        defaults = {field.name: getattr(self, field.name) for field in fields(self)}
        return replace(self, **convert_values(defaults, values))


#: The rule of each option that is a number.
RULES = {
    "stem": between(1, _MAX_WIDTH),
    "patch": between(1, 64),
    "noise_stem": between(1, _MAX_WIDTH),
    "cost_maps": between(0, 64),
    "discriminator_width": between(1, _MAX_WIDTH),
}

_LEFT_OUT = Rule(lambda value: not value, "left out where patch is 1")
_RULES_WITHOUT_PATCHES = {"cost_maps": _LEFT_OUT, "white_obstacles": _LEFT_OUT}
_RULES_OF_PASSAGES = {
    "patch": Rule(lambda value: value == 4, "4 with passages"),
    "cost_maps": Rule(lambda value: value == 0, "0 with passages, which have costs of their own"),
}
