"""The speed of the grid search: compiled and by SciPy, and of the network beside it.

    python scripts/search_speed.py --json benchmarks/results/search_speed.json

On random maps of each size the two searches take turns on the same tasks: for the path alone, for
the heat map ``corridor``, and for the repair of a heat map whose region is cut in two. ``learned``
is the prediction of the bundled model. Times are those of the processor (one thread, so that other
work does not count), medians over all tasks; a ratio is the median of the ratios on each task.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Mapping
from pathlib import Path
from time import process_time
from typing import Any
from unittest.mock import patch

import numpy as np

from cbagan_ompl import GridMap, Heatmap, load_model
from cbagan_ompl.common.markdown import table
from cbagan_ompl.map_generators import MAP_GENERATORS
from cbagan_ompl.maps import grid_search
from cbagan_ompl.maps.grid_search import COMPILED, SCIPY, prepare_search, pull_taut, shortest_path

GENERATORS = ("offices", "caves", "clutter", "city", "halls", "blocked_cells")
ROWS = ("path", "corridor", "repair")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sizes", type=int, nargs="+", default=[256, 512, 1024, 2048])
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
    if args.json:
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
    values: dict[str, float] = {"learned": milliseconds(lambda: model.predict(grid, *task))}
    for kind in (COMPILED, SCIPY):
        with patch.object(grid_search, "_load_compiled", loader(kind)):
            paths: list[Any] = []
            values[f"path {kind}"] = milliseconds(
                lambda paths=paths: paths.append(shortest_path(grid.free, start, goal))  # type: ignore[misc]
            )
            values[f"corridor {kind}"] = milliseconds(lambda: Heatmap.corridor(grid, *task))
            values[f"repair {kind}"] = milliseconds(lambda: broken.connected(*task))
            taut = pull_taut(grid.free, paths[0])
            values[f"length {kind}"] = float(np.hypot(*np.diff(taut, axis=0).T).sum())
    return values


def loader(kind: str) -> Callable[[], Any]:
    return grid_search._load_compiled if kind == COMPILED else lambda: None


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
    medians = {key: float(np.median([row[key] for row in times])) for key in times[0]}
    ratios = {
        row: float(np.median([t[f"{row} {SCIPY}"] / t[f"{row} {COMPILED}"] for t in times]))
        for row in (*ROWS, "length")
    }
    learned = float(np.median([t["learned"] / t[f"corridor {COMPILED}"] for t in times]))
    return {"ms": medians, "scipy_to_compiled": ratios, "learned_to_corridor": learned}


def speed_table(result: Mapping[str, Any]) -> str:
    """Return the figures as Markdown; ``result`` is what ``--json`` writes."""
    head = ["side", "path", "", "corridor", "", "repair", "", "learned", "learned / corridor"]
    kinds = ["", *("compiled", "SciPy") * len(ROWS), "", ""]
    rows = [kinds]
    for size, summary in result["sizes"].items():
        ms = summary["ms"]
        cells = [f"{ms[f'{row} {kind}']:.3g}" for row in ROWS for kind in (COMPILED, SCIPY)]
        ratio = f"{summary['learned_to_corridor']:.2f}"
        rows.append([f"{size} px", *cells, f"{ms['learned']:.3g}", ratio])
    return table(head, rows)


def print_rows(size: int, summary: dict[str, Any]) -> None:
    ms, ratios = summary["ms"], summary["scipy_to_compiled"]
    for row in ROWS:
        print(
            f"{size:5} px  {row:9} compiled {ms[f'{row} {COMPILED}']:8.2f} ms  "
            f"SciPy {ms[f'{row} {SCIPY}']:8.1f} ms  ratio {ratios[row]:6.1f}"
        )
    print(
        f"{size:5} px  learned {ms['learned']:.1f} ms, {summary['learned_to_corridor']:.2f} times "
        f"the corridor; SciPy's paths {ratios['length']:.4f} times as long",
        flush=True,
    )


if __name__ == "__main__":
    main()
