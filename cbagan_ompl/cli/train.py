"""The commands ``train`` and ``export``; running them needs torch, importing this does not."""

from __future__ import annotations

import argparse
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import Any

from ..common.outputs import check_distinct, write_report
from ..common.validation import require_torch, whole_number
from ..datasets.dataset import load_dataset
from ..datasets.synthetic import HARD_DETOUR, TASKS_PER_MAP, SyntheticSettings
from ..errors import ConfigError
from ..inference.bundled_models import find_model
from ..inference.model_files import ModelFormat, is_model
from ..networks.config import NETWORKS
from ..training.checkpoint_files import read_checkpoint
from ..training.config import LAST, PRESETS, TrainingConfig
from ..training.task_sources import DatasetSource, SyntheticSchedule, TaskSource, synthetic_source

_MAX_THREADS = 4096

_TRAIN_HELP = """\
Train the networks on a data set or on synthetic maps, and keep the best epoch.

DATASET is a folder with train.csv, test.csv, maps/ and tasks/. With --synthetic in its place maps
are generated and labelled exactly during the training, new ones in every epoch. After each epoch
the output folder holds last.pt (to go on from with --resume), best.pt (to export) and log.jsonl
(the scores).

  cbagan-ompl train DATASET --output runs/first
  cbagan-ompl train --synthetic --preset synthetic --output runs/synthetic
  cbagan-ompl export runs/first/best.pt --output models/first.pt
  cbagan-ompl plan MAP --model models/first.pt

Several processes, on one machine or more, share the work when torchrun starts them:

  torchrun --nproc-per-node 4 -m cbagan_ompl.cli train DATASET --output runs/first
"""

_EXPORT_HELP = """\
Turn a training checkpoint into a model file that `plan --model` takes.

Beside the model go a model card (.md) and its SHA-256 in manifest.json. Scores on the test tasks
are in the card once the training run has come to its end. Files of these names that an export wrote
are replaced, others only with --force.
"""


