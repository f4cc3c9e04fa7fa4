from __future__ import annotations

import json
from dataclasses import fields
from pathlib import Path
from typing import Any

import pytest
from helpers.tiny_model import TINY

from cbagan_ompl import ConfigError
from cbagan_ompl.networks.config import RULES as NETWORK_RULES
from cbagan_ompl.networks.config import NetworkConfig, Rule
from cbagan_ompl.training.config import RULES, TrainingConfig


def test_paper_preset_is_the_papers_table() -> None:
    paper = TrainingConfig.preset("paper")
    assert (paper.epochs, paper.batch_size, paper.generator_lr) == (20, 8, 1e-4)
    assert paper.map_discriminator_lr == paper.point_discriminator_lr == 5e-5
    assert (paper.beta1, paper.beta2, paper.schedule) == (0.5, 0.999, "exponential")


@pytest.mark.parametrize("suffix", [".json", ".yaml"])
def test_config_file_round_trip(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"recipe{suffix}"
    path.write_text(json.dumps(TINY.to_dict()))
    assert TrainingConfig.from_file(path) == TINY


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("epochs: 0", "epochs must be at least 1"),
        ("epoch: 3", "unknown option 'epoch'"),
        ("epochs: many", "epochs must be a value of type int"),
        ("epochs: true", "epochs must be"),
        ("widths: [4, 4]", "widths are three or more"),
        ("schedule: none", "one-cycle, exponential"),
        ("precision: float64", "float32, bfloat16"),
        ("plateau_factor: 2", "plateau_factor must be above 0"),
        ("generator_lr: fast", "generator_lr"),
        ("beta1: .nan", "beta1"),
        ("seed: -1", "seed must be at least 0"),
        ("seed: 99999999999999999999", r"seed must be .* below 2\*\*63"),
        ("{self_attention: true, widths: [8, 8, 7, 8]}", "all widths but the first .* least 8"),
        ("[1, 2]", "holds lines such as"),
        ("a: [", "no valid YAML"),
    ],
)
def test_bad_config_files(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "recipe.yaml"
    path.write_text(text)
    with pytest.raises(ConfigError, match=message):
        TrainingConfig.from_file(path)


def test_unreadable_config_and_unknown_preset(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="cannot read"):
        TrainingConfig.from_file(tmp_path / "none.yaml")
    with pytest.raises(ConfigError, match="best, synthetic, paper"):
        TrainingConfig.preset("worst")


def test_numbers_that_yaml_reads_as_text() -> None:
    assert TrainingConfig().updated({"generator_lr": "1e-4"}).generator_lr == 1e-4


def test_options_of_both_records_have_flat_names() -> None:
    names = [field.name for kind in (NetworkConfig, TrainingConfig) for field in fields(kind)]
    names.remove("network")
    assert len(set(names)) == len(names), "no name occurs twice"
    assert list(TINY.to_dict()) == names
    config = TINY.updated({"stem": 7, "epochs": 3})
    assert (config.network.stem, config.epochs) == (7, 3)
    assert TrainingConfig().updated(config.to_dict()) == config
    with pytest.raises(ConfigError, match="unknown option 'network'"):
        TINY.updated({"network": {"stem": 7}})


def test_assignments() -> None:
    config = TINY.with_assignments(["widths=[8, 8, 9]", "generator_lr=1e-4", "scales=[1,2]"])
    assert config.network.widths == (8, 8, 9)
    assert (config.generator_lr, config.scales) == (1e-4, (1, 2))
    assert TINY.with_assignments([]) == TINY


@pytest.mark.parametrize(
    ("assignment", "message"),
    [
        ("epochs", "--set takes KEY=VALUE, got 'epochs'"),
        ("widths=[", r"--set 'widths=\[': no valid YAML"),
        ("epoch=1", "unknown option 'epoch'"),
        ("positive_weight=-0.5", "positive_weight must be at least 0"),
    ],
)
def test_bad_assignments(assignment: str, message: str) -> None:
    with pytest.raises(ConfigError, match=message):
        TINY.with_assignments([assignment])


def test_a_recipe_for_another_network() -> None:
    config = TINY.with_network("sa")
    assert not config.network.channel_attention
    assert config.updated({"channel_attention": True}) == TINY


@pytest.mark.parametrize(
    ("kind", "rules"), [(NetworkConfig, NETWORK_RULES), (TrainingConfig, RULES)]
)
def test_every_number_has_a_rule(kind: type[Any], rules: dict[str, Rule]) -> None:
    numbers = {option.name for option in fields(kind) if option.type in ("int", "float")}
    assert numbers <= rules.keys()
