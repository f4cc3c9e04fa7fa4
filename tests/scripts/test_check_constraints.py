"""The pins of ``constraints.txt`` hold for each version of Python that the README names."""

from __future__ import annotations

import re
from itertools import chain
from pathlib import Path

import pytest
from helpers.scripts import load_module
from packaging.requirements import Requirement

ROOT = Path(__file__).resolve().parents[2]
TEXT = (ROOT / "constraints.txt").read_text(encoding="utf-8")


SCRIPT = load_module(ROOT / "scripts" / "check_constraints.py")


def test_pins_of_a_version() -> None:
    text = (
        "# all\na==1 ; python_full_version < '3.11'\na==2 ; python_full_version >= '3.11'\nb==3\n"
    )
    text += "c==4 ; python_version == '3.12'\nd==5 ; sys_platform == 'win32'\n"
    for python, wanted in (
        ("3.10", ["a==1", "b==3"]),
        ("3.11.7", ["a==2", "b==3"]),
        ("3.12", ["a==2", "b==3", "c==4"]),
    ):
        assert list(map(str, SCRIPT.pins_for(python, text))) == wanted


@pytest.mark.parametrize("python", [*SCRIPT.PYTHONS, "3.11.7", "3.13.9"])
def test_each_version_has_one_pin_of_all_that_is_required(python: str) -> None:
    tomllib = pytest.importorskip("tomllib")
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    pins = [(pin.name.lower(), str(pin.specifier)) for pin in SCRIPT.pins_for(python, TEXT)]
    versions = {name: specifier.removeprefix("==") for name, specifier in pins}
    assert len(versions) == len(pins), "each once"
    wanted = [project["dependencies"], *project["optional-dependencies"].values()]
    for requirement in map(Requirement, chain.from_iterable(wanted)):
        # OMPL is chosen on the command line.
        if requirement.name not in ("ompl", "cbagan-ompl"):
            version = versions[requirement.name.lower()]
            assert requirement.specifier.contains(version), requirement


def test_the_documentation_names_the_versions() -> None:
    page = (ROOT / "docs" / "getting-started.md").read_text(encoding="utf-8")
    table = page.partition("| Python | `ompl==1.7.0` | `ompl==2.0.1` |")[2].partition("\n\n")[0]
    rows = re.findall(r"^\| ([\d., ]+) \| (yes|no) \| (yes|no) \|$", table, re.MULTILINE)
    for column, ompl in ((1, "1.7.0"), (2, "2.0.1")):
        named = [name for row in rows if row[column] == "yes" for name in row[0].split(", ")]
        assert tuple(named) == SCRIPT.OMPL[ompl]
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    assert f"Python {SCRIPT.PYTHONS[0]} to {SCRIPT.PYTHONS[-1]}" in readme
    assert f"for Python {SCRIPT.PYTHONS[0]} to {SCRIPT.PYTHONS[-1]}" in TEXT
