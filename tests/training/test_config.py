from __future__ import annotations

import json
from dataclasses import fields
from pathlib import Path
from typing import Any

import pytest
import yaml
from helpers.fuzzing import mutations, read_all
from helpers.tiny_model import TINY

from cbagan_ompl import ConfigError
from cbagan_ompl.networks.config import RULES as NETWORK_RULES
from cbagan_ompl.networks.config import NetworkConfig, Rule
from cbagan_ompl.training.config import PRESETS, RULES, TrainingConfig


def test_paper_preset_is_the_papers_table() -> None:
    """All options, so that none can change unseen; docs/training.md explains those not given."""
    of_the_paper = {
        "epochs": 20,
        "batch_size": 8,
        "generator_lr": 1e-4,
        "map_discriminator_lr": 5e-5,
        "point_discriminator_lr": 5e-5,
        "beta1": 0.5,
        "beta2": 0.999,
        "weight_decay": 1e-4,
        "schedule": "exponential",
        "adversarial_every": 1,
        "adversarial_weight": 0.5,
        "pixel_weight": 20.0,
        "bce_weight": 1.0,
        "dice_weight": 10.0,
        "dice_smooth": 1.0,
        "stem": 16,
        "noise_stem": 32,
        "discriminator_width": 32,
        "patch": 1,
        "channel_attention": True,
        "spatial_attention": True,
        "self_attention": False,
    }
    not_given = {
        "widths": [32, 64, 96, 128],
        "decay": 0.95,
        "plateau_patience": 10,
        "plateau_factor": 0.1,
        "symmetries": True,
        "validation_fraction": 0.05,
        "seed": 0,
    }
    not_used = {
        "warmup": 0.1,
        "clip_norm": 0.0,
        "adaptive_alpha": 0.0,
        "positive_weight": 1.0,
        "scales": [1],
        "reversal": False,
        "ema_decay": 0.0,
        "precision": "float32",
        "cost_maps": 0,
        "passages": False,
        "white_obstacles": False,
        "direction_weight": 1.0,
    }
    assert TrainingConfig.preset("paper").to_dict() == of_the_paper | not_given | not_used


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
    with pytest.raises(ConfigError, match="best, synthetic, refine, paper"):
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


@pytest.mark.parametrize(
    "values",
    [
        {"epochs": 10**30},
        {"batch_size": 10**12},
        {"widths": [10**9] * 3},
        {"widths": [4] * 100},
        {"scales": [2**40]},
        {"stem": 10**6},
        {"seed": 2**63},
        {"generator_lr": float("inf")},
        {"generator_lr": float("nan")},
        {"generator_lr": 10**400},
        {"clip_norm": "1e999"},
        {"epochs": -1},
        {"epochs": True},
        {"precision": ["float32"]},
        {7: 1},
    ],
)
def test_values_beyond_all_bounds(values: dict[Any, Any]) -> None:
    with pytest.raises(ConfigError):
        TrainingConfig().updated(values)
    if 7 not in values:
        network = {name: value for name, value in values.items() if name in ("widths", "stem")}
        with pytest.raises(ConfigError):
            NetworkConfig(**network) if network else TrainingConfig(**values)


def test_damaged_files_and_odd_values(tmp_path: Path) -> None:
    path = tmp_path / "recipe.yaml"

    def from_file(data: bytes) -> None:
        path.write_bytes(data)
        TrainingConfig.from_file(path)

    valid = [yaml.safe_dump(preset.to_dict()).encode() for preset in PRESETS.values()]
    short = b"epochs: 3\nwidths: [4, 4, 8]\n"
    read_all(from_file, mutations([*valid, short, short], 200, seed=1))

    def set_value(text: bytes) -> None:
        for name in ("epochs", "widths", "clip_norm", "schedule", "symmetries", "none"):
            TrainingConfig().with_assignments([f"{name}={text.decode()}"])

    read_all(set_value, (text.encode() for text in _ODD_YAML))


_ODD_YAML = (
    '!!int ""',
    "!!timestamp x",
    "2001-13-01",
    "&a [*a]",
    "9" * 5000,
    "1" + "0" * 400,
    "[" * 500,
    "!!python/object/apply:os.system [x]",
    "!!binary x",
    '"\\ud800"',
    "\x00",
    "{1: {2: 3}}",
    "<<: x",
    ".nan",
    "-.inf",
    "1e999",
    "~",
    "yes",
    "!!set {a}",
    "? [a]",
    "1:2:3",
    "[1, [2]]",
    "-1",
)
