from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np
import pytest

from cbagan_ompl import ConfigError
from cbagan_ompl.benchmarking.sampler_variants import parse_sampler
from cbagan_ompl.benchmarking.settings import Settings, parse_parameters
from cbagan_ompl.sampling.options import NO_ADAPTATION, Adaptation, HeadingSpread, SamplerOptions


def test_parameters_from_texts() -> None:
    assert parse_parameters(["RRT.goal_bias=0.1", "RRTstar.k_nearest=false", "RRT.range=3"]) == {
        "RRT": {"goal_bias": 0.1, "range": 3},
        "RRTstar": {"k_nearest": False},
    }


@pytest.mark.parametrize("text", ["RRT", "RRT.range", "range=1", ".range=1", "RRT.=1"])
def test_parameters_of_another_form(text: str) -> None:
    with pytest.raises(ConfigError, match=r"PLANNER\.parameter=value"):
        parse_parameters([text])


def test_saved_settings_have_flat_keys() -> None:
    options = SamplerOptions(0.2, 2.0, Adaptation.of(["coverage"]), 7)
    assert Settings(sampler_options=options, time=1.0).to_dict() == {
        "planners": ["RRT", "RRTstar", "InformedRRTstar"],
        "samplers": ["uniform", "learned", "corridor"],
        "runs": 5,
        "time": 1.0,
        "range": None,
        "parameters": {},
        "uniform_fraction": 0.2,
        "adaptation": ["coverage"],
        "sharpness": 2.0,
        "seed": 7,
        "heading": asdict(HeadingSpread()),
        "models": {},
        "heatmap_dirs": {},
        "robot": {
            "shape": "point",
            "radius": 0.0,
            "corners": [],
            "turning_radius": None,
            "reverse": False,
        },
        "simplify": [],
        "within": 5,
    }


@pytest.mark.parametrize("seed", [None, np.random.default_rng(0)])
def test_the_seed_of_a_benchmark_is_an_int(seed: Any) -> None:
    with pytest.raises(ConfigError, match="must be an int"):
        Settings(sampler_options=SamplerOptions(seed=seed))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"runs": 10**18}, "5000 that a task may have"),
        ({"runs": 2.5}, "runs is a whole number"),
        ({"runs": "3"}, "runs is a whole number"),
        ({"time": 1e300}, "at most 86400 s"),
        ({"time": float("nan")}, "above 0"),
        ({"time": float("inf")}, "above 0"),
        ({"time": 10**400}, "above 0"),
        ({"within": 10**9}, "at most 10000"),
        ({"range": float("inf")}, "range must be above 0"),
        ({"samplers": ("uniform", "a\nb")}, "name of a sampler"),
        ({"samplers": ("uniform", "_a")}, "name of a sampler"),
        ({"samplers": ("uniform", "")}, "name of a sampler"),
        ({"samplers": ("uniform", "a" * 81)}, "name of a sampler"),
        ({"samplers": ("uniform", "a\udcff")}, "name of a sampler"),
        ({"planners": ("RRT",) * 2}, "each once"),
    ],
)
def test_absurd_settings(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(ConfigError, match=message):
        Settings(**changes)


@pytest.mark.parametrize(
    "value",
    [".nan", ".inf", "1e400", "[1]", "{a: 1}", "2020-01-01", "&a [*a]", "!!int ''", "9" * 5000],
)
def test_values_of_parameters_are_numbers_truth_values_or_words(value: str) -> None:
    if value == "1e400":  # a word in YAML 1.1
        assert parse_parameters([f"RRT.range={value}"]) == {"RRT": {"range": "1e400"}}
        return
    with pytest.raises(ConfigError, match=r"--set 'RRT\.range'") as caught:
        parse_parameters([f"RRT.range={value}"])
    assert len(str(caught.value)) < 1000


def test_samplers_may_change_options() -> None:
    settings = Settings(samplers=("uniform", "learned", "learned:adaptation=none", "flat"))
    assert settings.sources == {"uniform", "learned", "flat"}
    variant = settings.variants()[2]
    assert (variant.name, variant.source) == ("learned:adaptation=none", "learned")
    assert variant.changes == (("adaptation", NO_ADAPTATION),)


@pytest.mark.parametrize(
    "text",
    [
        *("learned:", "learned:adaptation", "learned:adaptation=magic", "learned:seed=1"),
        *("learned:sharpness=x", "learned:uniform_fraction=0", "learned:sharpness=1:sharpness=2"),
    ],
)
def test_options_of_samplers_that_make_no_sense(text: str) -> None:
    with pytest.raises(ConfigError, match="sampler 'learned"):
        parse_sampler(text)
