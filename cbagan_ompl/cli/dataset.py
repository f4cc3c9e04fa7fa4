"""The command ``dataset``; none of it needs torch."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from ..common.outputs import write_report
from ..common.validation import whole_number
from ..datasets.generation import LABELS, RANGE, RUNS, GenerationSettings, generate
from ..datasets.importing import KEEP, describe, import_dataset, write_dataset
from ..datasets.labelling import label_maps
from ..datasets.splits import SPLITS
from ..datasets.synthetic import HARD_DETOUR
from ..errors import ConfigError
from ..map_generators import MAP_GENERATORS
from ..maps.grid_map import GridMap
from .options import add_scheduler_option, open_executor

# Processes that the pools of Python start, at most.
_MAX_JOBS = 1024

_HELP = """\
Import and split a training set, generate a new one, or measure the noise of labels.

A set is a folder with maps/, tasks/, train.csv and test.csv, in the layout of the published set of
the CBAGAN-RRT paper.
"""

_IMPORT_HELP = """\
Read a training set, check all of its files, and print what it holds.

PATH is a folder or an archive: .zip, or .tar, perhaps in gzip, bzip2 or xz. Only lists and images
are unpacked; archives with links, of more than 131,072 members or 2 GiB, or that grow to more than
200 times their size are refused: unpack them yourself, where you trust them.

With --output a copy is written, which can be split again: the paper's set is split by task, so that
every test map is in training too;

  cbagan-ompl dataset import mpr.tar.gz --output mpr-by-map --split map --copies 10

keeps each original map and its copies together, either in training or in the test.
"""

_GENERATE_HELP = """\
Generate a training set: random maps, tasks on them, and labels by runs of RRT or exact ones.

  cbagan-ompl dataset generate --output mine --maps 100 --tasks 100 --copies 10
  cbagan-ompl train mine --output runs/mine

The same seed gives the same files, whatever --jobs (with one version of OMPL).
"""

_LABEL_HELP = """\
Make a training set of your own maps: random tasks on them, labelled by runs of RRT or exactly.

MAP is whatever `plan` takes: an image, a ROS map (.yaml), a MovingAI map (.map) or bundled:NAME. A
map is scaled to --size on its longer side, as for a prediction, and made a square by blocked
pixels. Then refine the bundled model on the set, with the recipe that it was trained with:

  cbagan-ompl dataset label MAP... --output mine --tasks 200 --label geodesic
  cbagan-ompl train mine --output runs/mine --preset refine --start-from cbagan-worlds
  cbagan-ompl export runs/mine/best.pt --output mine.pt

With --split map whole maps are kept for the test.
"""

_NOISE_HELP = """\
Label the test tasks of a set several times by RRT, and compare the labels.

