"""The command line: ``cbagan-ompl``."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence

from .. import __version__
from ..common.files import check_folder
from ..errors import CbaganOmplError
from .benchmark import add_benchmark_parser
from .dataset import add_dataset_parser
from .evaluate import add_evaluate_parser
from .plan import add_plan_parser
from .train import add_export_parser, add_train_parser


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    Args:
        arguments: what follows the program's name; ``sys.argv[1:]`` by default.

    Returns:
        The exit status: 0 done, 1 no path found, 2 bad input, 130 interrupted, 141 nobody reads
        the output.
    """
    # Figures are files: whatever backend a notebook or a screen asks for may not be there.
    os.environ["MPLBACKEND"] = "agg"
    parser = _make_parser()
    args = parser.parse_args(_bind_points(sys.argv[1:] if arguments is None else arguments))
    try:
        check_folder(getattr(args, "json", None))
        return int(args.run(args))
    except CbaganOmplError as error:
        print(f"cbagan-ompl {args.command}: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        return 130
    except BrokenPipeError:
        # The reader of our output has gone, as in "| head -1": files are written by then.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 141


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
    parser = argparse.ArgumentParser(
        prog="cbagan-ompl", description="A learned state sampler for OMPL's planners."
    )
    parser.add_argument("--version", action="version", version=f"cbagan-ompl {__version__}")
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    add_plan_parser(commands)
    add_benchmark_parser(commands)
    add_dataset_parser(commands)
    add_train_parser(commands)
    add_export_parser(commands)
    add_evaluate_parser(commands)
    return parser
