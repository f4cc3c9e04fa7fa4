"""Heat maps of a model on maps that it has not seen: connectivity, time, and the cost of errors.

    python benchmarks/studies/unseen_maps.py MAPS/png/*.png --tasks MAPS/tasks.csv \
        --json benchmarks/results/unseen_maps_ompl_2.0.1.json

Three parts, each over all tasks:

* whether the region connects start and goal (8-connectivity), before and after the repair, and its
  fraction of free space;
* inference and repair, medians in milliseconds on one thread, beside one call of a SAGAN of the
  paper's size at the same resolution;
* RRT with heat maps that are wrong on purpose: time to the first path and fraction of solved tasks,
  in turns with OMPL's own sampler.
"""

from __future__ import annotations

import argparse
from collections import defaultdict
from collections.abc import Callable
from functools import partial
from time import perf_counter
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from tqdm import tqdm

from cbagan_ompl import GridMap, Heatmap, PlanResult, Predictor, load_model, plan
from cbagan_ompl.benchmarking.tasks import BenchmarkTask, select_tasks
from cbagan_ompl.common.files import write_json
from cbagan_ompl.maps.connectivity import in_one_component
from cbagan_ompl.networks.config import NetworkConfig
from cbagan_ompl.networks.export_model import RegionModel
from cbagan_ompl.networks.factory import make_generator
from cbagan_ompl.planning.compat import ompl_version
from cbagan_ompl.sampling.pixels import pixel_pair

RANGE, TIME = 20.0, 2.0
Endpoints = tuple[NDArray[np.float64], NDArray[np.float64]]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("maps", nargs="+", metavar="MAP")
    parser.add_argument("--tasks", metavar="FILE")
    parser.add_argument("--model", metavar="FILE")
    parser.add_argument("--runs", type=int, default=3, help="of RRT with each heat map")
    parser.add_argument("--json", metavar="FILE")
    args = parser.parse_args()
    predictor = load_model(args.model)
    tasks = select_tasks(args.maps, args.tasks).tasks
    regions, timings = predict_regions(predictor, tasks)
    for network in ("cbagan", "sagan"):
        size = int(predictor.record["working_size"])
        timings[f"{network}_ms"] = paper_network_ms(network, size)
    wrong = plan_with_wrong_heatmaps(predictor, tasks, args.runs)
    result = {"ompl": ompl_version(), "tasks": len(tasks), "regions": regions}
    result |= {"timings": timings, "wrong_heatmaps": wrong}
    print_result(result)
    if args.json is not None:
        write_json(args.json, result)


def predict_regions(
    predictor: Predictor, tasks: list[BenchmarkTask]
) -> tuple[dict[str, dict[str, float]], dict[str, float]]:
    """Return connectivity and size of the regions by kind of map, and the times of prediction."""
    rows, times = defaultdict(list), defaultdict(list)
    for one in tqdm(tasks, desc="regions"):
        grid, endpoints = one.grid, endpoints_of(one)
        predictor.predict(grid, *endpoints)  # the first call of a size takes longer
        raw = timed(times["inference_ms"], predictor.predict, grid, *endpoints, repair=False)
        is_connected = raw.connects(*endpoints)
        repaired = timed(
            times["kept_ms" if is_connected else "repair_ms"], raw.connected, *endpoints
        )
        timed(times["total_ms"], predictor.predict, grid, *endpoints)
        fraction = raw.region.sum() / grid.free.sum()
        row = (connects(raw, *endpoints), connects(repaired, *endpoints), float(fraction))
        rows[one.task.family or "all"].append(row)
    rows["all"] = [row for family in rows.values() for row in family]
    names = ("connected", "connected_after_repair", "share_of_free_space")
    regions = {
        family: {"tasks": len(values), **dict(zip(names, np.mean(values, 0).tolist(), strict=True))}
        for family, values in sorted(rows.items())
    }
    return regions, {name: float(np.median(values)) for name, values in times.items()}


def connects(heatmap: Heatmap, start: NDArray[np.float64], goal: NDArray[np.float64]) -> bool:
    """Return whether the region contains start and goal and an 8-connected path between them."""
    pixels = pixel_pair(heatmap.grid.to_pixel((start, goal)))
    return in_one_component(heatmap.region, *pixels, connectivity=8)


