"""The recipe for own maps, followed: what does refining the bundled model on a map bring there?

    python benchmarks/studies/refinement.py MAP... --output refined --json refinement.json

For each map 200 tasks with exact labels are made, half of them hard, and the bundled model is
refined on one half of them and scored on the other, as docs/training.md says. The seconds of each
step are reported, and of each command only the scores that it writes itself.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
from pathlib import Path
from time import perf_counter
from typing import Any

from cbagan_ompl.common.files import write_json

BUNDLED, REFINED = "cbagan-worlds", "refined"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("maps", nargs="+", type=Path, metavar="MAP")
    parser.add_argument("--output", type=Path, required=True, metavar="DIR")
    parser.add_argument("--tasks", type=int, default=200)
    parser.add_argument("--seeds", type=int, default=3, help="trainings for each map (default: 3)")
    parser.add_argument("--set", nargs="*", default=[], metavar="KEY=VALUE", help="of the recipe")
    parser.add_argument("--json", type=Path, required=True, metavar="FILE")
    args = parser.parse_args()
    rows = [follow_recipe(path, args) for path in args.maps]
    write_json(args.json, {"tasks": args.tasks, "seeds": args.seeds, "maps": rows})


def follow_recipe(path: Path, args: argparse.Namespace) -> dict[str, Any]:
    """Return the scores of the bundled model and of the refined ones, on one map."""
    folder = args.output / path.stem
    tasks = folder / "set"
    seconds = {
        "label": timed(
            *("dataset", "label", str(path), "--output", str(tasks), "--tasks", str(args.tasks)),
            *("--seed", "2", "--hard-fraction", "0.5", "--test-fraction", "0.5"),
        )
    }
    models, trained = [], 0.0
    for seed in range(args.seeds):
        run, model = folder / f"run-{seed}", folder / f"{REFINED}-{seed}.pt"
        recipe = [f"seed={seed}", *args.set]
        trained += timed(
            *("train", str(tasks), "--preset", "refine", "--start-from", BUNDLED),
            *("--set", *recipe, "--output", str(run)),
        )
        timed("export", str(run / "best.pt"), "--output", str(model))
        models += ["--model", str(model)]
    seconds["train"] = trained / args.seeds
    report = folder / "evaluation.json"
    timed("evaluate", "--dataset", str(tasks), "--model", BUNDLED, *models, "--json", str(report))
    scores = json.loads(report.read_text(encoding="utf-8"))["predictions"]
    return {"map": path.name, "seconds": seconds, "scores": scores}


def timed(*words: str) -> float:
    """Return the seconds that a command takes; it must succeed."""
    began = perf_counter()
    subprocess.run([sys.executable, "-m", "cbagan_ompl.cli", *words], check=True)
    return perf_counter() - began


if __name__ == "__main__":
    main()
