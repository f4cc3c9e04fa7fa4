r"""The paper's networks with the paper's recipe: scores of their regions, and what they bring RRT.

    python benchmarks/studies/paper_networks.py DATASET --output runs \
        --json benchmarks/results/paper_networks.json

Each network is trained with the preset `paper`, with several seeds; and CBAGAN once more without
the discriminators, which the paper names as future work. Each run has a folder of its own: complete
runs are not repeated, an interrupted one is resumed. Then RRT runs once on every test task for each
of them, as in paper_tables.py. With --timing each network is trained for one epoch more, on one
thread of the CPU, for the time of an epoch.

The scores are those of the region alone, of the best epoch on the test tasks. Beside them is the
share of pixels that are right in both classes, which is the Dice score where the background counts
as well: the paper's way.
"""

from __future__ import annotations

import argparse
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import torch
from paper_tables import PLAIN, run_all, samplers_of, summary
from trainings import run_scores, student_interval

from cbagan_ompl import load_model
from cbagan_ompl.common.files import write_json
from cbagan_ompl.datasets.dataset import Dataset, load_dataset
from cbagan_ompl.networks.factory import make_generator
from cbagan_ompl.training.checkpoints import load_checkpoint
from cbagan_ompl.training.config import BEST, TrainingConfig
from cbagan_ompl.training.export import export
from cbagan_ompl.training.loop import train
from cbagan_ompl.training.task_sources import DatasetSource

#: The network of each row, and what is changed in the preset.
VARIANTS: dict[str, tuple[str, dict[str, Any]]] = {
    **{name: (name, {}) for name in ("cbagan", "sa", "ca", "none", "sagan")},
    "segmentation": ("cbagan", {"adversarial_weight": 0.0}),
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("dataset", metavar="DATASET")
    parser.add_argument("--output", type=Path, required=True, metavar="DIR")
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--epochs", type=int, help="fewer than the paper's 20")
    parser.add_argument("--tasks", type=int, help="RRT on so many of the test tasks only")
    parser.add_argument("--timing", action="store_true", help="measure the time of an epoch")
    parser.add_argument("--device", default="auto")
    parser.add_argument("--json", metavar="FILE")
    args = parser.parse_args()
    dataset = load_dataset(args.dataset)
    networks = {}
    for name in VARIANTS:
        config = recipe(name, args.epochs)
        runs = []
        for seed in range(args.seeds):
            folder = args.output / f"{name}-{seed}"
            runs.append(
                measure(folder, config.updated({"seed": seed}), dataset, args.tasks, args.device)
            )
            print(f"{name}, seed {seed}: {runs[-1]}", flush=True)
        parameters = sum(p.numel() for p in make_generator(config.network).parameters())
        networks[name] = {"parameters": parameters, "seeds": runs, **over_seeds(runs)}
        if args.timing:
            networks[name]["epoch_s"] = epoch_seconds(args.output / f"{name}-timing", name, dataset)
    if args.json is not None:
        epochs = recipe("cbagan", args.epochs).epochs
        write_json(args.json, {"preset": "paper", "epochs": epochs, "networks": networks})


def recipe(name: str, epochs: int | None) -> TrainingConfig:
    """Return the recipe of a row."""
    network, changes = VARIANTS[name]
    config = TrainingConfig.preset("paper").with_network(network).updated(changes)
    return config if epochs is None else config.updated({"epochs": epochs})


def measure(
    folder: Path, config: TrainingConfig, dataset: Dataset, tasks: int | None, device: str
) -> dict[str, Any]:
    """Return the scores of a run, and the medians of RRT with its model and with OMPL's sampler."""
    source = DatasetSource(dataset, config.validation_fraction, config.seed)
    scores = run_scores(folder, config, nullcontext(source), device)
    export(folder / BEST, folder / "model.pt")
    samplers = {"uniform": {"sampler": "uniform"}} | samplers_of(
        "model", load_model(folder / "model.pt")
    )
    jobs = [(i, i) for i in range(len(dataset.test))[:tasks]]
    planned = summary(run_all(dataset.test, jobs, samplers))
    return {
        "epoch": load_checkpoint(folder / BEST)["history"][-1]["epoch"],
        "scores": scores,
        "right_pixels": right_pixels(scores, float(dataset.test.region.mean())),
        "uniform": planned["uniform"],
        "adapted": planned["model"],
        "plain": planned[f"model{PLAIN}"],
    }


def over_seeds(runs: list[dict[str, Any]]) -> dict[str, list[float]]:
    """Return means over the seeds, with Student's intervals."""
    values = {
        "iou": [run["scores"]["iou"] for run in runs],
        "dice": [run["scores"]["dice"] for run in runs],
        "connectivity": [run["scores"]["connectivity"] for run in runs],
        "right_pixels": [run["right_pixels"] for run in runs],
        "plain_nodes_ratio": [run["plain"]["nodes_ratio"][0] for run in runs],
        "adapted_nodes_ratio": [run["adapted"]["nodes_ratio"][0] for run in runs],
    }
    return {name: student_interval(each) for name, each in values.items()}


def right_pixels(scores: dict[str, float], region: float) -> float:
    """Return the share of pixels whose class is right.

    Args:
        scores: precision and recall, pooled over all pixels.
        region: share of pixels in the true regions.

    Example:
        >>> right_pixels({"precision": 0.5, "recall": 1.0}, 0.1)
        0.9
    """
    found = scores["recall"] * region
    too_many = found / scores["precision"] - found if found else 0.0
    return 1 - (region - found) - too_many


def epoch_seconds(folder: Path, name: str, dataset: Dataset) -> float:
    """Return how long an epoch takes on one thread of the CPU, its validation included."""
    config = recipe(name, 1)
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    if not (folder / BEST).exists():
        source = DatasetSource(dataset, config.validation_fraction, config.seed)
        train(source, config, folder, device="cpu", progress=False)
    torch.set_num_threads(threads)
    seconds: float = load_checkpoint(folder / BEST)["history"][0]["seconds"]
    return seconds


if __name__ == "__main__":
    main()