def add_train_parser(subparsers: Any) -> None:
    """Add the command ``train``; its ``run`` default takes the parsed arguments."""
    parser = subparsers.add_parser(
        "train",
        help="train the networks on a data set",
        description=_TRAIN_HELP,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.set_defaults(run=_train, can_resume=_can_resume)
    tasks = parser.add_argument_group("tasks, one of both")
    tasks.add_argument("dataset", metavar="DATASET", nargs="?", help="folder that holds train.csv")
    tasks.add_argument(
        "--synthetic", action="store_true", help="generate maps and tasks during the training"
    )
    _add_synthetic_options(parser.add_argument_group("with --synthetic"))
    parser.add_argument("--output", required=True, metavar="DIR", help="folder for the run's files")
    parser.add_argument(
        "--resume",
        action="store_true",
        help="go on from last.pt in the output folder, or begin if it is not there yet; --epochs "
        "may be larger than before",
    )
    parser.add_argument(
        "--start-from",
        metavar="FILE",
        help="begin with the weights of another run's checkpoint, or of an exported model: a file, "
        "or the name of a bundled one such as cbagan-worlds",
    )
    _add_recipe_options(parser.add_argument_group("recipe, the later overrides the earlier"))
    _add_machine_options(parser.add_argument_group("machine"))
    parser.add_argument(
        "--tensorboard", action="store_true", help="write logs for TensorBoard into the folder"
    )
    parser.add_argument("--json", metavar="FILE", help="write the scores as JSON")


def _add_recipe_options(recipe: Any) -> None:
    recipe.add_argument(
        "--preset",
        choices=sorted(PRESETS),
        default="best",
        help="synthetic: what the bundled model was trained with, for images of 256 pixels; "
        "refine: what --start-from cbagan-worlds goes on with; best: "
        "the best one for the paper's data; paper: the values of the paper (default: best)",
    )
    recipe.add_argument(
        "--network",
        choices=NETWORKS,
        default="cbagan",
        help="cbagan, its ablations with spatial attention (sa), channel attention (ca) or none, "
        "or sagan with self-attention (default: cbagan)",
    )
    recipe.add_argument(
        "--config", metavar="FILE", help="JSON or YAML file with options, named as for --set"
    )
    recipe.add_argument(
        "--set",
        nargs="+",
        action="extend",
        default=[],
        metavar="KEY=VALUE",
        help="single options of the networks and the training; known are "
        f"{', '.join(TrainingConfig().to_dict())}",
    )
    recipe.add_argument("--epochs", type=int, metavar="N", help="the same as --set epochs=N")
    recipe.add_argument(
        "--segmentation-only",
        action="store_true",
        help="train the generator alone, without discriminators; the same as --set "
        "adversarial_weight=0",
    )


def _add_machine_options(group: Any) -> None:
    group.add_argument(
        "--device", default="auto", help="cpu, cuda, ... (default: a GPU if there is one)"
    )
    group.add_argument("--threads", type=int, metavar="N", help="CPU threads (default: all)")


def _add_synthetic_options(group: Any) -> None:
    settings, schedule = SyntheticSettings(), SyntheticSchedule()
    for name, default, what in (
        ("--size", settings.size, "height and width of the maps in pixels"),
        ("--maps", schedule.maps, f"maps for each epoch, {TASKS_PER_MAP} tasks on each"),
        ("--held-out", schedule.held_out, "maps for validation, and as many for the test"),
        ("--jobs", schedule.jobs, "processes that generate maps"),
        ("--synthetic-seed", settings.seed, "seed of the maps and tasks"),
    ):
        group.add_argument(
            name, type=int, default=default, metavar="N", help=f"{what} (default: {default})"
        )
    group.add_argument(
        "--hard-fraction",
        type=float,
        default=settings.hard_fraction,
        metavar="F",
        help=f"fraction of tasks whose shortest path is at least {HARD_DETOUR} times as long as "
        f"the straight line (default: {settings.hard_fraction})",
    )
    group.add_argument(
        "--generators",
        type=lambda text: tuple(text.split(",")),
        default=settings.generators,
        metavar="A,B",
        help=f"map generators to use (default: all: {','.join(settings.generators)})",
    )


def add_export_parser(subparsers: Any) -> None:
    """Add the command ``export``; its ``run`` default takes the parsed arguments."""
    parser = subparsers.add_parser(
        "export",
        help="turn a training checkpoint into a model file",
        description=_EXPORT_HELP,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.set_defaults(run=_export)
    parser.add_argument(
        "checkpoint",
        metavar="CHECKPOINT",
        help="best.pt of a training run; or an exported model, to write it anew",
    )
    parser.add_argument(
        "--output", required=True, metavar="FILE", help="the model file, .pt or .onnx"
    )
    parser.add_argument(
        "--format",
        choices=[kind.value for kind in ModelFormat],
        help="torchscript (.pt) is computed by torch, onnx (.onnx) by ONNX Runtime, a tenth of its "
        "size; writing it needs the package onnx (default: by the suffix of the file)",
    )
    parser.add_argument(
        "--note", default="", metavar="TEXT", help="for the card: origin and licence of the data"
    )
    parser.add_argument("--json", metavar="FILE", help="write the model's record as JSON")


def _recipe(args: argparse.Namespace) -> TrainingConfig:
    """Return the recipe that the arguments of ``train`` ask for."""
    config = TrainingConfig.preset(args.preset).with_network(args.network)
    if args.config is not None:
        config = TrainingConfig.from_file(args.config, config)
    config = config.with_assignments(args.set)
    if args.segmentation_only:
        config = config.updated({"adversarial_weight": 0})
    return config if args.epochs is None else config.updated({"epochs": args.epochs})


def _train(args: argparse.Namespace) -> int:
    config = _recipe(args)
    if args.threads is not None:
        whole_number("--threads", args.threads, 1, _MAX_THREADS)
    if args.synthetic == (args.dataset is not None):
        raise ConfigError("tasks come from a DATASET or from --synthetic: give one of both")
    if args.start_from is not None:
        _check_weights(find_model(args.start_from))
    require_torch()
    import torch

    from ..training.distributed import is_leading_process
    from ..training.loop import train

    if args.threads is not None:
        torch.set_num_threads(args.threads)
    with _source(args, config) as source:
        if is_leading_process():
            values = source.description()
            print(
                f"{values['train_tasks']} training tasks an epoch, "
                f"{values['test_tasks']} for testing"
            )
        result = train(
            source,
            config,
            args.output,
            resume=args.resume,
            start_from=args.start_from,
            device=args.device,
            tensorboard=args.tensorboard,
        )
    if not is_leading_process():
        return 0
    _print_scores(result)
    if args.json is not None:
        write_report(args.json, result)
    return 0


def _can_resume(args: argparse.Namespace) -> bool:
    """Return whether the first epoch of a run of ``train`` is done."""
    return (Path(args.output) / LAST).exists()


def _source(args: argparse.Namespace, config: TrainingConfig) -> AbstractContextManager[TaskSource]:
    """Return the source of the tasks that the arguments of ``train`` ask for."""
    if args.synthetic:
        # Before the first maps are generated, which takes a while.
        from ..training.batches import check_trainable

        check_trainable(args.size, config)
        settings = SyntheticSettings(
            args.size, args.generators, args.hard_fraction, seed=args.synthetic_seed
        )
        return synthetic_source(settings, SyntheticSchedule(args.maps, args.held_out, args.jobs))
    dataset = load_dataset(args.dataset)
    return nullcontext(DatasetSource(dataset, config.validation_fraction, config.seed))


def _print_scores(result: dict[str, Any]) -> None:
    rows = {"best epoch": result["test"], **result["trivial"]}
    print(f"\nscores of the region on the test tasks (best epoch: {result['epoch']})")
    for name, scores in rows.items():
        print(
            f"  {name:15} IoU {scores['iou']:.3f}  Dice {scores['dice']:.3f}  "
            f"connected (8) {scores['connectivity']:.1%}"
        )
    print(f"export it with: cbagan-ompl export {result['checkpoint']} --output MODEL.pt")


def _check_weights(path: Path) -> None:
    """Raise if a file is damaged: torch, which reads it, takes seconds to load."""
    if not is_model(path):
        read_checkpoint(path)


def _export(args: argparse.Namespace) -> int:
    if args.format is not None and not args.output.endswith(ModelFormat(args.format).suffix):
        suffix = ModelFormat(args.format).suffix
        raise ConfigError(f"--format {args.format} writes a file whose name ends in {suffix}")
    _check_weights(Path(args.checkpoint))
    require_torch()
    from ..training.export import export, exported_files

    check_distinct(args.json, *map(str, exported_files(Path(args.output))))

    record = export(
        args.checkpoint, args.output, note=args.note, force=getattr(args, "force", False)
    )
    print(
        f"{args.output}: {record['parameters']:,} parameters, epoch {record['epoch']}, "
        f"validation IoU {record['metrics']['validation']['iou']:.3f}"
    )
    if record["metrics"]["test"] is None:
        print("the training run has not come to its end: the card has validation scores only")
    if args.json is not None:
        write_report(args.json, record)
    return 0
