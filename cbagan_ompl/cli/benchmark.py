"""The command ``benchmark``."""

from __future__ import annotations

import argparse
import os
import shlex
import sys
from collections import Counter
from pathlib import Path
from typing import Any

from ..benchmarking.settings import Settings, parse_parameters
from ..common.text import one_line
from ..common.validation import whole_number
from ..errors import ConfigError, show
from ..maps.loading import bundled_maps
from ..planning.heatmap_sources import LEARNED
from .options import (
    add_map_options,
    add_sampler_options,
    add_scheduler_option,
    describe_planners,
    describe_samplers,
    map_options,
    open_executor,
    sampler_options,
)
from .robot_options import add_robot_options, robot_of

# Tasks that run at a time, and characters that a report shows of the command.
_MOST_JOBS, _LONGEST_COMMAND = 1024, 20_000

_HELP = """\
Compare samplers in OMPL's own planners, with OMPL's Benchmark, on the same tasks.

MAP is what `plan` takes; without any, the bundled maps are used ({maps}).
NAME=FILE gives a map another name than its file's. Files of one name, such as map.yaml, are called
after their folders. Tasks that cannot be planned for are left out, counted and named.
`@FILE` stands for the arguments in FILE, one a line: a benchmark can be kept in a file.

At the end the output folder holds:

  logs/MAP_N.log    OMPL's log of each task, with additional properties of the runs
  benchmark.db      SQLite, for Planner Arena and OMPL's scripts
  summary.json      medians and ratios with 95 % intervals, over all tasks and by kind of map
  summary.md        the same as a report
  *.png, *.pdf      plots

Exit status: 0 done, 1 some tasks failed, 2 bad input or a file that cannot be written, 70 an error
of cbagan-ompl itself (--debug prints its traceback), 130 interrupted, 143 terminated (continue
with --resume).
"""


