"""The code in the documentation runs, and its tables say what is so."""

from __future__ import annotations

import ast
import json
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

import cbagan_ompl
from cbagan_ompl import reached_control_planners, reached_planners
from cbagan_ompl.cli import main
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


# What makes a documented benchmark quick, as options that come after its own.
QUICK = "--planners RRT --simplify RRT --samplers uniform,corridor --runs 1 --time 0.05"
QUICK += " --tasks-per-map 1 --jobs 1"


# The same for the steps of a training: the first two words of a command, or the first.
QUICK_STEPS = {
    "dataset generate": "--maps 4 --tasks 3 --copies 2 --size 64 --jobs 1 --generators clutter",
    "dataset label": "--tasks 8 --size 64",
    "train": "--epochs 1 --set batch_size=4",
    "plan": "--time 0.2 --planner RRT",
}


@pytest.mark.slow
@pytest.mark.parametrize("number", [0, 1])
def test_trainings_run(number: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("torch")
    page = (DOCS / "training.md").read_text(encoding="utf-8")
    blocks = [block.split("```")[0] for block in page.split("```sh\n")[1:]]
    commands = [block for block in blocks if "evaluate" in block][number].splitlines()
    (tmp_path / "examples").symlink_to(DOCS.parent / "examples")
    map_file = tmp_path / "site.yaml"
    map_file.write_text((DOCS.parent / "examples/data/office.yaml").read_text())
    image = yaml.safe_load(map_file.read_text())["image"]
    shutil.copy(DOCS.parent / "examples" / "data" / image, tmp_path)
    monkeypatch.chdir(tmp_path)
    for command in commands:
        program, *words = shlex.split(command)
        assert program == "cbagan-ompl"
        step = " ".join(words[:2]) if words[0] == "dataset" else words[0]
        quick = shlex.split(QUICK_STEPS.get(step, ""))
        if step == "train" and "--start-from" not in words:
            quick += ["widths=[4,4,6,8]", "discriminator_width=4"]
        assert main([*words, *quick]) == 0, command


@pytest.mark.slow
def test_commands_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("torch")
    page = (DOCS / "command-line.md").read_text(encoding="utf-8")
    block = page.split("```sh\n")[1].split("```")[0]
    commands = [line for line in block.splitlines() if not line.startswith("#")]
    assert len(commands) >= 5
    for folder in ("examples", "benchmarks"):
        (tmp_path / folder).symlink_to(DOCS.parent / folder)
    monkeypatch.chdir(tmp_path)
    for command in commands:
        program, *words = shlex.split(command)
        assert program == "cbagan-ompl"
        quick = shlex.split(QUICK) if words[0] == "benchmark" else []
        # No path in time is the fault of a busy machine, not of the page.
        assert main([*words, *quick]) in ((0, 1) if words[0] == "plan" else (0,)), command


def test_every_documented_plan_on_the_office_is_one_task() -> None:
    """That of the examples: what is copied from any page then runs."""
    pages = [DOCS.parent / "README.md", *DOCS.rglob("*.md"), *(DOCS.parent / "examples").glob("*")]
    found = [
        line
        for page in pages
        if page.suffix in (".md", ".py")
        for line in page.read_text(encoding="utf-8").splitlines()
        if "cbagan-ompl plan" in line and "office" in line
    ]
    assert len(found) >= 4
    for line in found:
        assert "plan examples/data/office.yaml --start -1.2,6.2 --goal 9,0" in line


def test_quoted_messages_are_those_of_the_package() -> None:
    templates = message_templates()
    page = (DOCS / "troubleshooting.md").read_text(encoding="utf-8")
    quotes = re.findall(r"^`([^`]+ [^`]+)`$", page, re.MULTILINE)
    ours = [quote for quote in quotes if not quote.startswith("nanobind:")]
    assert len(ours) >= 5
    for quote in ours:
        name, colon, text = quote.partition(": ")
        if colon and name.isidentifier():
            assert hasattr(cbagan_ompl, name)
            quote = text
        quote = quote.removesuffix(" ...")
        assert any(begins(template, quote) for template in templates), quote


def message_templates() -> list[list[str | None]]:
    """Return the texts of the package in parts; None stands for a value."""
    found: list[list[str | None]] = []
    for path in (DOCS.parent / "cbagan_ompl").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.JoinedStr):
                parts = (getattr(part, "value", None) for part in node.values)
                found.append([part if isinstance(part, str) else None for part in parts])
    return found


def begins(template: list[str | None], text: str) -> bool:
    """Return whether a message begins with a text; a value stands for a word or less."""
    if not text or not template:
        return not text
    part, *rest = template
    if part is None:
        return any(begins(rest, text[k:]) for k in range(1, len(text.split(" ")[0]) + 1))
    length = min(len(part), len(text))
    return part[:length] == text[:length] and begins(rest, text[length:])


def test_table_of_hooks() -> None:
    column = 2 if HAS_STATE_SAMPLER_ALLOCATOR else 1
    page = (DOCS / "planners.md").read_text(encoding="utf-8")
    section = page.split("## Which planner is reached how")[1].split("\n## ")[0]
    hooks = {}
    for row in re.findall(r"^\| ([\w*., ]+) \| ([^|]+) \| ([^|]+) \|$", section, re.MULTILINE):
        hook = row[column].split(",")[0].replace(" sampler", "-sampler").replace(" ", "-")
        for name in row[0].split(", "):
            hooks[name.replace("*", "star").replace(" ", "")] = hook
    reached = {n: h for n, h in hooks.items() if h.endswith(("sampler", "injection", "steering"))}
    assert reached == reached_planners() | reached_control_planners()


def test_figures_of_replanning_are_those_of_the_result_files() -> None:
    results = DOCS.parent / "benchmarks" / "results"
    scenes = [
        json.loads((results / f"replanning_{maps}.json").read_text())[scene]
        for maps in ("bundled", "real_maps")
        for scene in ("static", "obstacles")
    ]
    text = " ".join((RECIPES / "replanning.md").read_text(encoding="utf-8").split())
    for variant, sentence in (
        ("kept", r"cycle: ([\d.]+) to ([\d.]+) ms in the median"),
        ("fresh", r"prediction takes ([\d.]+) to ([\d.]+) ms"),
    ):
        (said,) = re.findall(sentence, text)
        medians = [scene[variant]["median_ms"] for scene in scenes]
        assert said == (f"{min(medians):.1f}", f"{max(medians):.1f}")
    (said,) = re.findall(r"take (\d+) ms or more, with the `Replanner` (\d+) to (\d+) ms", text)
    uniform, kept = ([scene[of]["p95_ms"] for scene in scenes] for of in ("uniform", "kept"))
    assert said == (f"{int(min(uniform))}", f"{min(kept):.0f}", f"{max(kept):.0f}")
    assert all(scene["uniform"]["median_ms"] < scene["kept"]["median_ms"] for scene in scenes)


def test_every_included_table_is_there() -> None:
    for page in [*(DOCS / "results").glob("*.md"), *RECIPES.glob("*.md")]:
        for name in re.findall(r"\{include\} (\S+)", page.read_text(encoding="utf-8")):
            assert (page.parent / name).is_file(), name


def test_figure_of_the_layers_has_every_package() -> None:
    figure = (DOCS / "images" / "layers.svg").read_text(encoding="utf-8")
    names = re.findall(r"font-weight='bold'[^>]*>(\w+)<", figure)
    package = DOCS.parent / "cbagan_ompl"
    modules = {p.stem for p in package.iterdir() if p.is_dir() or p.suffix == ".py"}
    assert set(names) == {name for name in modules if not name.startswith("_")}
