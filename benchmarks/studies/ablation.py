r"""Attention and adversary of the bundled network: trainings with and without, several seeds each.

    python benchmarks/studies/ablation.py --output runs --json benchmarks/results/ablation.json

All trainings have the recipe `synthetic`, with fewer epochs and maps, and see the same maps in the
same epochs; a seed gives the first weights, the order of the tasks and the noise. Each run has a
folder of its own: complete runs are not repeated, an interrupted one is resumed. Scores are those
of the best epoch on test tasks that no training has seen.

Reported of each variant: the scores of each seed; the mean IoU over the seeds; and the mean of the
differences from the whole network with the same seed. Intervals are Student's, 95 %.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import numpy as np
from trainings import run_scores, student_interval

from cbagan_ompl.common.files import write_json
from cbagan_ompl.datasets.synthetic import SyntheticSettings
from cbagan_ompl.training.config import TrainingConfig
from cbagan_ompl.training.task_sources import SyntheticSchedule, synthetic_source

NO_ATTENTION = {"channel_attention": False, "spatial_attention": False}
NO_ADVERSARY = {"adversarial_weight": 0.0}
WHOLE = "whole"
VARIANTS: dict[str, dict[str, Any]] = {
    WHOLE: {},
    "without attention": NO_ATTENTION,
    "without adversary": NO_ADVERSARY,
    "with neither": {**NO_ATTENTION, **NO_ADVERSARY},
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--output", type=Path, required=True, metavar="DIR")
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--epochs", type=int, default=4)
    parser.add_argument("--maps", type=int, default=256, help="of each epoch (default: 256)")
    parser.add_argument("--held-out", type=int, default=64, help="maps of the test (default: 64)")
    parser.add_argument("--device", default="auto")
    parser.add_argument("--json", type=Path, metavar="FILE")
    args = parser.parse_args()
    recipe = TrainingConfig.preset("synthetic").updated({"epochs": args.epochs})
    schedule = SyntheticSchedule(args.maps, args.held_out)
    scores: dict[str, list[dict[str, float]]] = {name: [] for name in VARIANTS}
    for seed in range(args.seeds):
        for name, changes in VARIANTS.items():
            config = recipe.updated({"seed": seed, **changes})
            folder = args.output / f"{name.replace(' ', '-')}-{seed}"
            source = synthetic_source(SyntheticSettings(), schedule)
            scores[name].append(run_scores(folder, config, source, args.device))
            print(f"{name}, seed {seed}: IoU {scores[name][-1]['iou']:.4f}", flush=True)
    if args.json is not None:
        settings = {"epochs": args.epochs, "maps": args.maps, "held_out": args.held_out}
        write_json(args.json, {"settings": settings, "variants": summarize(scores)})


def summarize(scores: dict[str, list[dict[str, float]]]) -> dict[str, Any]:
    """Return the scores of each variant with their means, and the differences from the whole."""
    whole = [run["iou"] for run in scores[WHOLE]]
    result = {}
    for name, runs in scores.items():
        ious = [run["iou"] for run in runs]
        result[name] = {"seeds": runs, "iou": student_interval(ious)}
        if name != WHOLE:
            result[name]["difference"] = student_interval(np.subtract(ious, whole).tolist())
    return result


if __name__ == "__main__":
    main()
