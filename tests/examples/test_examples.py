"""The scripts in examples/ run, each on its own, and print what they say they do."""

from __future__ import annotations

import importlib.util
import json
import subprocess
import sys
from math import pi
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from helpers.scripts import load_module

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
# What each prints, and the files that it leaves in the working directory.
EXPECTED = {
    "control_kinematic_car.py": ("exact: True", ()),
    "control_second_order_car.py": ("exact: True", ()),
    "nav_msgs_node.py": ("no ROS here", ()),
    "own_heatmap.py": ("connects start and goal: True", ()),
    "plain_ompl_script.py": ("hook: goal-injection", ()),
    "plan_a_path.py": ("way points:", ("plan_a_path.png",)),
    "ros_map.py": ("middle of the unknown area is free: False", ("ros_map.png",)),
    "se2.py": ("yaw", ()),
    "train_on_own_maps.py": ("planned with it: solved", ()),
}
WITHOUT_TORCH = {"own_heatmap.py"}


def test_all_examples_are_tested() -> None:
    assert sorted(EXPECTED) == sorted(path.name for path in EXAMPLES.glob("*.py"))


@pytest.mark.slow
@pytest.mark.parametrize("name", EXPECTED)
def test_example_runs(name: str, tmp_path: Path) -> None:
    if name not in WITHOUT_TORCH and importlib.util.find_spec("torch") is None:
        pytest.skip("needs torch")
    expected, files = EXPECTED[name]
    done = subprocess.run(
        [sys.executable, str(EXAMPLES / name)],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert expected in done.stdout
    assert "Traceback" not in done.stderr
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(files)


def test_messages_of_ros_are_translated_without_ros() -> None:
    node = load_module(EXAMPLES / "nav_msgs_node.py")
    message = node.fake_grid()
    # A map that is turned by a right angle: its x axis points up.
    message.info.origin.orientation.z = message.info.origin.orientation.w = 0.5**0.5
    grid = node.grid_of(message)
    assert grid.shape == (80, 120)
    assert grid.resolution == 0.05
    np.testing.assert_allclose(grid.origin, (-1, -1, pi / 2))
    assert not grid.is_free((-1 - 10 * 0.05, -1 + 60 * 0.05)), "the wall"
    assert grid.is_free((-1 - 70 * 0.05, -1 + 60 * 0.05)), "the gap"
    assert not grid.is_free((-1 - 79.5 * 0.05, -1 + 10 * 0.05)), "unknown"

    path = node.path_message(np.array([(0, 0), (1, 1), (1, 3)]), "odom")
    assert path["header"] == {"frame_id": "odom"}
    poses = [stamped["pose"] for stamped in path["poses"]]
    assert [(p["position"]["x"], p["position"]["y"]) for p in poses] == [(0, 0), (1, 1), (1, 3)]
    headings = [node.yaw_of(SimpleNamespace(**p["orientation"])) for p in poses]
    np.testing.assert_allclose(headings, (pi / 4, pi / 2, pi / 2))
    (pose,) = node.path_message(np.array([(1, 2, -3.0)]))["poses"]
    assert node.yaw_of(SimpleNamespace(**pose["pose"]["orientation"])) == pytest.approx(-3)
    json.dumps(path)
    assert node.path_message(np.empty((0, 2)))["poses"] == []


def test_the_map_of_the_examples_is_what_its_script_draws(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    data = EXAMPLES / "data"
    module = load_module(data / "make_office.py")
    monkeypatch.setattr(module, "HERE", tmp_path)
    module.main()
    for name in ("office.pgm", "office.yaml"):
        assert (tmp_path / name).read_bytes() == (data / name).read_bytes()
