"""How long the package takes to start: two checkouts next to each other.

    python scripts/startup_time.py ../main .

Each command runs in a process of its own, with this Python, from one checkout and then from the
other, so that both meet the same disturbances. Shown are medians, and the ratio of the second
checkout to the first.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
from pathlib import Path
from time import perf_counter

import numpy as np
from tqdm import trange

PLAN = ["-m", "cbagan_ompl.cli", "plan", "bundled:walls_with_gaps", "--range", "20"]
COMMANDS = {
    "import cbagan_ompl": ["-c", "import cbagan_ompl"],
    "import of the samplers": ["-c", "from cbagan_ompl import GridMap, Heatmap, attach"],
    "cbagan-ompl --help": ["-m", "cbagan_ompl.cli", "--help"],
    "plan, uniform": [*PLAN, "--sampler", "uniform", "--time", "0.05"],
    "plan, corridor": [*PLAN, "--sampler", "corridor", "--time", "0.05"],
    "plan, learned": [*PLAN, "--time", "0.05"],
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("first", type=Path, metavar="CHECKOUT", help="folder above cbagan_ompl/")
    parser.add_argument("second", type=Path, metavar="CHECKOUT")
    parser.add_argument("--runs", type=int, default=10, help="of each command (default: 10)")
    args = parser.parse_args()
    checkouts = (args.first.resolve(), args.second.resolve())
    for checkout in checkouts:
        if not (checkout / "cbagan_ompl" / "__init__.py").is_file():
            parser.error(f"there is no package cbagan_ompl in {checkout}")
    print(f"{'':24} {'first':>9} {'second':>9} {'ratio':>7}")
    for name, command in COMMANDS.items():
        seconds = measure(command, checkouts, args.runs)
        first, second = (float(np.median(values)) for values in seconds)
        print(f"{name:24} {first:8.3f}s {second:8.3f}s {second / first:7.2f}")


def measure(
    command: list[str], checkouts: tuple[Path, Path], runs: int
) -> tuple[list[float], list[float]]:
    """Return the seconds of each run with either checkout; the first round warms up."""
    seconds: tuple[list[float], list[float]] = ([], [])
    for number in trange(runs + 1, leave=False):
        for checkout, values in zip(checkouts, seconds, strict=True):
            took = start(command, checkout)
            if number > 0:
                values.append(took)
    return seconds


def start(command: list[str], checkout: Path) -> float:
    """Return how long a command takes with the package of a checkout, seconds."""
    environment = os.environ | {"PYTHONPATH": str(checkout)}
    began = perf_counter()
    done = subprocess.run(
        [sys.executable, *command], env=environment, capture_output=True, text=True, check=False
    )
    # 1 is the status of a plan without a path in time.
    if done.returncode not in (0, 1):
        raise RuntimeError(f"{command} fails in {checkout}: {done.stderr[-2000:]}")
    return perf_counter() - began


if __name__ == "__main__":
    main()
