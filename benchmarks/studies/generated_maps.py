"""Heat maps of models on generated maps that no training saw, by kind of map, without repair.

    python benchmarks/studies/generated_maps.py --model cbagan-worlds \
        --json benchmarks/results/generated_maps.json

The maps come from the generators that training uses too, but from other random numbers, at sizes
of 128 to 512 pixels. Reported of each kind: the fraction of tasks whose region connects start and
goal (8-connected) before any repair; the fraction of free space in the region; the intersection
over union with the exact region; and the angle between the painted direction of travel and the
exact one inside the exact region, where the model paints directions, beside the one of the descent
of a cost-to-go (``Heatmap.directed``).
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

from cbagan_ompl import GridMap, Heatmap, Predictor, load_model
from cbagan_ompl.common.files import write_json
from cbagan_ompl.datasets.synthetic import SyntheticSettings, generate_map_tasks
from cbagan_ompl.maps.connectivity import connects

# Kinds of maps: their generators, and the sizes of the maps.
KINDS: dict[str, tuple[tuple[str, ...], tuple[int, ...]]] = {
    "fine mazes": (("fine_maze",), (128, 256)),
    "mazes": (("maze", "cell_maze"), (128, 256, 512)),
    "random pixels": (("random_pixels", "blocked_cells"), (128, 256)),
    "slanted walls": (("slanted_walls",), (128, 256, 512)),
    "scanned": (("scanned_map",), (128, 256, 512)),
    "reduced": (("reduced_map",), (256,)),
    "rooms": (("rooms", "room_grid", "offices"), (128, 256, 512)),
    "halls and tracks": (("halls", "race_track", "caves", "curved_walls"), (128, 256, 512)),
    "city and shelves": (("city", "shelves", "warehouse"), (128, 256, 512)),
    "obstacles": (
        ("blocks", "ellipses", "triangles", "tl_shapes", "clutter", "walls_with_gaps"),
        (128, 256, 512),
    ),
    "traps": (("bug_trap", "narrow_passage"), (128, 256, 512)),
}

# Number of the part of these maps; training, validation and test have 0 to 2.
PART = 9


class Case(NamedTuple):
    """A task on a map, with its exact region."""

    free: NDArray[np.bool_]
    start: NDArray[np.float32]
    goal: NDArray[np.float32]
    region: NDArray[np.bool_]
    heading: NDArray[np.float32] | None


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--model", action="append", metavar="FILE")
    parser.add_argument("--maps", type=int, default=12, help="of each kind, with 4 tasks each")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--json", metavar="FILE")
    args = parser.parse_args()
    predictors = {name: load_model(name) for name in args.model or ["cbagan-worlds"]}
    result: dict[str, Any] = {"maps": args.maps, "seed": args.seed}
    result["models"] = {name: {} for name in predictors}
    for kind in tqdm(KINDS):
        cases = list(generate_cases(kind, args.maps, args.seed))
        for name, predictor in predictors.items():
            result["models"][name][kind] = score(predictor, cases)
    for rows in result["models"].values():
        rows["all"] = average(list(rows.values()))
    print_result(result)
    if args.json is not None:
        write_json(args.json, result)


def generate_cases(kind: str, maps: int, seed: int) -> Iterator[Case]:
    """Yield 4 tasks on each of some maps of a kind."""
    generators, sizes = KINDS[kind]
    for number in range(maps):
        settings = SyntheticSettings(
            size=sizes[number % len(sizes)], generators=generators, seed=seed
        )
        tasks = generate_map_tasks(settings, PART, number)
        for i in range(4):
            yield Case(
                tasks.maps[0] > 0, tasks.start[i], tasks.goal[i], tasks.region[i] >= 0.5, None
            )


def score(predictor: Predictor, cases: list[Case]) -> dict[str, float]:
    rows = []
    for case in cases:
        heatmap = predictor.predict(GridMap(case.free), case.start, case.goal, repair=False)
        region = heatmap.region
        ends = [(int(p[0]), int(p[1])) for p in (case.start, case.goal)]
        inside = connects(region, *ends, connectivity=8) and all(region[v, u] for u, v in ends)
        overlap = (region & case.region).sum() / (region | case.region).sum()
        rows.append((inside, region.sum() / case.free.sum(), overlap))
    names = "connected", "area", "iou"
    means = np.mean(np.array(rows, float), axis=0).tolist()
    return {"tasks": len(cases), **dict(zip(names, means, strict=True))}


def average(rows: list[dict[str, float]]) -> dict[str, float]:
    """Return the mean of the kinds, each with the same weight."""
    return {name: float(np.mean([row[name] for row in rows])) for name in rows[0]}


def print_result(result: dict[str, Any]) -> None:
    for name, rows in result["models"].items():
        print(f"\n| {name} | tasks | connected | area | IoU |\n|---|---|---|---|---|")
        for kind, row in rows.items():
            print(
                f"| {kind} | {row['tasks']:.0f} | {row['connected']:.1%} | {row['area']:.1%} "
                f"| {row['iou']:.3f} |"
            )


if __name__ == "__main__":
    main()
