"""Scripts of the repository, run as a user runs them."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path


def run_script(path: Path, *words: str) -> str:
    """Return what a script prints; it must succeed."""
    command = [sys.executable, str(path), *words]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout
