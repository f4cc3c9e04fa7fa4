"""The parser of the command line: brief messages, and arguments that are kept in files."""

from __future__ import annotations

import argparse
import shutil
import sys
import textwrap
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NoReturn

from ..common.files import read_text
from ..errors import CbaganOmplError, ConfigError

# Limits of files of arguments: bytes of one, their number, arguments in all.
_MAX_BYTES, _MAX_FILES, _MAX_ARGUMENTS = 2**20, 64, 20_000


class Parser(argparse.ArgumentParser):
    """An argument parser whose messages stay short.

    Attributes:
        reads_files: whether ``@FILE`` stands for the arguments in a file, one a line.
        describe_more: makes the paragraphs at the end of the help, when the help is asked for.
    """

    reads_files = False
    describe_more: Callable[[], list[str]] | None = None

    def format_help(self) -> str:
        """Return the help, with what only a look at the installed packages tells."""
        if self.describe_more is not None:
            width = shutil.get_terminal_size().columns - 2
            self.epilog = "\n\n".join(textwrap.fill(text, width) for text in self.describe_more())
        return super().format_help()

    def parse_known_args(  # type: ignore[override]
        self, args: Sequence[str] | None = None, namespace: Any = None
    ) -> tuple[argparse.Namespace, list[str]]:
        """Parse arguments, with those in files in their place."""
        words = list(sys.argv[1:] if args is None else args)
        if self.reads_files:
            try:
                words = _expand(words)
            except ConfigError as error:
                self.error(str(error))
        return super().parse_known_args(words, namespace)

    def error(self, message: str) -> NoReturn:
        """Leave the program with the status of bad input."""
        said = CbaganOmplError(message)
        self.exit(2, f"usage: {self.prog} ..., see {self.prog} --help\n{self.prog}: {said}\n")


def _expand(arguments: Sequence[str]) -> list[str]:
    """Return arguments with those in files, which may name further files, in their place."""
    expanded: list[str] = []
    waiting = list(reversed(arguments))
    files = 0
    while waiting:
        argument = waiting.pop()
        if not argument.startswith("@"):
            expanded.append(argument)
            continue
        files += 1
        if files > _MAX_FILES:
            raise ConfigError(f"{argument}: more than {_MAX_FILES} files of arguments")
        waiting += reversed(read_text(Path(argument[1:]), ConfigError, _MAX_BYTES).splitlines())
        if len(waiting) > _MAX_ARGUMENTS:
            raise ConfigError(f"{argument}: more than {_MAX_ARGUMENTS} arguments")
    return expanded
