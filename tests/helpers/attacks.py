"""Commands that are given crafted files: what they say, cost, and leave behind."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Sequence
from typing import NamedTuple

# Loads what commands need first, so that it is not counted. A peak is reset by writing 5 (Linux).
_SCRIPT = """
import contextlib, importlib, io, json, re, resource, sys, time
commands, modules = json.loads(sys.argv[1])
for module in ("cbagan_ompl.cli", "cbagan_ompl.maps.grid_map", *modules):
    importlib.import_module(module)
from cbagan_ompl.cli import main
resource.setrlimit(resource.RLIMIT_AS, (2**34, 2**34))

def memory(kind):
    with open("/proc/self/status") as file:
        return int(re.search(kind + r":\\s+(\\d+)", file.read())[1]) / 1000

for words in commands:
    with open("/proc/self/clear_refs", "w") as file:
        file.write("5")
    before, start = memory("VmRSS"), time.process_time()
    said = io.StringIO()
    with contextlib.redirect_stderr(said), contextlib.redirect_stdout(io.StringIO()):
        status = main(words)
    seconds = time.process_time() - start
    print(json.dumps([status, said.getvalue(), seconds, memory("VmHWM") - before]), flush=True)
"""


class Outcome(NamedTuple):
    """What a command did: exit status, standard error, seconds of CPU, MB above the start."""

    status: int
    said: str
    seconds: float
    megabytes: float


def run_commands(commands: Sequence[Sequence[str]], modules: Sequence[str] = ()) -> list[Outcome]:
    """Run command lines one after the other in a process of their own.

    Args:
        commands: the words of each.
        modules: to load before, so that they do not count.
    """
    done = subprocess.run(
        [sys.executable, "-c", _SCRIPT, json.dumps([list(map(list, commands)), list(modules)])],
        capture_output=True,
        text=True,
        timeout=60 + 20 * len(commands),
    )
    assert done.returncode == 0, done.stderr[-2000:]
    return [Outcome(*json.loads(line)) for line in done.stdout.splitlines()]


def assert_refused(outcome: Outcome, seconds: float = 2.0, megabytes: float = 200.0) -> None:
    """Assert that a command ended with bad input, said in brief, at little cost."""
    assert outcome.status == 2, outcome
    assert len(outcome.said) < 1000, outcome
    assert "Traceback" not in outcome.said, outcome
    assert outcome.seconds < seconds, outcome
    assert outcome.megabytes < megabytes, outcome
