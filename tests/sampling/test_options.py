"""The options of sampling: what is taken, what is an error, and how they are handed on."""

from __future__ import annotations

from dataclasses import FrozenInstanceError
from math import inf, nan
from typing import Any

import numpy as np
import pytest

from cbagan_ompl import Adaptation, ConfigError, SamplerOptions
from cbagan_ompl.sampling.options import (
    ADAPTATION_RULES,
    DEFAULT_UNIFORM_FRACTION,
    FULL_ADAPTATION,
    NO_ADAPTATION,
    HeadingSpread,
)


def test_defaults() -> None:
    options = SamplerOptions()
    assert options == SamplerOptions(
        DEFAULT_UNIFORM_FRACTION, None, FULL_ADAPTATION, None, HeadingSpread()
    )
    assert 0 < options.uniform_fraction < 1
    assert options.adaptation == Adaptation(True, True, True)


def test_options_are_values() -> None:
    options = SamplerOptions(seed=1)
    assert options == SamplerOptions(seed=1) != SamplerOptions(seed=2)
    with pytest.raises(FrozenInstanceError):
        options.seed = 2  # type: ignore[misc]


@pytest.mark.parametrize("value", [1e-6, 0.1, 1, 1.0, np.float32(0.5)])
def test_uniform_fractions(value: float) -> None:
    assert SamplerOptions(uniform_fraction=value).uniform_fraction == value


@pytest.mark.parametrize(
    ("name", "value"),
    [
        *(("uniform_fraction", value) for value in (0, -0.1, 1.01, nan, inf, "0.1", None, 1j)),
        *(("sharpness", value) for value in (0, -1, nan, inf, "3", 1j)),
        *(("adaptation", value) for value in (None, True, "none", "coverage", ["coverage"])),
    ],
)
def test_values_that_make_no_sense(name: str, value: Any) -> None:
    with pytest.raises(ConfigError, match=name):
        SamplerOptions(**{name: value})
    with pytest.raises(ConfigError, match=name):
        SamplerOptions.of(None, {name: value})


def test_zero_is_explained() -> None:
    with pytest.raises(ConfigError, match=r"it cannot be 0, because .* probabilistic completeness"):
        SamplerOptions(uniform_fraction=0)


def test_changes_of_options() -> None:
    options = SamplerOptions(uniform_fraction=0.2, seed=1)
    assert SamplerOptions.of(options, {}) == options
    assert SamplerOptions.of(options, {"seed": 3}) == SamplerOptions(0.2, seed=3)
    assert SamplerOptions.of(None, {"sharpness": 2}) == SamplerOptions(sharpness=2)
    assert options.seed == 1
    with pytest.raises(ConfigError, match=r"unknown sampler option 'sharpnes'.*sharpness"):
        SamplerOptions.of(options, {"sharpnes": 2})
    with pytest.raises(ConfigError, match="options are SamplerOptions"):
        SamplerOptions.of({"seed": 1}, {})  # type: ignore[arg-type]


def test_generators_of_seeds() -> None:
    first, again = (SamplerOptions(seed=5).generator().random(3) for _ in range(2))
    np.testing.assert_array_equal(first, again)
    generator = np.random.default_rng(0)
    assert SamplerOptions(seed=generator).generator() is generator
    fresh, other = (SamplerOptions().generator().random() for _ in range(2))
    assert fresh != other


def test_rules_by_name() -> None:
    assert ADAPTATION_RULES == ("connectivity", "coverage", "stagnation")
    assert Adaptation.of(ADAPTATION_RULES) == FULL_ADAPTATION == Adaptation()
    assert Adaptation.of([]) == NO_ADAPTATION
    for count in range(4):
        names = ADAPTATION_RULES[:count]
        assert Adaptation.of(reversed(names)).names == names


def test_unknown_rules() -> None:
    with pytest.raises(ConfigError, match=r"'hope'.*connectivity, coverage, stagnation"):
        Adaptation.of(["connectivity", "hope"])
