"""The code in the documentation runs, and its tables say what is so."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

from cbagan_ompl import reached_planners
from cbagan_ompl.planning.compat import HAS_STATE_SAMPLER_ALLOCATOR

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


@pytest.mark.slow
@pytest.mark.parametrize("name", PAGES)
def test_recipe_runs(name: str, tmp_path: Path) -> None:
    pytest.importorskip("torch")
    blocks = python_blocks(RECIPES / name)
    assert blocks
    run("\n".join(blocks), tmp_path)


@pytest.mark.slow
def test_getting_started_runs(tmp_path: Path) -> None:
    pytest.importorskip("torch")
    # The last block shows attach in a script of the reader's.
    blocks = python_blocks(DOCS / "getting-started.md")[:-1]
    assert "True" in run("\n".join(blocks), tmp_path)


def test_table_of_hooks() -> None:
    column = 2 if HAS_STATE_SAMPLER_ALLOCATOR else 1
    page = (DOCS / "planners.md").read_text(encoding="utf-8")
    section = page.split("## Which planner is reached how")[1].split("\n## ")[0]
    hooks = {}
    for row in re.findall(r"^\| ([\w*, ]+) \| ([^|]+) \| ([^|]+) \|$", section, re.MULTILINE):
        hook = row[column].replace(" sampler", "-sampler").replace(" ", "-")
        for name in row[0].split(", "):
            hooks[name.replace("*", "star").replace(" ", "")] = hook
    reached = {n: h for n, h in hooks.items() if h.endswith(("sampler", "injection"))}
    assert reached == reached_planners()


def test_every_included_table_is_there() -> None:
    for page in (DOCS / "results").glob("*.md"):
        for name in re.findall(r"\{include\} (\S+)", page.read_text(encoding="utf-8")):
            assert (page.parent / name).is_file(), name


def test_figure_of_the_layers_has_every_package() -> None:
    figure = (DOCS / "images" / "layers.svg").read_text(encoding="utf-8")
    names = re.findall(r"font-weight='bold'[^>]*>(\w+)<", figure)
    package = DOCS.parent / "cbagan_ompl"
    modules = {p.stem for p in package.iterdir() if p.is_dir() or p.suffix == ".py"}
    assert set(names) == {name for name in modules if not name.startswith("_")}
