"""What the README says is true."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest

from cbagan_ompl import GridMap, bundled_maps, reached_planners
from cbagan_ompl.planning.compat import BOOST_PYTHON, HAS_STATE_SAMPLER_ALLOCATOR

README = (Path(__file__).parents[1] / "README.md").read_text(encoding="utf-8")


def block(marker: str) -> str:
    found = re.search(rf"<!-- {marker} -->\n```\w+\n(.*?)```", README, re.DOTALL)
    assert found is not None
    return found[1]


@pytest.mark.parametrize("planner", ["RRTstar", "RRT", "InformedRRTstar"])
def test_drop_in_example(tmp_path: Path, planner: str) -> None:
    script = block("drop-in").replace("og.RRTstar(", f"og.{planner}(")
    if BOOST_PYTHON:  # as the README says
        script = script.replace("space.allocState()", "ob.State(space)")
        script = script.replace("Checker(is_valid)", "Checker(ob.StateValidityCheckerFn(is_valid))")
    grid = GridMap.load("bundled:walls_with_gaps")
    cv2.imwrite(str(tmp_path / "map.png"), grid.free.astype(np.uint8) * 255)
    (tmp_path / "script.py").write_text(script)
    done = subprocess.run(
        [sys.executable, "script.py"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    length, hook, draws = done.stdout.splitlines()[-1].split(" ", 2)
    assert float(length) > 300
    assert hook == reached_planners()[planner]
    learned, uniform = (int(n) for n in re.findall(r"\d+", draws))
    assert learned > 5 * uniform > 0


def test_table_of_hooks() -> None:
    column = 2 if HAS_STATE_SAMPLER_ALLOCATOR else 1
    said = {}
    section = README.split("## Which planners are reached")[1].split("\n## ")[0]
    for row in re.findall(r"^\| ([\w*, ]+) \| ([^|]+) \| ([^|]+) \|$", section, re.M):
        for name in row[0].split(", "):
            said[spelled(name)] = row[column].split(",")[0].replace(" sampler", "-sampler")
    hooks = {name: hook.replace(" ", "-") for name, hook in said.items()}
    reached = {n: h for n, h in hooks.items() if h.endswith(("sampler", "injection"))}
    assert reached == reached_planners()


def spelled(name: str) -> str:
    return name.replace("*", "star").replace(" ", "")


def test_bundled_maps_are_listed() -> None:
    for name in bundled_maps():
        assert f"`{name}`" in README