def timed(times: list[float], work: Callable[..., Any], *arguments: Any, **options: Any) -> Any:
    began = perf_counter()
    result = work(*arguments, **options)
    times.append(1e3 * (perf_counter() - began))
    return result


def paper_network_ms(network: str, size: int, calls: int = 5) -> float:
    """Return the time of one call of a network of the paper's size; its weights do not matter."""
    config = NetworkConfig().variant(network)
    module = torch.jit.freeze(torch.jit.script(RegionModel(make_generator(config)).eval()))
    predictor = Predictor(module, {"working_size": size, "name": network})
    free, points = np.ones((1, size, size), bool), np.array([[10.0, 10.0]])
    predictor.probabilities(free, points, points + size / 2)
    times: list[float] = []
    for _ in range(calls):
        timed(times, predictor.probabilities, free, points, points + size / 2)
    return float(np.median(times))


def endpoints_of(one: BenchmarkTask) -> Endpoints:
    return one.grid.check_task(one.task.start, one.task.goal)


def wrong_heatmaps(
    predictor: Predictor, grid: GridMap, endpoints: Endpoints, rng: np.random.Generator
) -> dict[str, NDArray[np.float32]]:
    """Return the values of heat maps that are wrong on purpose."""
    values = predictor.predict(grid, *endpoints).values
    height, width = grid.shape
    rows, columns = np.nonzero(grid.free)
    pixel = np.zeros(grid.shape, np.float32)
    chosen = rng.integers(len(rows))
    pixel[rows[chosen], columns[chosen]] = 1
    return {
        "right": values,
        "inverted": np.where(grid.free, 1 - values, 0).astype(np.float32),
        "shifted by a quarter": np.roll(values, (height // 4, width // 4), (0, 1)),
        "mirrored": values[::-1, ::-1],
        "noise": rng.random(grid.shape, np.float32),
        "one pixel": pixel,
    }


def plan_with_wrong_heatmaps(
    predictor: Predictor, tasks: list[BenchmarkTask], runs: int
) -> dict[str, dict[str, float]]:
    """Return planning time, without inference, and success of RRT by the kind of heat map."""
    rng = np.random.default_rng(0)
    first, solved = defaultdict(list), defaultdict(list)
    for one in tqdm(tasks, desc="wrong heat maps"):
        grid, endpoints = one.grid, endpoints_of(one)
        maps = wrong_heatmaps(predictor, grid, endpoints, rng)
        solvers = {"uniform": partial(plan, sampler="uniform")}
        for kind, values in maps.items():
            if (values[grid.free] > 0).any():
                solvers[kind] = partial(plan, heatmap=Heatmap(np.ascontiguousarray(values), grid))
        results = defaultdict(list)
        for seed in range(runs):
            for kind, solver in solvers.items():
                results[kind].append(
                    solver(grid, *endpoints, planner="RRT", range=RANGE, time=TIME, seed=seed)
                )
        for kind, done in results.items():
            own = np.median(first_paths(results["uniform"]))
            first[kind].append(np.median(first_paths(done)) / own)
            solved[kind].append(np.mean([r.solved for r in done]))
    return {
        kind: {
            "tasks": len(ratios),
            "first_path_ratio": float(np.median(ratios)),
            "solved": float(np.mean(solved[kind])),
        }
        for kind, ratios in first.items()
    }


def first_paths(done: list[PlanResult]) -> list[float]:
    """Return the planning time to the first path, seconds; the limit for runs without one."""
    return [r.first_solution_s if r.solved else TIME for r in done]


def print_result(result: dict[str, Any]) -> None:
    print("| maps | tasks | connected | after repair | fraction of free space |")
    print("|---|---|---|---|---|")
    for family, row in result["regions"].items():
        fractions = [row[k] for k in ("connected", "connected_after_repair", "share_of_free_space")]
        print(
            f"| {family} | {row['tasks']} | {' | '.join(f'{value:.0%}' for value in fractions)} |"
        )
    print("\nmilliseconds:", {name: round(value, 1) for name, value in result["timings"].items()})
    print("\n| heat map | first path, ratio to OMPL's | solved |\n|---|---|---|")
    for kind, row in result["wrong_heatmaps"].items():
        print(f"| {kind} | {row['first_path_ratio']:.2f} | {row['solved']:.1%} |")


if __name__ == "__main__":
    main()