RRT is random, and so are its labels: their agreement estimates the best score of a network.
"""


def add_dataset_parser(commands: Any) -> None:
    """Add the command ``dataset``; the ``run`` defaults take the parsed arguments."""
    parser = commands.add_parser(
        "dataset", help="generate, import and examine training sets", description=_HELP
    )
    actions = parser.add_subparsers(required=True, metavar="ACTION")
    _add_import(actions)
    _add_generate(actions)
    _add_label(actions)
    _add_noise(actions)


def _action(actions: Any, name: str, help: str, description: str) -> argparse.ArgumentParser:
    parser: argparse.ArgumentParser = actions.add_parser(
        name,
        help=help,
        description=description,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--json", metavar="FILE", help="write what is printed as JSON")
    return parser


def _add_import(actions: Any) -> None:
    parser = _action(actions, "import", "check a set, and split it again", _IMPORT_HELP)
    parser.set_defaults(run=_import)
    parser.add_argument("path", metavar="PATH", help="folder or archive")
    parser.add_argument("--output", metavar="DIR", help="folder for a copy of the set")
    parser.add_argument(
        "--split",
        choices=(KEEP, *SPLITS),
        default=KEEP,
        help="split of the copy: as it is, by single tasks, or by original maps (default: keep)",
    )
    _add_split_options(parser)


def _add_generate(actions: Any) -> None:
    defaults = GenerationSettings()
    parser = _action(actions, "generate", "generate a set", _GENERATE_HELP)
    parser.set_defaults(run=_generate)
    parser.add_argument("--output", required=True, metavar="DIR", help="folder of the set")
    _add_number(parser, "--maps", defaults.maps, "number of maps")
    _add_number(parser, "--tasks", defaults.tasks, "tasks on each map")
    size = "width and height of the maps in pixels; training takes multiples of 16"
    _add_number(parser, "--size", defaults.size, size)
    _add_task_options(parser, defaults)
    parser.add_argument(
        "--generators",
        type=lambda text: tuple(text.split(",")),
        default=defaults.generators,
        metavar="A,B",
        help=f"map generators, taken in turn (default: all: {','.join(MAP_GENERATORS)})",
    )
    parser.add_argument(
        "--varied", action="store_true", help="scale, rotate and degrade the maps at random"
    )


def _add_label(actions: Any) -> None:
    # Images of the bundled model's size, on maps that it will meet again.
    defaults = GenerationSettings(size=256, label="geodesic", split="task")
    parser = _action(actions, "label", "make a set of your own maps", _LABEL_HELP)
    parser.set_defaults(run=_label)
    parser.add_argument("maps", nargs="+", metavar="MAP", help="map file")
    parser.add_argument("--output", required=True, metavar="DIR", help="folder of the set")
    _add_number(parser, "--tasks", defaults.tasks, "tasks on each map")
    size = "width and height of the set's images in pixels; the bundled model's are 256"
    _add_number(parser, "--size", defaults.size, size)
    _add_task_options(parser, defaults)


def _add_task_options(parser: argparse.ArgumentParser, defaults: GenerationSettings) -> None:
    """Add what decides the tasks, their labels and the split of a new set."""
    hard = (
        f"fraction of tasks whose shortest path is at least {HARD_DETOUR} times as long as the "
        "straight line"
    )
    _add_number(parser, "--hard-fraction", defaults.hard_fraction, hard)
    parser.add_argument(
        "--label",
        choices=LABELS,
        default=defaults.label,
        help="rrt: pixels on the paths of many runs of RRT; geodesic: pixels on paths that are not "
        f"much longer than the shortest (default: {defaults.label})",
    )
    distance = "least distance from start to goal, as a fraction of the size"
    _add_number(parser, "--min-distance", defaults.min_distance, distance)
    parser.add_argument(
        "--split",
        choices=SPLITS,
        default=defaults.split,
        help=f"test tasks by original maps, or by single tasks (default: {defaults.split})",
    )
    _add_split_options(parser)
    _add_label_options(parser)
    parser.add_argument(
        "--resume", action="store_true", help="continue a set whose generation was interrupted"
    )


def _add_noise(actions: Any) -> None:
    parser = _action(actions, "noise", "measure the noise of labels", _NOISE_HELP)
    parser.set_defaults(run=_noise)
    parser.add_argument("dataset", metavar="DATASET", help="folder or archive of a set")
    parser.add_argument(
        "--tasks", type=int, metavar="N", help="only N of the test tasks, chosen by the seed"
    )
    _add_number(parser, "--seed", 0, "seed of all random numbers")
    _add_label_options(parser)


def _add_split_options(parser: argparse.ArgumentParser) -> None:
    copies = "maps from each original, by shift, shear and rotation; 10 in the paper"
    _add_number(parser, "--copies", 1, copies)
    fraction = "fraction of the tasks, or of the original maps, for testing"
    _add_number(parser, "--test-fraction", 0.2, fraction)
    _add_number(parser, "--seed", 0, "seed of all random numbers")


def _add_label_options(parser: argparse.ArgumentParser) -> None:
    _add_number(parser, "--runs", RUNS, "runs of RRT for each label")
    parser.add_argument(
        "--range",
        type=float,
        metavar="R",
        help=f"longest edge of RRT in pixels (default: the size / {1 / RANGE:g})",
    )
    _add_number(parser, "--jobs", 1, "number of processes")
    add_scheduler_option(parser)


def _add_number(
    parser: argparse.ArgumentParser, name: str, default: int | float, what: str
) -> None:
    """Add an option for a number of the type that its default has."""
    parser.add_argument(
        name,
        type=type(default),
        default=default,
        metavar="N" if isinstance(default, int) else "F",
        help=f"{what} (default: {default})",
    )


def _import(args: argparse.Namespace) -> int:
    if args.output is None and args.split != KEEP:
        raise ConfigError("a new split is written with a copy of the set: give --output as well")
    dataset = import_dataset(Path(args.path))
    values = describe(dataset)
    if args.output is not None:
        write_dataset(
            Path(args.output), dataset, args.split, args.copies, args.test_fraction, args.seed
        )
    print(
        f"{values['name']}: {values['train_tasks']} tasks for training, {values['test_tasks']} for "
        f"testing, on {values['maps']} maps of {values['side']} x {values['side']} pixels\n"
        f"  maps with tasks in both lists:           {values['shared_maps']}\n"
        f"  test tasks that are in training too:     {values['repeated_tasks']}\n"
        f"  labels that connect start and goal (8):  {values['joined']:.2%}\n"
        f"  fraction of free space in regions:       {values['region_share']:.1%}\n"
        f"  tasks with a blocked start or goal:      {values['blocked_ends']}"
    )
    if args.output is not None:
        print(f"copied to {args.output}, split: {args.split}")
    if args.json is not None:
        write_report(args.json, values)
    return 0


def _settings(args: argparse.Namespace, **of_maps: Any) -> GenerationSettings:
    return GenerationSettings(
        tasks=args.tasks,
        size=args.size,
        copies=args.copies,
        label=args.label,
        hard_fraction=args.hard_fraction,
        runs=args.runs,
        range=args.range,
        min_distance=args.min_distance,
        split=args.split,
        test_fraction=args.test_fraction,
        seed=args.seed,
        **of_maps,
    )


def _generate(args: argparse.Namespace) -> int:
    settings = _settings(args, maps=args.maps, generators=args.generators, varied=args.varied)
    whole_number("jobs", args.jobs, 1, _MAX_JOBS)
    with open_executor(args) as executor:
        generate(Path(args.output), settings, args.jobs, args.resume, executor=executor)
    return _report_new_set(args, settings)


def _label(args: argparse.Namespace) -> int:
    settings = _settings(args, maps=len(args.maps))
    whole_number("jobs", args.jobs, 1, _MAX_JOBS)
    maps = {path: GridMap.load(path) for path in args.maps}
    if len(maps) < len(args.maps):
        raise ConfigError("a map is given twice; a set has each map once")
    with open_executor(args) as executor:
        label_maps(Path(args.output), maps, settings, args.jobs, args.resume, executor=executor)
    return _report_new_set(args, settings)


def _report_new_set(args: argparse.Namespace, settings: GenerationSettings) -> int:
    print(f"{settings.maps * settings.tasks} tasks written to {args.output}")
    if args.json is not None:
        write_report(args.json, describe(import_dataset(Path(args.output))))
    return 0


def _noise(args: argparse.Namespace) -> int:
    from ..evaluation.label_noise import choose_tasks, label_noise

    whole_number("jobs", args.jobs, 1, _MAX_JOBS)
    tasks = import_dataset(Path(args.dataset)).test
    if args.tasks is not None:
        tasks = choose_tasks(tasks, args.tasks, args.seed)
    longest_edge = tasks.size * RANGE if args.range is None else args.range
    with open_executor(args) as executor:
        values = label_noise(
            tasks, args.runs, longest_edge, args.seed, args.jobs, executor=executor
        )
    print(f"agreement of labels on {len(tasks)} tasks, {args.runs} runs of RRT each")
    for name, scores in values.items():
        if isinstance(scores, dict):
            print(f"  {name:28} IoU {scores['iou']:.3f}  Dice {scores['dice']:.3f}")
    if args.json is not None:
        write_report(args.json, values)
    return 0
