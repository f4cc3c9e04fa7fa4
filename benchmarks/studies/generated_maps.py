"""Heat maps of models on generated maps that no training saw, by kind of map, without repair.

    python benchmarks/studies/generated_maps.py --not-learned --model before=OLD.pt \
        --model bundled=cbagan-worlds --json benchmarks/results/generated_maps.json

The maps come from the generators that training uses too, but from other random numbers, at sizes
of 128 to 512 pixels. Reported of each kind: the fraction of tasks whose region connects start and
goal (8-connected) before any repair; the fraction of free space in the region; its intersection
over union with the exact region; the angle in radians between the heading and the exact direction
of travel, median and 90th percentile over the patches in the exact region, for the headings that
the model paints (if it does) and for those of a descent of a cost-to-go (``Heatmap.directed``).

``--not-learned`` adds a network of passages whose costs are all 1 and whose last layer paints
nothing: what is left without any training.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from tqdm import tqdm

from cbagan_ompl import GridMap, Heatmap, Predictor, load_model
from cbagan_ompl.common.files import write_json
from cbagan_ompl.datasets.geodesic_labels import DIRECTION_PATCH
from cbagan_ompl.datasets.synthetic import SyntheticSettings, generate_map_tasks
from cbagan_ompl.maps.connectivity import connects
from cbagan_ompl.networks.config import NetworkConfig
from cbagan_ompl.networks.factory import make_generator
from cbagan_ompl.networks.passage_generator import PassageGenerator
from cbagan_ompl.networks.passage_model import PassageModel

# Kinds of maps: their generators, and the sizes of the maps.
SIZES = (128, 256, 512)
KINDS: dict[str, tuple[tuple[str, ...], tuple[int, ...]]] = {
    "fine mazes": (("fine_maze",), (128, 256)),
    "mazes": (("maze", "cell_maze"), SIZES),
    "random pixels": (("random_pixels", "blocked_cells"), (128, 256)),
    "slanted walls": (("slanted_walls",), SIZES),
    "scanned": (("scanned_map",), SIZES),
    "reduced": (("reduced_map",), (256,)),
    "rooms": (("rooms", "room_grid", "offices"), SIZES),
    "halls and tracks": (("halls", "race_track", "caves", "curved_walls"), SIZES),
    "city and shelves": (("city", "shelves", "warehouse"), SIZES),
    "obstacles": (
        ("blocks", "ellipses", "triangles", "tl_shapes", "clutter", "walls_with_gaps"),
        SIZES,
    ),
    "traps": (("bug_trap", "narrow_passage"), SIZES),
    "inflated": (("offices", "room_grid", "caves", "city", "blocks", "halls"), SIZES),
}

# Number of the part of these maps; training, validation and test have 0 to 2.
PART = 9
TASKS = 4


class Case(NamedTuple):
    """A task on a map, with its exact region and directions (2, h, w) of travel."""

    grid: GridMap
    start: NDArray[np.float32]
    goal: NDArray[np.float32]
    region: NDArray[np.bool_]
    directions: NDArray[np.float32]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--model", action="append", metavar="NAME=FILE", required=True, help="to load, by a name"
    )
    parser.add_argument("--not-learned", action="store_true")
    parser.add_argument("--maps", type=int, default=24, help=f"of each kind, {TASKS} tasks each")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--json", metavar="FILE")
    args = parser.parse_args()
    named = (model.split("=", 1) for model in args.model)
    predictors = {name: load_model(file) for name, file in named}
    if args.not_learned:
        predictors["not learned"] = predictor_without_training()
    result: dict[str, Any] = {"maps": args.maps, "seed": args.seed}
    result["models"] = {name: {} for name in predictors}
    errors: dict[str, list[NDArray[np.float32]]] = {}
    for kind in tqdm(KINDS):
        cases = list(generate_cases(kind, args.maps, args.seed))
        for name, predictor in predictors.items():
            row, painted, descended = score(predictor, cases)
            result["models"][name][kind] = row
            errors.setdefault(f"{name}: painted", []).append(painted)
            errors.setdefault(f"{name}: descent", []).append(descended)
    result["angles"] = {
        name: quantiles(np.concatenate(parts)) for name, parts in errors.items() if parts[0].size
    }
    for name, rows in result["models"].items():
        rows["all"] = {key: mean_of(rows.values(), key) for key in ("connected", "area", "iou")}
        if f"{name}: painted" in result["angles"]:
            rows["all"]["angles"] = result["angles"][f"{name}: painted"]
    print_result(result)
    if args.json is not None:
        write_json(args.json, result)


def predictor_without_training() -> Predictor:
    """Return a network whose costs are 1 and whose last layer paints nothing."""
    config = NetworkConfig(widths=(8, 8), stem=8, patch=4, passages=True, white_obstacles=True)
    generator = make_generator(config).eval()
    assert isinstance(generator, PassageGenerator)
    for layer in (generator.costs, generator.head):
        for weight in layer.parameters():
            torch.nn.init.zeros_(weight)
    methods = ["read_map", "paint"]
    scripted = torch.jit.script(PassageModel(generator).eval())
    module = torch.jit.freeze(scripted, preserved_attrs=methods)
    return Predictor(module, {"working_size": 256, "name": "not learned"})


def generate_cases(kind: str, maps: int, seed: int) -> Iterator[Case]:
    """Yield the tasks on some maps of a kind."""
    generators, sizes = KINDS[kind]
    for number in range(maps):
        settings = SyntheticSettings(
            size=sizes[number % len(sizes)],
            generators=generators,
            inflated_fraction=float(kind == "inflated"),
            seed=seed,
        )
        tasks = generate_map_tasks(settings, PART, number)
        assert tasks.direction is not None
        grid = GridMap(tasks.maps[0] > 0)
        for i in range(TASKS):
            directions = tasks.direction[i].astype(np.float32)
            yield Case(grid, tasks.start[i], tasks.goal[i], tasks.region[i] >= 0.5, directions)


def score(
    predictor: Predictor, cases: list[Case]
) -> tuple[dict[str, float], NDArray[np.float32], NDArray[np.float32]]:
    """Return the scores of a model, and the angles between its headings and the exact ones."""
    rows, painted, descended = [], [], []
    for case in cases:
        heatmap = predictor.predict(case.grid, case.start, case.goal, repair=False)
        region = heatmap.region
        ends = [(int(p[0]), int(p[1])) for p in (case.start, case.goal)]
        inside = all(region[v, u] for u, v in ends) and connects(region, *ends, connectivity=8)
        overlap = (region & case.region).sum() / (region | case.region).sum()
        rows.append((inside, region.sum() / case.grid.free.sum(), overlap))
        if heatmap.heading is not None:
            painted.append(angles(heatmap, case))
        descended.append(angles(heatmap.directed(case.goal), case))
    means = np.mean(np.array(rows, float), axis=0).tolist()
    result = {"tasks": len(cases), **dict(zip(("connected", "area", "iou"), means, strict=True))}
    painted_angles, descended_angles = (
        np.concatenate(parts) if parts else np.empty(0, np.float32)
        for parts in (painted, descended)
    )
    if len(painted_angles):
        result["angles"] = quantiles(painted_angles)
    return result, painted_angles, descended_angles


def angles(heatmap: Heatmap, case: Case) -> NDArray[np.float32]:
    """Return the angles between headings and exact directions, in the patches of the region."""
    assert heatmap.heading is not None
    exact = case.directions
    rows, columns = (DIRECTION_PATCH * n for n in exact.shape[1:])
    blocks = case.region[:rows, :columns].reshape(exact.shape[1], 4, exact.shape[2], 4)
    chosen = (blocks.mean(axis=(1, 3)) > 0.5) & (np.hypot(*exact) > 0.5)
    error: NDArray[np.float32] = np.full((*exact.shape[1:], 4, 4), np.nan, np.float32)
    heading = heatmap.heading[:rows, :columns].reshape(exact.shape[1], 4, exact.shape[2], 4)
    difference = heading.transpose(0, 2, 1, 3) - np.arctan2(exact[1], exact[0])[..., None, None]
    error = np.abs((difference + np.pi) % (2 * np.pi) - np.pi)
    # A patch without a heading counts as one in a random direction.
    known = ~np.isnan(error)
    mean = np.where(known, error, 0).sum((2, 3)) / np.maximum(known.sum((2, 3)), 1)
    return np.where(known.any((2, 3)), mean, np.float32(np.pi / 2))[chosen].astype(np.float32)


def quantiles(values: NDArray[np.float32]) -> dict[str, float]:
    return {"median": float(np.median(values)), "p90": float(np.quantile(values, 0.9))}


def mean_of(rows: Any, key: str) -> float:
    """Return the mean over the kinds, each with the same weight."""
    return float(np.mean([row[key] for row in rows]))


def print_result(result: dict[str, Any]) -> None:
    for name, rows in result["models"].items():
        print(
            f"\n| {name} | connected | area | IoU | angle, median and 90 % |\n|---|---|---|---|---|"
        )
        for kind, row in rows.items():
            angle = row.get("angles")
            text = f"{angle['median']:.3f} {angle['p90']:.3f}" if angle else ""
            print(
                f"| {kind} | {row['connected']:.1%} | {row['area']:.1%} | {row['iou']:.3f} "
                f"| {text} |"
            )
    for name, angle in result["angles"].items():
        print(f"{name}: {angle['median']:.3f} {angle['p90']:.3f}")


if __name__ == "__main__":
    main()
