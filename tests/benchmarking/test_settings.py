from __future__ import annotations

from pathlib import Path

import pytest

from cbagan_ompl import ConfigError
from cbagan_ompl.benchmarking.settings import Settings, parse_parameters
from cbagan_ompl.sampling.options import SamplerOptions


def test_parameters_from_texts() -> None:
    assert parse_parameters(["RRT.goal_bias=0.1", "RRTstar.k_nearest=false", "RRT.range=3"]) == {
        "RRT": {"goal_bias": 0.1, "range": 3},
        "RRTstar": {"k_nearest": False},
    }


@pytest.mark.parametrize("text", ["RRT", "RRT.range", "range=1", ".range=1", "RRT.=1"])
def test_parameters_of_another_form(text: str) -> None:
    with pytest.raises(ConfigError, match=r"PLANNER\.parameter=value"):
        parse_parameters([text])


def test_settings_are_compared_with_saved_ones(tmp_path: Path) -> None:
    settings = Settings(parameters={"RRT": {"range": 3}}, heatmap_dirs={"peer": "folder"})
    settings.save(tmp_path / "settings.json")
    assert settings.is_saved_in(tmp_path / "settings.json")
    assert not Settings(sampler_options=SamplerOptions(seed=1)).is_saved_in(
        tmp_path / "settings.json"
    )
