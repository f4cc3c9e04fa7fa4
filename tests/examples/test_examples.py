"""The scripts in examples/ run, each on its own, and print what they say they do."""

from __future__ import annotations

import importlib.util
import subprocess
import sys
from pathlib import Path

import pytest

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
# What each prints, and the files that it leaves in the working directory.
EXPECTED = {
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


def test_the_map_of_the_examples_is_what_its_script_draws(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    data = EXAMPLES / "data"
    spec = importlib.util.spec_from_file_location("make_office", data / "make_office.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    monkeypatch.setattr(module, "HERE", tmp_path)
    module.main()
    for name in ("office.pgm", "office.yaml"):
        assert (tmp_path / name).read_bytes() == (data / name).read_bytes()
