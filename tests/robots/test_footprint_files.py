"""Footprints from text and files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cbagan_ompl import Robot, RobotError
from cbagan_ompl.robots.footprint_files import load_footprint, parse_footprint

POINTS = [[0.4, 0.3], [0.4, -0.3], [-0.4, -0.3], [-0.4, 0.3]]
NAV2 = f"""
local_costmap:
  local_costmap:
    ros__parameters:
      robot_base_frame: base_link
      footprint: "{POINTS}"
global_costmap:
  global_costmap:
    ros__parameters:
      footprint: "{POINTS}"
"""


@pytest.mark.parametrize(
    "text",
    [
        str(POINTS),
        f'"{POINTS}"',
        f"footprint: {POINTS}",
        f'footprint: "{POINTS}"',
        NAV2,
        "footprint: [[4e-1, 0.3], [0.4, -3e-1], [-0.4, -0.3], [-0.4, 0.3]]",
        "- [0.4, 0.3]\n- [0.4, -0.3]\n- [-0.4, -0.3]\n- [-0.4, 0.3]\n",
    ],
)
def test_lists_of_points(tmp_path: Path, text: str) -> None:
    path = tmp_path / "robot.yaml"
    path.write_text(text)
    assert load_footprint(path, 1.5, True) == Robot.polygon(POINTS, 1.5, True)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "no footprint"),
        ("robot_radius: 0.2", "no footprint"),
        ("footprint: 3", "list of points"),
        ("footprint: []", "list of points"),
        ("footprint: [[0, 0], [1, 0]]", "at least three"),
        ("footprint: [[0, 0], [1, 0], [.nan, 1]]", "finite"),
        ("footprint: [[0, 0], [1], [0, 1]]", "list of points"),
        ("footprint: [[0, 0], [1, a], [0, 1]]", "list of points"),
        ("footprint: [[false, false], [true, false], [true, true]]", "list of points"),
        ('footprint: "[[0, 0], [1, 0]"', "no valid YAML"),
        ("a: {footprint: [[0, 0], [1, 0], [0, 1]]}\nb: {footprint: []}", "differ"),
        ("&a [*a]", "aliases"),
        ("footprint: [[0, 0], [2, 2], [2, 0], [0, 1]]", "crosses"),
    ],
)
def test_files_without_a_footprint(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "robot.yaml"
    path.write_text(text)
    with pytest.raises(RobotError, match=message) as caught:
        load_footprint(path)
    assert "robot.yaml" in str(caught.value)


def test_a_drawing(tmp_path: Path) -> None:
    path = tmp_path / "car.svg"
    path.write_text('<svg><g transform="translate(5)"><path d="m 1,1 4,0 0,2 -4,0 z"/></g></svg>')
    robot = load_footprint(path)
    assert robot.vertices is not None
    assert np.allclose(sorted(robot.vertices.tolist()), [(-2, -1), (-2, 1), (2, -1), (2, 1)])
    path.write_text('<svg><path d="m 1,1 4,0 0,2 z"/><path d="m 1,1 4,0 0,2 z"/></svg>')
    with pytest.raises(RobotError, match="one path"):
        load_footprint(path)


@pytest.mark.parametrize("text", ["4.5x1.8", " 4.5 X 1.8", "4.5×1.8"])  # noqa: RUF001
def test_sizes(text: str) -> None:
    assert parse_footprint(text, 5.0) == Robot.rectangle(4.5, 1.8, 5.0)


@pytest.mark.parametrize("text", ["", "4.5", "4.5x", "0x1", "-4x2", "1e999x2", "4-5x1", "car.png"])
def test_texts_that_are_no_footprint(text: str) -> None:
    with pytest.raises(RobotError):
        parse_footprint(text)
    with pytest.raises(RobotError):
        load_footprint(3)  # type: ignore[arg-type]
