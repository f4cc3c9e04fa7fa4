"""The command ``cbagan-ompl``, and ``python -m cbagan_ompl.cli``."""

from __future__ import annotations

import atexit
import os
import sys
from types import FrameType

from ..common.signals import handle_endings, raise_once


def run() -> None:
    """Run the command line as a process of its own, which Ctrl-C and SIGTERM may end any time."""
    handle_endings(_end_at_once)
    from . import INTERRUPTED, TERMINATED, execute, parse

    args = parse()  # loads what the commands need: nothing is open yet, nothing to clean up
    handle_endings(raise_once)
    status = execute(args)
    handle_endings(_end_at_once)
    try:
        sys.stdout.flush()
    except OSError as error:  # a full disk behind "> file"
        print(f"cbagan-ompl: cannot write the output: {error.strerror}", file=sys.stderr)
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        status = status or 2
    if status in (INTERRUPTED, TERMINATED):
        # The interpreter would take a second and more to free what torch has loaded.
        atexit._run_exitfuncs()
        os._exit(status)
    sys.exit(status)


def _end_at_once(number: int, _: FrameType | None) -> None:
    os.write(2, b"interrupted\n")
    os._exit(128 + number)


if __name__ == "__main__":
    run()
