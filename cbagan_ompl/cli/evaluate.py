"""The command ``evaluate``."""

from __future__ import annotations

import argparse
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..common.files import make_folder, write_atomically
from ..common.outputs import check_output, write_report
from ..common.validation import check_at_least
from ..errors import ConfigError, show
from .options import add_scheduler_option, open_cluster

if TYPE_CHECKING:
    from ..datasets.dataset import Tasks
    from ..evaluation.evaluator import BatchPredictions, Evaluation

_TABLE, _RESULT = "evaluation.md", "evaluation.json"

# It is part of the name of a file.
_MAX_NAME_LENGTH = 100

_HELP = """\
Score models on the tasks of a training set, next to trivial baselines.

  cbagan-ompl evaluate --dataset DATASET
  cbagan-ompl evaluate --dataset DATASET --model mine.pt --model other.pt --output scores

All scores are those of the region alone: pixels outside both regions are not counted, so that an
empty prediction scores 0. In brackets are 95 % bootstrap intervals, over maps and over the tasks on
them. "connected" is the fraction of tasks whose start and goal the predicted region connects
through free space, with 8 or 4 neighbours of a pixel. The Frechet distance is an FID only with
--inception.

The output folder gets evaluation.json, evaluation.md and, for each prediction but the baselines, a
figure of its best, median and worst cases.
"""


