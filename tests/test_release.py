"""What a release says of itself in several files is the same everywhere."""

from __future__ import annotations

import json
import re
from pathlib import Path

import yaml

from cbagan_ompl import __version__

ROOT = Path(__file__).parents[1]


def test_version_and_date_agree() -> None:
    changelog = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    newest = re.search(r"^## \[?(\d[^\]\s]*)\]? - (\S+)$", changelog, re.MULTILINE)
    assert newest is not None
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    assert newest[1] == citation["version"] == __version__
    assert newest[2] == str(citation["date-released"])


def test_versions_of_the_changelog_fall() -> None:
    changelog = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    versions = re.findall(r"^## \[?(\d+)\.(\d+)\.(\d+)", changelog, re.MULTILINE)
    numbers = [tuple(map(int, version)) for version in versions]
    assert numbers == sorted(set(numbers), reverse=True)


def test_what_the_wheel_takes_from_outside_is_there() -> None:
    text = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    section = text.split("wheel.force-include]\n")[1].split("\n\n")[0]
    taken = dict(re.findall(r'^"(.+)" = "(.+)"$', section, re.MULTILINE))
    for source, target in taken.items():
        assert (ROOT / source).is_file(), source
        assert target == f"cbagan_ompl/{source}"
    default = json.loads((ROOT / "models" / "manifest.json").read_text())["default"]
    for model in (Path(default).stem, "cbagan"):
        assert {f"models/{model}.pt", f"models/{model}.md"} <= set(taken)
