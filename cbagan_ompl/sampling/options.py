"""The options of heat-map sampling: one frozen value that every layer hands on whole."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields, replace
from math import isfinite
from typing import Any, SupportsFloat

import numpy as np

from ..errors import ConfigError

#: Fraction of the samples that stays uniform over free space unless the user asks otherwise.
DEFAULT_UNIFORM_FRACTION = 0.1

#: Exponent of the heat map for planners that go on to the shortest path. Those that stop at their
#: first path are served best by the heat map as it is.
OPTIMIZING_SHARPNESS = 3.0


@dataclass(frozen=True)
class Adaptation:
    """Which rules adapt the mixture of learned and uniform samples to the planner's tree.

    Attributes:
        connectivity: sample less from a heat map whose region does not connect start and goal.
        coverage: before the first path, sample the heat map only where the tree is not yet.
        stagnation: before the first path, sample the heat map less while that brings nothing.

    Example:
        >>> Adaptation.of(["coverage"])
        Adaptation(connectivity=False, coverage=True, stagnation=False)
    """

    connectivity: bool = True
    coverage: bool = True
    stagnation: bool = True

    @classmethod
    def of(cls, names: Iterable[str]) -> Adaptation:
        """Return the adaptation with some of its rules on and the others off.

        Args:
            names: of the rules, see :data:`ADAPTATION_RULES`; none switches all of them off.

        Raises:
            ConfigError: an unknown name.
        """
        chosen = set(names)
        unknown = sorted(chosen - set(ADAPTATION_RULES))
        if unknown:
            raise ConfigError(
                f"unknown adaptation {', '.join(unknown)!r}; there are "
                f"{', '.join(ADAPTATION_RULES)}"
            )
        return cls(**{name: name in chosen for name in ADAPTATION_RULES})

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the rules that are on."""
        return tuple(name for name in ADAPTATION_RULES if getattr(self, name))


#: The names of the rules of :class:`Adaptation`.
ADAPTATION_RULES = tuple(field.name for field in fields(Adaptation))
#: Every rule on: what :func:`cbagan_ompl.attach` does by default.
FULL_ADAPTATION = Adaptation()
#: Every rule off: the uniform fraction stays what was asked for.
NO_ADAPTATION = Adaptation.of(())


@dataclass(frozen=True)
class SamplerOptions:
    """How samples follow a heat map.

    Attributes:
        uniform_fraction: fraction of the samples that stays uniform over free space, in (0, 1]. It
            is never 0, so that the planner stays probabilistically complete.
        sharpness: exponent of the heat map: the density of the learned samples is proportional to
            ``values ** sharpness``. With None the planner decides, see :func:`cbagan_ompl.attach`.
        adaptation: how the mixture follows the planner's tree, see :class:`Adaptation`.
        seed: an int of at least 0, or a generator; the same seed gives the same samples.

    Raises:
        ConfigError: a value of the wrong type or out of range; the message names the option.

    Example:
        >>> SamplerOptions(uniform_fraction=0.2, seed=1).sharpness is None
        True
    """

    uniform_fraction: float = DEFAULT_UNIFORM_FRACTION
    sharpness: float | None = None
    adaptation: Adaptation = FULL_ADAPTATION
    seed: int | np.random.Generator | None = None

    def __post_init__(self) -> None:
        if not (
            isinstance(self.uniform_fraction, SupportsFloat) and 0 < self.uniform_fraction <= 1
        ):
            raise ConfigError(
                "uniform_fraction is a fraction above 0 and up to 1, got "
                f"{self.uniform_fraction!r}; it cannot be 0, because the planner would lose "
                "probabilistic completeness"
            )
        if self.sharpness is not None and not (
            isinstance(self.sharpness, SupportsFloat)
            and isfinite(self.sharpness)
            and self.sharpness > 0
        ):
            raise ConfigError(f"sharpness is a finite number above 0, got {self.sharpness!r}")
        if not isinstance(self.adaptation, Adaptation):
            raise ConfigError(
                f"adaptation is an Adaptation, such as Adaptation.of(['coverage']), got "
                f"{self.adaptation!r}"
            )

    @classmethod
    def of(cls, options: SamplerOptions | None, changes: Mapping[str, Any]) -> SamplerOptions:
        """Return options with some of their values changed.

        Args:
            options: to begin with; the defaults for None.
            changes: value by name of option.

        Raises:
            ConfigError: an unknown option, or a value that makes no sense.
        """
        if not isinstance(options, cls | None):
            raise ConfigError(f"options are SamplerOptions(...), got {options!r}")
        known = [field.name for field in fields(cls)]
        for name in changes:
            if name not in known:
                raise ConfigError(f"unknown sampler option {name!r}; known are {', '.join(known)}")
        return replace(options or cls(), **changes)

    def generator(self) -> np.random.Generator:
        """Return the generator of the seed: a new one for an int, itself for a generator."""
        return np.random.default_rng(self.seed)
