"""What the README says is true."""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest
from helpers.scripts import run_script

from cbagan_ompl import GridMap, bundled_maps, reached_planners
from cbagan_ompl.cli import main
from cbagan_ompl.planning.compat import BOOST_PYTHON

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")


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
    length, hook, counts = done.stdout.splitlines()[-1].split(" ", 2)
    assert float(length) > 300
    assert hook == reached_planners()[planner]
    learned, uniform = (int(n) for n in re.findall(r"\d+", counts))
    # Before the first path the fraction of learned samples is bounded, and it may come late.
    assert learned > 0.4 * uniform > 0


@pytest.mark.slow
def test_own_map_example(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    monkeypatch.chdir(tmp_path)
    program, *words = shlex.split(block("own-map-command"))
    assert program == "cbagan-ompl"
    assert main(words) == 0
    assert (tmp_path / "office.png").is_file()
    (tmp_path / "script.py").write_text(block("own-map"))
    assert run_script(Path("script.py")).startswith("True ")


def test_is_short() -> None:
    assert len(README.split()) <= 1400


def spelled(name: str) -> str:
    """Return OMPL's name of a planner."""
    return name.replace("*", "star").replace(" ", "")


def test_bundled_maps_are_listed() -> None:
    for name in bundled_maps():
        assert f"`{name}`" in README


def test_links_lead_to_files() -> None:
    for link in re.findall(r"\]\(([^)#:]+)(?:#[^)]*)?\)", README):
        assert (ROOT / link).exists(), link