def add_evaluate_parser(commands: Any) -> None:
    """Add the command ``evaluate``; its ``run`` default takes the parsed arguments."""
    parser = commands.add_parser(
        "evaluate",
        help="score models on a training set's tasks",
        description=_HELP,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.set_defaults(run=_evaluate)
    parser.add_argument("--dataset", required=True, metavar="DIR", help="folder of the set")
    parser.add_argument(
        "--model",
        action="append",
        metavar="FILE",
        help="exported model, or the name of a bundled one; may be repeated (default: the default "
        "model)",
    )
    parser.add_argument(
        "--predictions",
        action="append",
        default=[],
        metavar="NAME=DIR",
        help="stored images of regions, green on white, with a results.csv (columns true_roi, "
        "pred_roi) or named as the labels; may be repeated",
    )
    parser.add_argument(
        "--split", choices=("test", "train"), default="test", help="which tasks (default: test)"
    )
    parser.add_argument(
        "--inception",
        metavar="FILE",
        help="TorchScript file of an Inception network (uint8 images (B, 3, 299, 299) to (B, F)), "
        "which makes the Frechet distance an FID",
    )
    parser.add_argument(
        "--seed", type=int, default=0, metavar="N", help="seed of the intervals (default: 0)"
    )
    add_scheduler_option(parser)
    parser.add_argument("--output", metavar="DIR", help="folder for the results and figures")
    parser.add_argument("--json", metavar="FILE", help="write the scores as JSON")


def _evaluate(args: argparse.Namespace) -> int:
    from ..datasets.dataset import load_dataset
    from ..evaluation.baselines import trivial_baselines
    from ..evaluation.evaluator import Evaluator
    from ..evaluation.frechet import (
        INCEPTION_NAME,
        REGION_GRID_NAME,
        inception_features,
        region_features,
    )
    from ..evaluation.report import markdown
    from ..evaluation.stored_predictions import load_predictions
    from ..inference.bundled_models import find_model
    from ..inference.predictor import load_model

    check_at_least("seed", args.seed, 0)
    stored = [_parse_predictions(text) for text in args.predictions]
    files = [find_model(model) for model in args.model or [None]]
    dataset = load_dataset(args.dataset)
    # The models after that: to load them takes a while, and to evaluate them more.
    models = [load_model(path) for path in files]
    names = [str(model.record["name"]) for model in models] + [name for name, _ in stored]
    regions = [load_predictions(path, Path(args.dataset), args.split) for _, path in stored]
    tasks = dataset.test if args.split == "test" else dataset.train
    baselines = trivial_baselines(tasks)
    _check_names([*names, *baselines])
    if args.output is not None:
        _check_outputs(Path(args.output), names, stored, args)
    features, frechet_name = region_features, REGION_GRID_NAME
    if args.inception is not None:
        features, frechet_name = partial(inception_features, path=args.inception), INCEPTION_NAME
    predicted = _predict_remotely(files, tasks, args)
    evaluator = Evaluator(tasks, features, args.seed)
    evaluations = [
        *(
            evaluator.evaluate_model(name, model, regions)
            for name, model, regions in zip(names, models, predicted, strict=False)
        ),
        *(
            evaluator.evaluate(name, predicted)
            for (name, _), predicted in zip(stored, regions, strict=True)
        ),
        *(evaluator.evaluate(name, regions) for name, regions in baselines.items()),
    ]
    table = markdown(evaluations, frechet_name)
    print(f"{len(tasks)} {args.split} tasks of {dataset.name}\n\n{table}")
    result = {
        "dataset": dataset.description(),
        "split": args.split,
        "seed": args.seed,
        "frechet": frechet_name,
        "predictions": {evaluation.name: evaluation.to_dict() for evaluation in evaluations},
    }
    if args.json is not None:
        write_report(args.json, result)
    if args.output is not None:
        _save(Path(args.output), result, table, evaluations[: len(names)], tasks)
    return 0


def _predict_remotely(
    models: list[Path], tasks: Tasks, args: argparse.Namespace
) -> list[BatchPredictions | None]:
    """Return what each model predicts on the cluster; None for each where there is no cluster."""
    from ..evaluation.remote import predict_remotely

    with open_cluster(args) as cluster:
        if cluster is None:
            return [None] * len(models)
        return [predict_remotely(model, tasks, cluster) for model in models]


def _parse_predictions(text: str) -> tuple[str, Path]:
    name, _, folder = text.partition("=")
    if not name or not folder:
        raise ConfigError(f"--predictions takes NAME=DIR, got {show(text)}")
    return name, Path(folder)


def _check_names(names: list[str]) -> None:
    repeated = {name for name in names if names.count(name) > 1}
    if repeated:
        raise ConfigError(f"two predictions are called {', '.join(sorted(repeated))!r}")
    for name in names:
        # It names a file, and a row of a table.
        if (
            any(character in name for character in "/\\|")
            or not name.isprintable()
            or not 0 < len(name) <= _MAX_NAME_LENGTH
        ):
            raise ConfigError(
                f"a prediction cannot be called {show(name)}; choose a name of at most "
                f"{_MAX_NAME_LENGTH} characters without slashes, bars and line breaks"
            )


def _check_outputs(
    folder: Path, names: list[str], stored: list[tuple[str, Path]], args: argparse.Namespace
) -> None:
    """Make the folder of the results; raise if a file in it would be lost, before any work."""
    for source in (args.dataset, *(source for _, source in stored)):
        if folder.exists() and folder.samefile(source):
            raise ConfigError(f"cannot write to {folder}: it is what the command reads")
    if folder.is_dir():
        inputs = [*(args.model or []), *([args.inception] if args.inception else [])]
        for name in (_RESULT, *(f"{name}.png" for name in names)):
            check_output(str(folder / name), inputs, force=args.force)
        # The table does not say what wrote it; its result is ours, if there is one.
        is_ours = (folder / _RESULT).exists()
        check_output(str(folder / _TABLE), inputs, force=args.force or is_ours)
    make_folder(folder)


def _save(
    folder: Path, result: dict[str, Any], table: str, evaluations: list[Evaluation], tasks: Tasks
) -> None:
    from ..evaluation.sample_grid import save_sample_grid

    write_atomically(folder / _TABLE, table)
    write_report(str(folder / _RESULT), result)
    for evaluation in evaluations:
        save_sample_grid(evaluation, tasks, folder / f"{evaluation.name}.png")
