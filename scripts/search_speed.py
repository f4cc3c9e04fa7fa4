"""The speed of the grid search, and of the network beside it.

    python scripts/search_speed.py --json benchmarks/results/search_speed.json

On random maps of each size the rows take turns on the same tasks: the path alone, the heat map
``corridor``, the repair of a heat map whose region is cut in two, and ``learned``, the prediction
of the bundled model. Times are those of the processor (one thread, so that other work does not
count), medians over all tasks; a ratio is the median of the ratios on each task.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Mapping
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np

from cbagan_ompl import GridMap, Heatmap, load_model
from cbagan_ompl.common.markdown import table
from cbagan_ompl.map_generators import MAP_GENERATORS
from cbagan_ompl.maps.grid_search import prepare_search, shortest_path

GENERATORS = ("offices", "caves", "clutter", "city", "halls", "blocked_cells")
SIZES = [64, 128, 256, 512, 1024, 1448, 2048]
ROWS = ("path", "corridor", "repair", "learned")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sizes", type=int, nargs="+", default=SIZES)
    parser.add_argument("--tasks", type=int, default=2, help="tasks on each map (default: 2)")
    parser.add_argument("--json", metavar="FILE", help="write the figures as JSON")
    args = parser.parse_args()
    prepare_search(with_costs=True)
    model = load_model()
    result: dict[str, Any] = {"generators": GENERATORS, "tasks_per_map": args.tasks, "sizes": {}}
    for size in args.sizes:
        times: list[dict[str, float]] = []
        for seed, name in enumerate(GENERATORS):
            rng = np.random.default_rng(seed)
            grid = GridMap(MAP_GENERATORS[name](rng, size, size), name=name)
            times += [measure(grid, make_task(grid, rng), model) for _ in range(args.tasks)]
        result["sizes"][str(size)] = summarize(times)
        print_rows(size, result["sizes"][str(size)])
        if args.json:  # after each size: large maps take minutes
            Path(args.json).write_text(json.dumps(result, indent=1) + "\n")


def make_task(grid: GridMap, rng: np.random.Generator) -> tuple[Any, Any]:
    """Return a start and a goal at random, at least a third of the side apart."""
    pixels = np.argwhere(grid.free)[:, ::-1] + 0.5
    while True:
        start, goal = rng.choice(pixels, 2)
        if np.hypot(*(goal - start)) > grid.width / 3:
            return start, goal


def measure(grid: GridMap, task: tuple[Any, Any], model: Any) -> dict[str, float]:
    """Return the milliseconds of each step of a task, and the lengths of the paths."""
    broken = cut_in_two(Heatmap.corridor(grid, *task), task)
    start, goal = (tuple(int(x) for x in point) for point in task)
    work: dict[str, Callable[[], object]] = {
        "path": lambda: shortest_path(grid.free, start, goal),
        "corridor": lambda: Heatmap.corridor(grid, *task),
        "repair": lambda: broken.connected(*task),
        "learned": lambda: model.predict(grid, *task),
    }
    return {row: milliseconds(work[row]) for row in ROWS}


def milliseconds(work: Callable[[], object], repeats: int = 3) -> float:
    """Return the shortest of some times."""
    times = []
    for _ in range(repeats):
        began = process_time()
        work()
        times.append(1000 * (process_time() - began))
    return min(times)


def cut_in_two(heatmap: Heatmap, task: tuple[Any, Any]) -> Heatmap:
    """Return a heat map without what is nearly as far from the start as from the goal."""
    height, width = heatmap.values.shape
    u, v = np.meshgrid(np.arange(width), np.arange(height))
    start, goal = (np.hypot(u - x, v - y) for x, y in task)
    away = np.abs(start - goal) < 0.1 * (start + goal).min()
    return Heatmap(np.where(away, np.float32(0.1), heatmap.values), heatmap.grid)


def summarize(times: list[dict[str, float]]) -> dict[str, Any]:
    medians = {row: float(np.median([time[row] for time in times])) for row in ROWS}
    ratio = float(np.median([time["learned"] / time["corridor"] for time in times]))
    return {"ms": medians, "learned_to_corridor": ratio}


def speed_table(result: Mapping[str, Any]) -> str:
    """Return the figures as Markdown; ``result`` is what ``--json`` writes."""
    rows = []
    for size, summary in result["sizes"].items():
        cells = [f"{summary['ms'][row]:.3g}" for row in ROWS]
        rows.append([f"{size} px", *cells, f"{summary['learned_to_corridor']:.2f}"])
    return table(["side", *ROWS, "learned / corridor"], rows)


def print_rows(size: int, summary: dict[str, Any]) -> None:
    cells = ", ".join(f"{row} {summary['ms'][row]:.2f} ms" for row in ROWS)
    ratio = summary["learned_to_corridor"]
    print(f"{size:5} px: {cells}; learned / corridor {ratio:.2f}", flush=True)


if __name__ == "__main__":
    main()
