"""A command that is interrupted as by Ctrl-C in a terminal."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable

# Only against hanging: a busy machine may take long.
_PATIENCE_S = 300


def interrupted(words: list[str], ready: Callable[[], bool]) -> tuple[int, str]:
    """Exit status of a command and what it wrote to stderr.

    A terminal sends the interrupt to all processes of the command. Tests need the fixture
    ``interruptible``.

    Args:
        words: of the command line.
        ready: whether the command is where it is to be interrupted.
    """
    process = subprocess.Popen(
        [sys.executable, "-m", "cbagan_ompl.cli", *words],
        stderr=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        text=True,
        start_new_session=True,
    )
    try:
        end = time.monotonic() + _PATIENCE_S
        while not ready() and process.poll() is None and time.monotonic() < end:
            time.sleep(0.02)
        assert process.poll() is None, process.communicate()[1]
        os.killpg(process.pid, signal.SIGINT)
        _, said = process.communicate(timeout=_PATIENCE_S)
        return process.returncode, said
    finally:
        if process.poll() is None:
            os.killpg(process.pid, signal.SIGKILL)
