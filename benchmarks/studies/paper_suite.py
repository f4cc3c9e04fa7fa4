r"""Tasks of the paper's data set for `cbagan-ompl benchmark`.

    python benchmarks/studies/paper_suite.py DATASET --tasks 30 --output paper-suite \
        --run @benchmarks/suites/paper.args --model paper-trained=cbagan --output results

DATASET is the folder of the published (map, point, ROI) set. Some of its test tasks are chosen at
random and written as tasks.csv. The stored predictions, where they come with the set, are written
as heat maps of a sampler "sagan-stored". tasks.args has the arguments of the benchmark. With --run
the benchmark is run on these tasks, with the arguments after it.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from cbagan_ompl.cli import main as benchmark
from cbagan_ompl.datasets.dataset import Dataset, load_dataset
from cbagan_ompl.datasets.writing import write_csv
from cbagan_ompl.evaluation.stored_predictions import load_predictions

STORED = "sagan_test_predictions"
COLUMNS = ("map", "start_x", "start_y", "goal_x", "goal_y", "family")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("dataset", metavar="DATASET", type=Path)
    parser.add_argument("--tasks", type=int, default=100, help="number of tasks (default: 100)")
    parser.add_argument("--seed", type=int, default=0, help="of the choice of tasks (default: 0)")
    parser.add_argument("--output", type=Path, required=True, metavar="DIR")
    parser.add_argument("--run", nargs=argparse.REMAINDER, default=[], metavar="ARGUMENT")
    args = parser.parse_args()
    dataset = load_dataset(args.dataset)
    rng = np.random.default_rng(args.seed)
    chosen = rng.choice(len(dataset.test), args.tasks, replace=False)
    # The benchmark numbers the tasks of each map in the order of the file.
    chosen = chosen[np.argsort(dataset.test.map_of[chosen], kind="stable")]
    names = map_names(dataset, chosen)
    endpoints = [(*dataset.test.start[i].tolist(), *dataset.test.goal[i].tolist()) for i in chosen]
    rows = [(name, *points, original(name)) for name, points in zip(names, endpoints, strict=True)]
    args.output.mkdir(parents=True, exist_ok=True)
    write_csv(args.output / "tasks.csv", COLUMNS, rows)
    arguments = [str(args.dataset / "maps" / f"{name}.png") for name in dict.fromkeys(names)]
    arguments += ["--tasks", str(args.output / "tasks.csv")]
    if (args.dataset / STORED).is_dir():
        write_heatmaps(args.dataset, args.output / STORED, chosen, names)
        arguments += ["--heatmap-dir", f"sagan-stored={args.output / STORED}"]
    (args.output / "tasks.args").write_text("\n".join(arguments) + "\n", encoding="utf-8")
    if args.run:
        raise SystemExit(benchmark(["benchmark", f"@{args.output / 'tasks.args'}", *args.run]))


def map_names(dataset: Dataset, chosen: np.ndarray) -> list[str]:
    """Return the name of the map of each task."""
    return [f"map_{dataset.map_numbers[k]}" for k in dataset.test.map_of[chosen]]


def original(name: str) -> str:
    """Return the original that a map is a copy of: ten each, in the order of their numbers."""
    return f"original {int(name.removeprefix('map_')) // 10}"


def write_heatmaps(dataset: Path, folder: Path, chosen: np.ndarray, names: list[str]) -> None:
    """Write the stored region of each task as an array that ``--heatmap-dir`` reads."""
    folder.mkdir(exist_ok=True)
    regions = load_predictions(dataset / STORED, dataset, "test")
    for row, (i, name) in enumerate(zip(chosen, names, strict=True)):
        number = row - names.index(name)
        # Outside the region a little is left, so that every free pixel can be sampled.
        values = np.where(regions[i], 1.0, 1e-4).astype(np.float32)
        np.save(folder / f"{name}_{number}.npy", values)


if __name__ == "__main__":
    main()
