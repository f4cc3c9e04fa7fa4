"""The command ``plan``."""

from __future__ import annotations

import argparse
from typing import Any

from ..common.outputs import check_distinct, check_output, write_report
from ..errors import ConfigError
from ..maps.grid_map import GridMap
from ..maps.loading import bundled_maps
from ..maps.tasks import tasks_of
from ..robots.robot import Robot
from ..sampling.heatmap import Heatmap
from .inputs import input_files
from .options import (
    add_map_options,
    add_sampler_options,
    describe_planners,
    describe_samplers,
    map_options,
    sampler_options,
)
from .robot_options import add_robot_options, endpoint, robot_of

_PLAN_HELP = """\
Plan a path on a map with one of OMPL's planners.

The map is a PNG, JPG, BMP or PGM image (dark pixels are obstacles), a ROS map_server YAML, a
MovingAI .map, or one of the bundled maps: {maps}.

Coordinates are pixels, x right and y down from the upper left corner, or metres in the frame of
a ROS map.

Exit status: 0 solved, 1 no exact solution in time, 2 bad input or a file that cannot be written,
70 an error of cbagan-ompl itself (--debug prints its traceback), 130 interrupted, 143 terminated.
"""


def add_plan_parser(commands: Any) -> None:
    """Add the command ``plan``; its ``run`` default takes the parsed arguments."""
    parser = commands.add_parser(
        "plan",
        help="plan a path on a map",
        description=_PLAN_HELP.format(maps=", ".join(f"bundled:{name}" for name in bundled_maps())),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.describe_more = describe_planners
    parser.set_defaults(run=_plan)
    parser.add_argument("map", metavar="MAP", help="map file, or bundled:NAME")
    _add_task(parser.add_argument_group("task"))
    add_robot_options(parser.add_argument_group("robot", "what moves; a point by default"))
    _add_planner(parser.add_argument_group("planner"))
    _add_sampler(parser.add_argument_group("sampler"))
    _add_output(parser.add_argument_group("output"))


def _add_task(task: Any) -> None:
    task.add_argument(
        "--start",
        type=endpoint,
        metavar="X,Y[,YAW]",
        help="where the path begins; with a yaw, in radians, for robots with heading",
    )
    task.add_argument(
        "--goal",
        type=endpoint,
        action="append",
        metavar="X,Y[,YAW]",
        help="where it ends; given several times, at whichever of them",
    )
    task.add_argument(
        "--task",
        type=int,
        metavar="N",
        help="number of a task that comes with the map, from 0: a bundled map's, or a line of the "
        "MovingAI .scen beside it (default: 0 when no start and goal are given)",
    )
    task.add_argument(
        "--snap",
        type=float,
        default=0.0,
        metavar="D",
        help="move a start or goal in an obstacle or its margin to the nearest place where the "
        "robot may be, no farther than D (default: 0, an error)",
    )
    add_map_options(task)


def _add_planner(planner: Any) -> None:
    planner.add_argument(
        "--planner",
        default="RRTstar",
        metavar="NAME",
        help="OMPL's name of it, see below (default: RRTstar)",
    )
    planner.add_argument(
        "--time", type=float, default=1.0, metavar="S", help="limit in seconds (default: 1)"
    )
    planner.add_argument("--iterations", type=int, metavar="N", help="limit of iterations")
    planner.add_argument(
        "--range", type=float, metavar="R", help="longest edge (default: OMPL's choice)"
    )
    planner.add_argument(
        "--simplify", action="store_true", help="shorten the path with OMPL's path simplifier"
    )
    planner.add_argument("--seed", type=int, metavar="N", help="seed (default: a fresh one)")


def _add_sampler(sampler: Any) -> None:
    sampler.add_argument(
        "--sampler",
        default="learned",
        metavar="NAME",
        help=f"{describe_samplers()} (default: learned)",
    )
    sampler.add_argument(
        "--model",
        metavar="FILE",
        help="exported model, or the name of a bundled one such as cbagan",
    )
    sampler.add_argument(
        "--heatmap",
        metavar="FILE",
        help="sample from this image or .npy instead of a model's heat map",
    )
    sampler.add_argument(
        "--overlap",
        action="store_true",
        help="let the planner begin on OMPL's own sampler while the heat map is made",
    )
    add_sampler_options(sampler)


def _add_output(output: Any) -> None:
    output.add_argument("--output", metavar="FILE", help="figure of the plan (.png, .pdf, .svg)")
    output.add_argument("--no-tree", action="store_true", help="leave the tree out of the figure")
    output.add_argument("--json", metavar="FILE", help="result as JSON")
    output.add_argument("--csv", metavar="FILE", help="way points as a table: x,y[,yaw],index")


def _plan(args: argparse.Namespace) -> int:
    from ..planning.plan import plan

    if args.output is not None:
        from ..common.figures import check_figure_path

        check_figure_path(args.output)
    check_distinct(args.json, args.csv, args.output)
    for file in (args.output, args.csv):
        check_output(file, input_files(args), force=args.force)
    grid = GridMap.load(args.map, **map_options(args))
    robot = robot_of(args)
    start, goal = _endpoints(args, grid, robot)
    result = plan(
        grid,
        start,
        goal,
        planner=args.planner,
        sampler=args.sampler,
        time=args.time,
        iterations=args.iterations,
        range=args.range,
        robot=robot,
        snap=args.snap,
        model=args.model,
        heatmap=None if args.heatmap is None else Heatmap.load(args.heatmap, grid),
        overlap=args.overlap,
        simplify=args.simplify,
        keep_tree=args.output is not None and not args.no_tree,
        options=sampler_options(args),
    )
    values = result.to_dict()
    if args.json is not None:
        write_report(args.json, values)
    if args.csv is not None:
        result.save_csv(args.csv)
    if args.output is not None:
        from ..plotting import save_figure

        save_figure(result, grid, args.output)
    _print_summary(values, args.output)
    return 0 if result.solved else 1


def _endpoints(
    args: argparse.Namespace, grid: GridMap, robot: Robot
) -> tuple[tuple[float, ...], tuple[float, ...] | list[tuple[float, ...]]]:
    if args.start is not None and args.goal is not None and args.task is None:
        return args.start, args.goal
    if args.start is not None or args.goal is not None:
        raise ConfigError("give both --start and --goal, or --task alone")
    tasks = tasks_of(args.map, grid, with_yaw=robot.has_heading)
    number = args.task or 0
    if not 0 <= number < len(tasks):
        have = f"tasks 0 to {len(tasks) - 1}" if tasks else "no tasks of its own"
        raise ConfigError(
            f"{grid.name} comes with {have}"
            + (f", there is no task {number}" if args.task is not None else "")
            + ": give --start X,Y and --goal X,Y"
        )
    return tasks[number].start, tasks[number].goal


def _print_summary(values: dict[str, Any], figure: str | None) -> None:
    solved = f"yes, cost {values['cost']:.6g}" if values["solved"] else f"no ({_why(values)})"
    first = values["first_solution_s"]
    rows = {
        "solved": solved,
        **{f"{role} moved": _describe_move(values, role) for role in values["snapped"]},
        "planner": f"{values['planner']}, OMPL {values['ompl_version']}",
        "sampler": f"{values['sampler']}, hook {values['hook'] or 'none'}",
        "samples": _describe_samples(values),
        "nodes": values["nodes"],
        "inference": f"{values['inference_s']:.4f} s",
        "planning": f"{values['planning_s']:.4f} s"
        + ("" if first is None else f", first solution after {first:.4f} s"),
        "seed": values["seed"],
        **({"figure": figure} if figure else {}),
    }
    for name, value in rows.items():
        print(f"{name:<14} {value}")


# What the samples of the heat map are called, by the name of the sampler.
_SAMPLES = {
    "learned": "learned",
    "corridor": "from the corridor",
    "straight-line": "from the straight line",
}


def _describe_samples(values: dict[str, Any]) -> str:
    counts, sampler = values["sample_counts"], values["sampler"]
    if values["hook"] is None:
        return "OMPL's own, not counted"
    kind = _SAMPLES.get(sampler, "from the heat map")
    return f"{counts['learned']} {kind}, {counts['uniform']} uniform"


def _describe_move(values: dict[str, Any], role: str) -> str:
    move = values["snapped"][role]
    given, place = (",".join(f"{x:.6g}" for x in point) for point in (move["given"], values[role]))
    return f"by {move['distance']:.4g}, from {given} to {place}"


def _why(values: dict[str, Any]) -> str:
    exact = values["status"] == "Exact solution"
    return "its path failed the check" if exact else values["status"]
