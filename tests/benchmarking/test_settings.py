from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cbagan_ompl import ConfigError
from cbagan_ompl.benchmarking.settings import Settings, parse_parameters
from cbagan_ompl.sampling.options import Adaptation, SamplerOptions


def test_parameters_from_texts() -> None:
    assert parse_parameters(["RRT.goal_bias=0.1", "RRTstar.k_nearest=false", "RRT.range=3"]) == {
        "RRT": {"goal_bias": 0.1, "range": 3},
        "RRTstar": {"k_nearest": False},
    }


@pytest.mark.parametrize("text", ["RRT", "RRT.range", "range=1", ".range=1", "RRT.=1"])
def test_parameters_of_another_form(text: str) -> None:
    with pytest.raises(ConfigError, match=r"PLANNER\.parameter=value"):
        parse_parameters([text])


def test_saved_settings_have_flat_keys(tmp_path: Path) -> None:
    options = SamplerOptions(0.2, 2.0, Adaptation.of(["coverage"]), 7)
    Settings(sampler_options=options, time=1.0).save(tmp_path / "settings.json")
    assert json.loads((tmp_path / "settings.json").read_text()) == {
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
        "models": {},
        "heatmap_dirs": {},
        "radius": 0.0,
        "within": 5,
    }


@pytest.mark.parametrize("seed", [None, np.random.default_rng(0)])
def test_the_seed_of_a_benchmark_is_an_int(seed: Any) -> None:
    with pytest.raises(ConfigError, match="must be an int"):
        Settings(sampler_options=SamplerOptions(seed=seed))


def test_settings_are_compared_with_saved_ones(tmp_path: Path) -> None:
    settings = Settings(parameters={"RRT": {"range": 3}}, heatmap_dirs={"peer": "folder"})
    settings.save(tmp_path / "settings.json")
    assert settings.is_saved_in(tmp_path / "settings.json")
    other = Settings(sampler_options=SamplerOptions(seed=1))
    assert not other.is_saved_in(tmp_path / "settings.json")
