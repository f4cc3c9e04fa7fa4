"""The command ``cbagan-ompl``, and ``python -m cbagan_ompl.cli``."""

from __future__ import annotations

import os
import sys
from types import FrameType

from ..common.signals import Terminated, handle_endings, raise_once
from . import INTERRUPTED, TERMINATED, load_commands, main


def run() -> None:
    """Run the command line as a process of its own, which Ctrl-C and SIGTERM may end any time."""
    handle_endings(_end_at_once)
    load_commands()  # nothing is open yet, nothing to clean up
    handle_endings(raise_once)
    try:
        status = main()
    except KeyboardInterrupt as error:  # while the command line was parsed
        status = TERMINATED if isinstance(error, Terminated) else INTERRUPTED
    handle_endings(_end_at_once)
    try:
        sys.stdout.flush()
    except OSError as error:  # a full disk behind "> file"
        print(f"cbagan-ompl: cannot write the output: {error.strerror}", file=sys.stderr)
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        status = status or 2
    sys.exit(status)


def _end_at_once(number: int, _: FrameType | None) -> None:
    os.write(2, b"interrupted\n")
    os._exit(128 + number)


if __name__ == "__main__":
    run()
