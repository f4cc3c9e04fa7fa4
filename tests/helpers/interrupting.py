"""A command that is interrupted as by Ctrl-C in a terminal, or ended by SIGTERM."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

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


def ended(words: list[str], ready: Callable[[], bool], number: int) -> tuple[int, str]:
    """Exit status of a command and what it wrote to stderr; fails if a process of it stays.

    Ctrl-C goes to all of its processes, other signals to the command alone, as ``kill`` does it.

    Args:
        words: of the command line.
        ready: whether the command is where it is to be ended.
        number: of the signal.
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
        # Before that a signal finds Python's own start, not the command.
        while not catches(process.pid, signal.SIGTERM) and process.poll() is None:
            time.sleep(0.02)
        while not ready() and process.poll() is None and time.monotonic() < end:
            time.sleep(0.02)
        assert process.poll() is None, process.communicate()[1]
        (os.killpg if number == signal.SIGINT else os.kill)(process.pid, number)
        _, said = process.communicate(timeout=_PATIENCE_S)
        end = time.monotonic() + 2
        while (left := processes_of(process.pid)) and time.monotonic() < end:
            time.sleep(0.02)
        assert not left, f"{left} of {words} stay"
        return process.returncode, said
    finally:
        for pid in processes_of(process.pid):
            os.kill(pid, signal.SIGKILL)


def catches(pid: int, number: int) -> bool:
    """Return whether a process has a handler for a signal, from /proc."""
    try:
        status = Path(f"/proc/{pid}/status").read_text()
    except OSError:  # has ended
        return False
    caught = next(line.split()[1] for line in status.splitlines() if line.startswith("SigCgt"))
    return bool(int(caught, 16) >> (number - 1) & 1)


def after(delay: float) -> Callable[[], bool]:
    """Return what is true some seconds after it is asked first."""
    times: list[float] = []

    def is_past() -> bool:
        times.append(time.monotonic())
        return times[-1] > times[0] + delay

    return is_past


def processes_of(session: int) -> list[int]:
    """Processes of a session that run, from /proc."""
    found = []
    for path in Path("/proc").glob("[0-9]*/stat"):
        try:
            state, _, _, its_session = path.read_text().rpartition(")")[2].split()[:4]
        except OSError:  # has ended meanwhile
            continue
        if int(its_session) == session and state not in "ZX":
            found.append(int(path.parent.name))
    return found
