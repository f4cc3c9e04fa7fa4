"""Whether every pin of ``constraints.txt`` has a wheel, for each version of Python and of OMPL.

    python scripts/check_constraints.py

No interpreter but this one is needed: pip is asked what it would install for another one. As it
looks at its own version for markers (``; python_full_version < '3.11'``), they are resolved here.
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

from packaging.markers import default_environment
from packaging.requirements import Requirement

ROOT = Path(__file__).parents[1]

# That the package is for, and those of them that a version of OMPL has wheels for.
PYTHONS = ("3.10", "3.11", "3.12", "3.13")
OMPL = {"1.7.0": PYTHONS[:-1], "2.0.1": PYTHONS}

# What a pip on Linux of today takes.
_PLATFORMS = (
    *(f"manylinux_2_{minor}_x86_64" for minor in range(5, 40)),
    *(f"manylinux{name}_x86_64" for name in ("1", "2010", "2014")),
)


def pins_for(python: str, text: str) -> Iterator[Requirement]:
    """Yield the pins that hold for a version of Python on Linux.

    Args:
        python: such as "3.10" or "3.11.7"; without a third number the first release.
        text: of the file of constraints.
    """
    full = python if python.count(".") == 2 else f"{python}.0"
    environment = {
        **default_environment(),
        "python_version": ".".join(full.split(".")[:2]),
        "python_full_version": full,
        "implementation_version": full,
    }
    for line in text.splitlines():
        pin = line.partition("#")[0].strip()
        if pin:
            requirement = Requirement(pin)
            if requirement.marker is None or requirement.marker.evaluate(environment):
                requirement.marker = None
                yield requirement


def main() -> None:
    text = (ROOT / "constraints.txt").read_text(encoding="utf-8")
    failed = False
    for ompl, pythons in OMPL.items():
        for python in pythons:
            pins = [*map(str, pins_for(python, text)), f"ompl=={ompl}"]
            done = _resolve(python, pins)
            print(f"Python {python}, OMPL {ompl}: {len(pins)} pins, ", end="")
            print("all there" if done.returncode == 0 else done.stderr.strip())
            failed = failed or done.returncode != 0
    sys.exit(int(failed))


def _resolve(python: str, pins: list[str]) -> subprocess.CompletedProcess[str]:
    words = ["install", "--dry-run", "--ignore-installed", "--no-deps", "--only-binary=:all:"]
    words += [word for platform in _PLATFORMS for word in ("--platform", platform)]
    words += ["--implementation", "cp", "--python-version", python]
    for abi in ("none", "abi3", f"cp{python.replace('.', '')}"):
        words += ["--abi", abi]
    with TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "pip", *words, "--target", folder, *pins]
        return subprocess.run(command, capture_output=True, text=True, check=False)


if __name__ == "__main__":
    main()