def add_benchmark_parser(commands: Any) -> None:
    """Add the command ``benchmark``; its ``run`` default takes the parsed arguments."""
    defaults = Settings()
    parser = commands.add_parser(
        "benchmark",
        help="compare samplers on many tasks",
        description=_HELP.format(maps=", ".join(bundled_maps())),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.reads_files = True
    parser.describe_more = describe_planners
    parser.set_defaults(run=_benchmark)
    parser.add_argument(
        "maps", nargs="*", metavar="MAP", help="map file, bundled:NAME or NAME=FILE"
    )

    tasks = parser.add_argument_group("tasks")
    tasks.add_argument(
        "--tasks",
        metavar="FILE",
        help="tasks for the maps: .csv (map,start_x,start_y,goal_x,goal_y[,start_yaw,"
        "goal_yaw,optimal_cost,family], where family is the kind of map) or MovingAI .scen "
        "(default: those that come with a map, otherwise random ones)",
    )
    tasks.add_argument(
        "--tasks-per-map",
        type=int,
        metavar="N",
        help="at most N tasks of each map, spread over its list (default: all; 4 random ones)",
    )
    tasks.add_argument(
        "--least-distance",
        type=float,
        metavar="D",
        help="least distance from start to goal of random tasks, world units (default: half the "
        "longer side of the map)",
    )
    add_map_options(tasks)
    add_robot_options(parser.add_argument_group("robot", "what moves; a point by default"))

    comparison = parser.add_argument_group("comparison")
    comparison.add_argument(
        "--planners",
        type=_names,
        default=defaults.planners,
        metavar="A,B",
        help=f"OMPL's names of them, see below (default: {','.join(defaults.planners)})",
    )
    comparison.add_argument(
        "--samplers",
        type=_names,
        default=defaults.samplers,
        metavar="A,B",
        help=f"{describe_samplers()}; NAME:OPTION=VALUE changes an option for one of them, as in "
        "learned:adaptation=none, :sharpness=1 or :uniform_fraction=0.2 "
        f"(default: {','.join(defaults.samplers)})",
    )
    comparison.add_argument(
        "--heatmap-dir",
        action="append",
        default=[],
        type=_named_folder,
        metavar="NAME=DIR",
        help="another sampler NAME, with heat maps of any origin: DIR/MAP_N.npy or .png for task N "
        "of each map, from 0; may be repeated",
    )
    comparison.add_argument(
        "--model",
        action="append",
        default=[],
        type=_model,
        metavar="[NAME=]FILE",
        help="exported model of the learned sampler, or the name of a bundled one such as cbagan "
        "(default: the default model); with NAME, "
        "another sampler NAME with the heat maps of this model; may be repeated",
    )
    add_sampler_options(comparison)
    comparison.add_argument(
        "--range",
        type=float,
        metavar="R",
        help="longest edge of all planners that have it (default: OMPL's choice)",
    )
    comparison.add_argument(
        "--set",
        nargs="+",
        action="extend",
        default=[],
        metavar="PLANNER.parameter=value",
        help="call a setter of a planner: RRTstar.rewire_factor=1.2 is setRewireFactor(1.2)",
    )

    comparison.add_argument(
        "--simplify",
        type=_names,
        default=defaults.simplify,
        metavar="A,B",
        help="planners whose paths OMPL's path simplifier shortens after each run; its time counts",
    )

    effort = parser.add_argument_group("effort")
    effort.add_argument(
        "--runs",
        type=int,
        default=defaults.runs,
        metavar="N",
        help=f"runs of each planner with each sampler on each task (default: {defaults.runs})",
    )
    effort.add_argument(
        "--time",
        type=float,
        default=defaults.time,
        metavar="S",
        help=f"time limit of a run, seconds (default: {defaults.time})",
    )
    effort.add_argument(
        "--seed",
        type=int,
        default=0,
        metavar="N",
        help="seed of OMPL, of the samples and of random tasks (default: 0)",
    )
    effort.add_argument(
        "--jobs",
        type=int,
        default=_cores(),
        metavar="N",
        help="tasks that run at a time, each in a process (default: the number of cores)",
    )
    add_scheduler_option(effort)

    output = parser.add_argument_group("output")
    output.add_argument("--output", required=True, metavar="DIR", help="folder of the results")
    output.add_argument(
        "--resume",
        action="store_true",
        help="continue the benchmark of the folder: only tasks without a log are run",
    )
    output.add_argument(
        "--within",
        type=int,
        default=defaults.within,
        metavar="P",
        help="report and plots show the time until a path is within P percent of the best known "
        f"cost (default: {defaults.within})",
    )


def _names(text: str) -> tuple[str, ...]:
    return tuple(text.split(","))


def _named_folder(text: str) -> tuple[str, str]:
    name, _, folder = text.partition("=")
    if not (name and folder and os.path.isdir(folder)):
        raise argparse.ArgumentTypeError(f"expected NAME=DIR with a folder DIR, got {show(text)}")
    return name, folder


def _model(text: str) -> tuple[str, str]:
    name, equals, file = text.partition("=")
    return (name, file) if equals and not os.path.exists(text) else (LEARNED, text)


def _cores() -> int:
    return len(os.sched_getaffinity(0))


def _settings(args: argparse.Namespace) -> Settings:
    folders, models = dict(args.heatmap_dir), dict(args.model)
    named = {name.partition(":")[0] for name in args.samplers}
    additional = [name for name in models if name not in named]
    if LEARNED in additional:
        raise ConfigError(
            f"--model {models[LEARNED]}: the learned sampler is not among the samplers"
        )
    return Settings(
        planners=args.planners,
        samplers=(*args.samplers, *additional, *folders),
        runs=args.runs,
        time=args.time,
        range=args.range,
        parameters=parse_parameters(args.set),
        sampler_options=sampler_options(args),
        models=models,
        heatmap_dirs=folders,
        robot=robot_of(args),
        simplify=args.simplify,
        within=args.within,
    )


def _benchmark(args: argparse.Namespace) -> int:
    from ..benchmarking.benchmark import Benchmark, write_results
    from ..benchmarking.report import describe_left_out, warn_of_hosts
    from ..benchmarking.tasks import select_tasks

    whole_number("jobs", args.jobs, 1, _MOST_JOBS)
    if args.jobs > _cores() and args.scheduler is None:
        print(
            f"warning: {args.jobs} jobs share {_cores()} cores, all times will be too long",
            file=sys.stderr,
        )
    settings = _settings(args)
    chosen = select_tasks(
        args.maps,
        args.tasks,
        args.tasks_per_map,
        settings.robot,
        args.seed,
        map_options(args),
        args.least_distance,
    )
    if chosen.left_out:
        print("warning:", *describe_left_out(chosen.left_out), sep="\n", file=sys.stderr)
    with open_executor(args) as executor:
        benchmark = Benchmark(chosen.tasks, settings, Path(args.output), args.resume)
        failures = benchmark.run(executor)
    logs = benchmark.finished_logs(failures)
    if logs:
        command = one_line(shlex.join(["cbagan-ompl", *sys.argv[1:]]), _LONGEST_COMMAND)
        folder, left_out = benchmark.folder, chosen.left_out
        print(write_results(logs, settings, failures, folder, command, left_out))
        said = warn_of_hosts(Counter(log.host for log in logs))
        if said:
            print(f"warning: {said}", file=sys.stderr)
    return 1 if failures else 0
