"""The options of heat-map sampling: one frozen value that every layer hands on whole."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields, replace
from math import pi
from typing import Any

import numpy as np

from ..common.validation import check_seed, random_generator, to_float, truth_value
from ..errors import ConfigError, show

#: Least uniform fraction: with less, no run would ever see a uniform sample.
LEAST_UNIFORM_FRACTION = 1e-6

#: Largest sharpness: beyond it only the largest values of the heat map would count, as with it.
LARGEST_SHARPNESS = 1e6

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

    def __post_init__(self) -> None:
        for field in fields(self):
            truth_value(field.name, getattr(self, field.name))

    @classmethod
    def of(cls, names: Iterable[str]) -> Adaptation:
        """Return the adaptation with some of its rules on and the others off.

        Args:
            names: of the rules, see :data:`ADAPTATION_RULES`; none switches all of them off.

        Raises:
            ConfigError: an unknown name, or one text in place of several names.
        """
        try:
            chosen = None if isinstance(names, str) else list(names)
        except Exception:  # whatever the class of the value raises
            chosen = None
        if chosen is None:
            raise ConfigError(
                f"the rules of an adaptation are a list of names, such as ['coverage'], got "
                f"{show(names)}"
            )
        unknown = [n for n in chosen if not (isinstance(n, str) and n in ADAPTATION_RULES)]
        if unknown:
            raise ConfigError(
                f"unknown adaptation {', '.join(map(show, unknown))}; there are "
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
class HeadingSpread:
    """How the headings of samples spread around the heading of the heat map.

    Attributes:
        spread: standard deviation of the heading, radians, above 0 and at most pi.
        uniform_fraction: fraction of the samples whose heading is uniform, from
            :data:`LEAST_UNIFORM_FRACTION` to 1. It is never 0, so that the planner stays
            probabilistically complete; with 1 the headings of the heat map are not used at all.
        reverse_fraction: fraction of the other samples whose heading is turned by pi, from 0 to 1,
            for robots that drive backwards as well (ReedsSheppStateSpace).
        approach_fraction: fraction of a planner's samples, from 0 to 1, once its tree is within
            two ranges of the goal and before its first path, that are poses from which the goal is
            reached in one motion, where goal injection reaches the planner. None if all headings
            are uniform.

    Raises:
        ConfigError: a value of the wrong type or out of range; the message names the option.

    Example:
        >>> HeadingSpread(spread=0.2).uniform_fraction
        0.2
    """

    spread: float = 0.4
    uniform_fraction: float = 0.2
    reverse_fraction: float = 0.2
    approach_fraction: float = 0.25

    def __post_init__(self) -> None:
        given = [getattr(self, field.name) for field in fields(self)]
        spread, uniform, reverse, approach = map(to_float, given)
        if not 0 < spread <= pi:
            raise ConfigError(
                "the spread of headings is a number of radians above 0, at most pi, got "
                f"{show(self.spread)}"
            )
        if not LEAST_UNIFORM_FRACTION <= uniform <= 1:
            raise ConfigError(
                "the uniform_fraction of headings is a fraction from "
                f"{LEAST_UNIFORM_FRACTION:g} to 1, got {show(self.uniform_fraction)}; it cannot be "
                "0, because the planner would lose probabilistic completeness"
            )
        for name, fraction in (("reverse_fraction", reverse), ("approach_fraction", approach)):
            if not 0 <= fraction <= 1:
                raise ConfigError(
                    f"the {name} of headings is a fraction from 0 to 1, got "
                    f"{show(getattr(self, name))}"
                )
        for field, value in zip(fields(self), (spread, uniform, reverse, approach), strict=True):
            object.__setattr__(self, field.name, value)


@dataclass(frozen=True)
class SamplerOptions:
    """How samples follow a heat map.

    Attributes:
        uniform_fraction: fraction of the samples that stays uniform over free space, from
            :data:`LEAST_UNIFORM_FRACTION` to 1. It is never 0, so that the planner stays
            probabilistically complete.
        sharpness: exponent of the heat map: the density of the learned samples is proportional to
            ``values ** sharpness``. It is above 0 and at most :data:`LARGEST_SHARPNESS`. With None
            the planner decides, see :func:`cbagan_ompl.attach`.
        adaptation: how the mixture follows the planner's tree, see :class:`Adaptation`.
        seed: an int of at least 0, or a generator; the same seed gives the same samples.
        heading: how the headings of poses follow those of the heat map, see :class:`HeadingSpread`.

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
    heading: HeadingSpread = HeadingSpread()

    def __post_init__(self) -> None:
        fraction = to_float(self.uniform_fraction)
        if not LEAST_UNIFORM_FRACTION <= fraction <= 1:
            raise ConfigError(
                f"uniform_fraction is a fraction from {LEAST_UNIFORM_FRACTION:g} to 1, got "
                f"{show(self.uniform_fraction)}; it cannot be 0, because the planner would lose "
                "probabilistic completeness"
            )
        sharpness = None if self.sharpness is None else to_float(self.sharpness)
        if sharpness is not None and not 0 < sharpness <= LARGEST_SHARPNESS:
            raise ConfigError(
                f"sharpness is a finite number above 0, got {show(self.sharpness)}; at most "
                f"{LARGEST_SHARPNESS:g}, or None where the planner is to decide"
            )
        if not isinstance(self.adaptation, Adaptation):
            raise ConfigError(
                f"adaptation is an Adaptation, got {show(self.adaptation)}; write "
                "Adaptation.of([]) for none, Adaptation.of(['coverage']) for single rules"
            )
        if not isinstance(self.heading, HeadingSpread):
            raise ConfigError(
                f"heading is a HeadingSpread, got {show(self.heading)}; write "
                "HeadingSpread(spread=0.4) for one, HeadingSpread(uniform_fraction=1) for uniform "
                "headings"
            )
        # Any kind of real number is a float from here on, and any whole number an int.
        object.__setattr__(self, "uniform_fraction", fraction)
        object.__setattr__(self, "sharpness", sharpness)
        object.__setattr__(self, "seed", check_seed(self.seed))

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
            raise ConfigError(f"options are SamplerOptions(...), got {show(options)}")
        known = [field.name for field in fields(cls)]
        for name in changes:
            if name not in known:
                raise ConfigError(
                    f"unknown sampler option {show(name)}; known are {', '.join(known)}"
                )
        return replace(options or cls(), **changes)

    def generator(self) -> np.random.Generator:
        """Return the generator of the seed: a new one for an int, itself for a generator."""
        return random_generator(self.seed)
