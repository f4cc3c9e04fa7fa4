"""Options that several commands share: how maps are read, how heat maps are sampled."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from ..common.parallel import Executor, LocalExecutor
from ..planning.heatmap_sources import SAMPLERS
from ..sampling.options import (
    ADAPTATION_RULES,
    DEFAULT_UNIFORM_FRACTION,
    OPTIMIZING_SHARPNESS,
    Adaptation,
    SamplerOptions,
)


def add_map_options(parser: Any) -> None:
    """Add the options to a parser or a group of one."""
    parser.add_argument(
        "--threshold",
        type=float,
        metavar="T",
        help="for images: how bright a free pixel is at least, 0 to 1 (default: 0.5)",
    )
    parser.add_argument(
        "--unknown-is-free",
        action="store_true",
        help="for ROS maps: plan through unknown space (default: it is blocked)",
    )


def map_options(args: argparse.Namespace) -> dict[str, Any]:
    """Return the options of :meth:`cbagan_ompl.GridMap.load` that the arguments ask for."""
    options: dict[str, Any] = {"unknown_is_free": args.unknown_is_free}
    if args.threshold is not None:
        options["threshold"] = args.threshold
    return options


def add_scheduler_option(parser: Any) -> None:
    """Add the option of :func:`open_cluster` to a parser or a group of one."""
    parser.add_argument(
        "--scheduler",
        metavar="ADDRESS",
        help="use the workers of a Dask cluster that you trust, and no processes of this machine: "
        "address of its scheduler, tcp://HOST:PORT, or its --scheduler-file; needs "
        "the extra cluster",
    )


@contextmanager
def open_cluster(args: argparse.Namespace) -> Iterator[Executor | None]:
    """Yield the cluster that ``args.scheduler`` names, None without one.

    Raises:
        MissingDependencyError: Dask is wanted, and not installed.
        ClusterError: the cluster cannot be used.
    """
    if args.scheduler is None:
        yield None
        return
    from ..common.cluster import ClusterExecutor

    with ClusterExecutor(args.scheduler) as executor:
        yield executor


@contextmanager
def open_executor(args: argparse.Namespace) -> Iterator[Executor]:
    """Yield where the work is done: a cluster, or ``args.jobs`` processes of this machine.

    Raises:
        CbaganOmplError: as for :func:`open_cluster`.
    """
    with open_cluster(args) as cluster:
        yield cluster or LocalExecutor(args.jobs)


def add_sampler_options(parser: Any) -> None:
    """Add the options of :func:`sampler_options` to a parser or a group of one."""
    parser.add_argument(
        "--uniform-fraction",
        type=float,
        default=DEFAULT_UNIFORM_FRACTION,
        metavar="F",
        help="fraction of the samples that stays uniform over free space "
        f"(default: {DEFAULT_UNIFORM_FRACTION})",
    )
    parser.add_argument(
        "--sharpness",
        type=float,
        metavar="P",
        help="exponent of the heat map: samples have a density proportional to its values to the "
        f"power of P (default: {OPTIMIZING_SHARPNESS:g} for planners that look for the shortest "
        "path, 1 for those that stop at their first)",
    )
    parser.add_argument(
        "--adaptation",
        type=lambda text: () if text == "none" else tuple(text.split(",")),
        default=ADAPTATION_RULES,
        metavar="A,B",
        help="rules that adapt samples to the planner's tree, or none "
        f"(default: all: {','.join(ADAPTATION_RULES)})",
    )


def sampler_options(args: argparse.Namespace) -> SamplerOptions:
    """Return the options that the arguments ask for, with the seed in ``args.seed``.

    Raises:
        ConfigError: an option that makes no sense.
    """
    return SamplerOptions(
        uniform_fraction=args.uniform_fraction,
        sharpness=args.sharpness,
        adaptation=Adaptation.of(args.adaptation),
        seed=args.seed,
    )


def describe_planners() -> list[str]:
    """Return the planners of the installed OMPL, for the end of a help; this loads OMPL."""
    from ..planning.hooks import describe_planners

    return describe_planners()


def describe_samplers() -> str:
    """Return the names of the samplers with what each samples, for the help of an option."""
    return "; ".join(f"{name}: {what}" for name, what in SAMPLERS.items())
