"""Calibrate the guarantee of a model: from which value on its pixels hold a nearly shortest path.

    python scripts/calibrate.py models/cbagan-worlds.pt --write --json calibration.json

For generated maps of every kind, one task on each, as they are used in training but with other
seeds: the largest threshold at which the free pixels from it on hold a path within 5 % of the
shortest one, and by split conformal calibration the threshold that 95 % of such tasks reach. Its
coverage is then counted on as many other generated maps, and on the maps of files with a table of
tasks. With --write the guarantee goes into the record of the model, its card and its manifest.
"""

from __future__ import annotations

import argparse
from collections import defaultdict
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

from cbagan_ompl import GridMap, load_model
from cbagan_ompl.common.files import write_json
from cbagan_ompl.common.markdown import table
from cbagan_ompl.datasets.synthetic import SyntheticSettings, generate_map_tasks
from cbagan_ompl.evaluation.calibration import (
    conformal_threshold,
    coverage_interval,
    largest_threshold,
)
from cbagan_ompl.inference.bundled_models import find_model
from cbagan_ompl.inference.predictor import Predictor
from cbagan_ompl.map_generators import MAP_GENERATORS
from cbagan_ompl.maps.tasks import load_tasks
from cbagan_ompl.sampling.guarantee import Guarantee

# Numbers of parts that training, validation and the studies do not use.
CALIBRATION_PART, TEST_PART = 5, 6

Thresholds = Mapping[str, NDArray[np.float64]]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("model", metavar="MODEL", help="an exported model")
    parser.add_argument("files", metavar="MAP", nargs="*", help="map files to test on as well")
    parser.add_argument("--tasks", metavar="CSV", help="their tasks")
    parser.add_argument("--maps", type=int, default=100, help="of each kind (default: 100)")
    parser.add_argument("--within", type=float, default=0.05, help="of the path (default: 0.05)")
    parser.add_argument("--probability", type=float, default=0.95, help="(default: 0.95)")
    parser.add_argument("--write", action="store_true", help="write it into the model's record")
    parser.add_argument("--json", metavar="FILE", help="write the figures as JSON")
    args = parser.parse_args()
    path = find_model(args.model)
    predictor = load_model(path)
    calibration = generated_thresholds(predictor, CALIBRATION_PART, args.maps, args.within)
    families = {
        name: conformal_threshold(values, args.probability) for name, values in calibration.items()
    }
    pooled = np.concatenate(list(calibration.values()))
    threshold = conformal_threshold(pooled, args.probability)
    guarantee = Guarantee(threshold, args.probability, args.within, len(pooled), families)
    test = generated_thresholds(predictor, TEST_PART, args.maps, args.within)
    result: dict[str, Any] = {
        "model": predictor.record["name"],
        **guarantee.to_record(),
        "generated": coverage(test, threshold),
        "generated_by_family": {
            name: float((values >= families[name]).mean()) for name, values in test.items()
        },
        "interval": coverage_interval(len(pooled), len(pooled), args.probability),
        "interval_by_family": coverage_interval(args.maps, args.maps, args.probability),
    }
    if args.files:
        result["files"] = coverage(file_thresholds(predictor, args), threshold)
    print_result(result)
    if args.json is not None:
        write_json(args.json, result)
    if args.write:
        from cbagan_ompl.training.export import add_guarantee

        add_guarantee(path, guarantee)


def generated_thresholds(predictor: Predictor, part: int, maps: int, within: float) -> Thresholds:
    """Return the largest thresholds of tasks on generated maps, by kind of map.

    Args:
        predictor: of the heat maps.
        part: of the generated maps.
        maps: of each kind.
        within: as for :func:`largest_threshold`.
    """
    result = {}
    for name in tqdm(MAP_GENERATORS):
        size = int(predictor.record["working_size"])
        settings = SyntheticSettings(size=size, generators=(name,))
        values = []
        for number in range(maps):
            tasks = generate_map_tasks(settings, part, number)
            grid = GridMap(tasks.maps[0], name=name)
            values.append(task_threshold(predictor, grid, tasks.start[0], tasks.goal[0], within))
        result[name] = np.array(values)
    return result


def file_thresholds(predictor: Predictor, args: argparse.Namespace) -> Thresholds:
    """Return the largest thresholds of the tasks of map files, by their family."""
    found: dict[str, list[float]] = defaultdict(list)
    for path in args.files:
        grid = GridMap.load(path)
        for task in load_tasks(args.tasks, grid):
            value = task_threshold(predictor, grid, task.start, task.goal, args.within)
            found[task.family or grid.name].append(value)
    return {family: np.array(values) for family, values in found.items()}


def task_threshold(
    predictor: Predictor, grid: GridMap, start: Any, goal: Any, within: float
) -> float:
    values = predictor.predict(grid, start, goal).values
    (u, v), (x, y) = grid.to_pixel((start, goal)).astype(int).tolist()
    return largest_threshold(values, grid.free, (u, v), (x, y), within)


def coverage(thresholds: Thresholds, threshold: float) -> dict[str, Any]:
    """Return which fraction of the tasks reaches a threshold, over all and by family."""
    return {
        "tasks": int(sum(map(len, thresholds.values()))),
        "all": float((np.concatenate(list(thresholds.values())) >= threshold).mean()),
        "families": {name: float((v >= threshold).mean()) for name, v in thresholds.items()},
    }


def print_result(result: Mapping[str, Any]) -> None:
    low, high = result["interval"]
    print(
        f"threshold {result['threshold']:.3f}; coverage {result['generated']['all']:.3f} of "
        f"{result['generated']['tasks']} generated tasks, expected {low:.3f} to {high:.3f}"
    )
    print(calibration_table(result))
    if "files" in result:
        print(files_table(result))


def calibration_table(result: Mapping[str, Any]) -> str:
    """Return the thresholds and their coverage on generated maps as a table of Markdown."""
    test = result["generated"]
    rows = [("all", f"{result['threshold']:.3f}", f"{test['all']:.1%}", "")]
    for name, own in result["families"].items():
        covered = f"{result['generated_by_family'][name]:.0%}"
        rows.append((name, f"{own:.3f}", f"{test['families'][name]:.0%}", covered))
    header = ("maps", "own threshold", "coverage of that of all", "of the own one")
    return table(header, rows)


def files_table(result: Mapping[str, Any]) -> str:
    """Return the coverage on the maps of files as a table of Markdown."""
    files = result["files"]
    rows = [(name, f"{value:.0%}") for name, value in files["families"].items()]
    return table(("maps", "coverage"), [*rows, (f"all {files['tasks']}", f"{files['all']:.1%}")])


if __name__ == "__main__":
    main()
