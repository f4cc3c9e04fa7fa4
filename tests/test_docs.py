"""The code in the documentation runs, and its tables say what is so."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

DOCS = Path(__file__).resolve().parents[1] / "docs"
RECIPES = DOCS / "recipes"
PAGES = sorted(path.name for path in RECIPES.glob("*.md") if path.name != "index.md")


def python_blocks(page: Path) -> list[str]:
    text = page.read_text(encoding="utf-8")
    return re.findall(r"^```python\n(.*?)^```", text, re.MULTILINE | re.DOTALL)


def run(code: str, folder: Path) -> str:
    """Run code in a process of its own: an error in OMPL's C++ ends the process."""
    (folder / "page.py").write_text(code, encoding="utf-8")
    done = subprocess.run(
        [sys.executable, "-c", _RUN, str(RECIPES)],
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


# As a script would run, but with the folder of the helpers of the recipes to import from.
_RUN = "import runpy, sys; sys.path.insert(0, sys.argv[1]); runpy.run_path('page.py')"


def test_every_recipe_is_listed() -> None:
    index = (RECIPES / "index.md").read_text(encoding="utf-8")
    for name in PAGES:
        assert f"\n{name.removesuffix('.md')}\n" in index


@pytest.mark.parametrize("name", PAGES)
def test_recipe_runs(name: str, tmp_path: Path) -> None:
    pytest.importorskip("torch")
    blocks = python_blocks(RECIPES / name)
    assert blocks
    run("\n".join(blocks), tmp_path)


def test_getting_started_runs(tmp_path: Path) -> None:
    pytest.importorskip("torch")
    # The last block shows attach in a script of the reader's.
    blocks = python_blocks(DOCS / "getting-started.md")[:-1]
    assert "True" in run("\n".join(blocks), tmp_path)
