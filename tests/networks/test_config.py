from __future__ import annotations

import subprocess
import sys

import pytest

from cbagan_ompl import ConfigError
from cbagan_ompl.networks.config import NETWORKS, NetworkConfig

PATCHES = NetworkConfig(patch=4, cost_maps=3, white_obstacles=True)


@pytest.mark.parametrize(
    ("option", "value"),
    [("patch", 0), ("stem", 0), ("noise_stem", 0), ("discriminator_width", 0), ("cost_maps", -1)],
)
def test_options_that_make_no_sense(option: str, value: float) -> None:
    with pytest.raises(ConfigError, match=f"{option} must be at least"):
        PATCHES.updated({option: value})


@pytest.mark.parametrize("option", [{"cost_maps": 1}, {"white_obstacles": True}])
def test_options_of_patches_need_patches(option: dict[str, object]) -> None:
    with pytest.raises(ConfigError, match=f"{next(iter(option))} must be left out where patch is"):
        NetworkConfig().updated(option)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"widths": [4, 4]}, "widths are three or more"),
        ({"widths": [4, 4, 0]}, "widths are three or more"),
        ({"widths": [4, 4, 4.5]}, "widths must be a value of type list of integers"),
        ({"stem": True}, "stem must be a value of type int"),
        ({"self_attention": True, "widths": [8, 8, 7, 8]}, "all widths but the first .* least 8"),
    ],
)
def test_values_that_make_no_sense(values: dict[str, object], message: str) -> None:
    with pytest.raises(ConfigError, match=message):
        NetworkConfig().updated(values)


def test_an_unknown_network() -> None:
    assert len(NETWORKS) == 5
    with pytest.raises(ConfigError, match=r"'unet'.*cbagan, sa, ca, none, sagan"):
        NetworkConfig().variant("unet")


def test_the_defaults_are_the_papers_generator() -> None:
    config = NetworkConfig()
    assert (config.stem, config.patch, config.cost_maps) == (16, 1, 0)
    assert not config.white_obstacles


def test_configurations_do_not_import_torch() -> None:
    code = (
        "import sys, cbagan_ompl.networks.config, cbagan_ompl.training.config;"
        "sys.exit('torch' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
