r"""Train the paper's networks with the same budget and collect their scores.

    python benchmarks/studies/train_networks.py DATASET --output runs \
        --json benchmarks/results/networks.json

CBAGAN and SAGAN are trained with three seeds, the ablations with one. Each run has a folder of
its own; complete runs are not repeated, an interrupted one is resumed.
"""

from __future__ import annotations

import argparse
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from typing import Any

from trainings import run_scores

from cbagan_ompl.common.files import write_json
from cbagan_ompl.datasets.dataset import load_dataset
from cbagan_ompl.training.config import TrainingConfig
from cbagan_ompl.training.task_sources import DatasetSource

SEEDS = {"cbagan": (0, 1, 2), "sa": (0,), "ca": (0,), "none": (0,), "sagan": (0, 1, 2)}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("dataset", metavar="DATASET")
    parser.add_argument("--output", type=Path, required=True, metavar="DIR")
    parser.add_argument("--epochs", type=int, default=10, help="the budget (default: 10)")
    parser.add_argument("--device", default="auto")
    parser.add_argument("--json", metavar="FILE")
    args = parser.parse_args()
    dataset = load_dataset(args.dataset)
    result: dict[str, Any] = {"epochs": args.epochs, "test": {}}
    for network, seeds in SEEDS.items():
        for seed in seeds:
            config = replace(TrainingConfig().with_network(network), epochs=args.epochs, seed=seed)
            folder = args.output / f"{network}-{seed}"
            source = DatasetSource(dataset, config.validation_fraction, config.seed)
            scores = run_scores(folder, config, nullcontext(source), args.device)
            print(f"{network}, seed {seed}: IoU {scores['iou']:.4f}, Dice {scores['dice']:.4f}")
            result["test"].setdefault(network, {})[str(seed)] = scores
    if args.json is not None:
        write_json(args.json, result)


if __name__ == "__main__":
    main()
