"""The command line: ``cbagan-ompl``."""

from __future__ import annotations

import argparse
import errno
import os
import sys
import traceback
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from .. import __version__
from ..common.files import reason
from ..common.memory import is_out_of_memory
from ..common.outputs import check_output
from ..common.signals import Terminated
from ..errors import CbaganOmplError, CbaganOmplWarning
from .inputs import input_files
from .parser import Parser

#: Exit statuses beside 0 and 1: bad input, and what is our own fault (EX_SOFTWARE of sysexits.h).
BAD_INPUT, INTERNAL_ERROR = 2, 70
INTERRUPTED, NO_READER, TERMINATED = 130, 141, 143


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    Args:
        arguments: what follows the program's name; ``sys.argv[1:]`` by default.

    Returns:
        The exit status: 0 done, 1 no path found, 2 bad input or a file that cannot be written, 70
        an error of this package's own, 130 interrupted, 141 nobody reads the output, 143
        terminated.
    """
    return execute(parse(arguments))


def parse(arguments: Sequence[str] | None = None) -> argparse.Namespace:
    """Return the parsed arguments of the command line; arguments as for :func:`main`.

    Raises:
        SystemExit: help was asked for, or the arguments make no sense.
    """
    parser = _make_parser()
    return parser.parse_args(_bind_points(sys.argv[1:] if arguments is None else arguments))


def execute(args: argparse.Namespace) -> int:
    """Run a command.

    Args:
        args: from :func:`parse`.

    Returns:
        The exit status, as of :func:`main`.
    """
    # Figures are files: whatever backend a notebook or a screen asks for may not be there.
    os.environ["MPLBACKEND"] = "agg"
    try:
        check_output(getattr(args, "json", None), input_files(args), force=_forces(args))
        with _printed_warnings(args.command):
            return int(args.run(args))
    except BrokenPipeError:
        # The reader of our output has gone, as in "| head -1": files are written by then.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return NO_READER
    except KeyboardInterrupt as error:
        is_terminated = isinstance(error, Terminated)
        print(
            ("terminated" if is_terminated else "interrupted") + _resume_hint(args), file=sys.stderr
        )
        return TERMINATED if is_terminated else INTERRUPTED
    except Exception as error:
        if args.debug:
            traceback.print_exc()
        status, text = _explain(error)
        print(f"cbagan-ompl {args.command}: {text}", file=sys.stderr)
        return status


def _resume_hint(args: argparse.Namespace) -> str:
    """Return what to say of ``--resume`` after an interrupt."""
    if not hasattr(args, "resume"):
        return ""
    if hasattr(args, "can_resume") and not args.can_resume(args):
        return " before anything was kept; begin again with the same command"
    return "; go on with the same command and --resume"


@contextmanager
def _printed_warnings(command: str) -> Iterator[None]:
    """Print each warning of this package once, in one line, whatever filters Python was given."""
    with warnings.catch_warnings():
        warnings.simplefilter("default", CbaganOmplWarning)
        show_others = warnings.showwarning

        def show_warning(
            message: Warning | str, category: type[Warning], *where: Any, **more: Any
        ) -> None:
            if issubclass(category, CbaganOmplWarning):
                print(f"cbagan-ompl {command}: warning: {message}", file=sys.stderr)
            else:
                show_others(message, category, *where, **more)

        warnings.showwarning = show_warning
        yield


def _explain(error: Exception) -> tuple[int, str]:
    """Return the exit status of an error, and what to say of it."""
    if isinstance(error, CbaganOmplError):
        return BAD_INPUT, str(error)
    if isinstance(error, OSError) and error.errno in _OF_THE_SYSTEM:
        file = f"{error.filename}: " if error.filename else ""
        return BAD_INPUT, str(CbaganOmplError(f"{file}{reason(error)}"))
    if is_out_of_memory(error):
        return BAD_INPUT, f"not enough memory: {CbaganOmplError(error)}"
    said = CbaganOmplError(f"{type(error).__name__}: {error}")
    return INTERNAL_ERROR, (
        f"this is an error of cbagan-ompl itself: {said}; please report it with what the same "
        "command prints with --debug"
    )


# What a full or protected disk, and not a mistake of ours, is the cause of.
_OF_THE_SYSTEM = {
    *(errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EROFS, errno.EACCES, errno.EPERM, errno.EIO),
}


def _bind_points(arguments: Sequence[str]) -> list[str]:
    """Write points as ``--start=X,Y``: argparse takes what begins with "-" for an option."""
    bound: list[str] = []
    for argument in arguments:
        if bound and bound[-1] in ("--start", "--goal"):
            bound[-1] += f"={argument}"
        else:
            bound.append(argument)
    return bound


def _make_parser() -> argparse.ArgumentParser:
    # Damaged images are errors of ours, and need no other line.
    os.environ.setdefault("OPENCV_LOG_LEVEL", "SILENT")
    # Here, because they load much: until then Ctrl-C has to end the process without a word more.
    from .benchmark import add_benchmark_parser
    from .dataset import add_dataset_parser
    from .evaluate import add_evaluate_parser
    from .plan import add_plan_parser
    from .train import add_export_parser, add_train_parser

    parser = Parser(prog="cbagan-ompl", description="A learned state sampler for OMPL's planners.")
    parser.add_argument("--version", action="version", version=f"cbagan-ompl {__version__}")
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    add_plan_parser(commands)
    add_benchmark_parser(commands)
    add_dataset_parser(commands)
    add_train_parser(commands)
    add_export_parser(commands)
    add_evaluate_parser(commands)
    _add_common_options(parser, default=False)
    return parser


def _forces(args: argparse.Namespace) -> bool:
    return bool(getattr(args, "force", False))


def _add_common_options(parser: argparse.ArgumentParser, default: object) -> None:
    """Add ``--debug`` to a parser and its commands, and ``--force`` where they write files."""
    if any(action.dest == "json" for action in parser._actions):
        parser.add_argument(
            "--force",
            action="store_true",
            help="replace files that are not known to be written by cbagan-ompl",
        )
    parser.add_argument(
        "--debug",
        action="store_true",
        default=default,
        help="print the traceback of an error that ends the command",
    )
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for command in action.choices.values():
                _add_common_options(command, argparse.SUPPRESS)
